//! Power spectra of the signals, estimated in one pass.

use crate::columns::Layout;
use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::Arc;

/// One-sided power spectral densities (Welch 1967: Hann windows, half overlapped, never across a gap).
///
/// Of a position it is the density of its second difference, the acceleration: a position has so much power
/// near 0 Hz that it would leak through the window and hide the noise at high frequency; its second
/// difference does not.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Spectrum {
    /// Distance of the bins, in Hz; bin k is at k times it. The last one is half the sample rate.
    #[serde(with = "crate::any_number")]
    pub resolution_hz: f64,
    /// Windows averaged over; 0 where no segment is long enough, and the densities are empty then.
    pub windows: usize,
    /// `[joint][bin]`: acceleration by second differences, in (rad/s²)²/Hz or (m/s²)²/Hz.
    pub acceleration: Vec<Vec<f64>>,
    /// `[joint][bin]`: torque, in (N·m)²/Hz or N²/Hz; empty without torque.
    pub torque: Vec<Vec<f64>>,
}

impl Spectrum {
    /// |second difference|² at a bin relative to a position's power: (2 sin(πfP)/P)⁴, near (2πf)⁴.
    pub fn second_difference_gain(&self, bin: usize) -> f64 {
        let bins = self.acceleration.first().map_or(1, Vec::len).max(2) - 1;
        let rate = 2.0 * bins as f64 * self.resolution_hz;
        (2.0 * rate * (PI * bin as f64 / (2.0 * bins as f64)).sin()).powi(4)
    }

    /// Density of a joint's position at a bin above 0, in rad²/Hz or m²/Hz.
    pub fn position(&self, joint: usize, bin: usize) -> f64 {
        self.acceleration[joint][bin] / self.second_difference_gain(bin)
    }
}

/// Two estimates side by side, with long windows and with short ones for logs of short segments.
pub(crate) struct SpectrumEstimator {
    long: Welch,
    short: Welch,
    previous: [Vec<f64>; 2],
    seen: usize,
    row: Vec<f64>,
    period: f64,
}

/// Aimed length of a long window, in seconds: a resolution of half a hertz.
const LONG_WINDOW: f64 = 2.0;

impl SpectrumEstimator {
    pub fn new(layout: &Layout, period: f64) -> Self {
        let channels = layout.joints * (1 + usize::from(layout.torque));
        let samples = (LONG_WINDOW / period).clamp(256.0, 8192.0) as usize;
        let long = samples.next_power_of_two().min(8192);
        SpectrumEstimator {
            long: Welch::new(long, channels, layout.joints),
            short: Welch::new(long / 8, channels, layout.joints),
            previous: [vec![0.0; layout.joints], vec![0.0; layout.joints]],
            seen: 0,
            row: vec![0.0; channels],
            period,
        }
    }

    /// A sample: positions and torques.
    pub fn push(&mut self, q: &[f64], tau: &[f64]) {
        let per_square = 1.0 / (self.period * self.period);
        let [before, last] = &mut self.previous;
        for joint in 0..q.len() {
            self.row[joint] = (q[joint] - 2.0 * last[joint] + before[joint]) * per_square;
        }
        std::mem::swap(before, last);
        last.copy_from_slice(q);
        self.seen += 1;
        if self.seen > 2 {
            self.row[q.len()..].copy_from_slice(tau);
            self.long.push(&self.row);
            self.short.push(&self.row);
        }
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.seen = 0;
        self.long.filled = 0;
        self.short.filled = 0;
    }

    /// The estimate with long windows, or with short ones where segments are too short for at least two.
    pub fn finish(self, joints: usize) -> Spectrum {
        let welch = if self.long.windows >= 2 { self.long } else { self.short };
        let rate = 1.0 / self.period;
        let mut densities = welch.densities(rate);
        let torque = densities.split_off(joints.min(densities.len()));
        Spectrum {
            resolution_hz: rate / welch.samples as f64,
            windows: welch.windows,
            acceleration: densities,
            torque,
        }
    }
}

struct Welch {
    samples: usize,
    /// Channels from this one on get their mean subtracted.
    centred_from: usize,
    fft: Arc<dyn RealToComplex<f64>>,
    window: Vec<f64>,
    /// `[channel][sample]`, flat.
    buffer: Vec<f64>,
    filled: usize,
    windows: usize,
    /// `[channel][bin]`, flat.
    power: Vec<f64>,
    input: Vec<f64>,
    output: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
}

impl Welch {
    fn new(samples: usize, channels: usize, centred_from: usize) -> Self {
        let fft = RealFftPlanner::new().plan_fft_forward(samples);
        Welch {
            samples,
            centred_from,
            window: (0..samples).map(|i| (PI * (i as f64 + 0.5) / samples as f64).sin().powi(2)).collect(),
            buffer: vec![0.0; channels * samples],
            filled: 0,
            windows: 0,
            power: vec![0.0; channels * (samples / 2 + 1)],
            input: fft.make_input_vec(),
            output: fft.make_output_vec(),
            scratch: fft.make_scratch_vec(),
            fft,
        }
    }

    fn push(&mut self, row: &[f64]) {
        for (channel, &value) in self.buffer.chunks_exact_mut(self.samples).zip(row) {
            channel[self.filled] = value;
        }
        self.filled += 1;
        if self.filled == self.samples {
            self.take_window();
        }
    }

    fn take_window(&mut self) {
        let half = self.samples / 2;
        for (index, channel) in self.buffer.chunks_exact_mut(self.samples).enumerate() {
            let mean = channel.iter().sum::<f64>() / self.samples as f64;
            let mean = if index < self.centred_from { 0.0 } else { mean };
            for ((input, &x), &window) in self.input.iter_mut().zip(channel.iter()).zip(&self.window) {
                *input = (x - mean) * window;
            }
            // Fails only where lengths do not match, and they come from the plan itself.
            if self.fft.process_with_scratch(&mut self.input, &mut self.output, &mut self.scratch).is_ok() {
                for (power, value) in self.power[index * (half + 1)..].iter_mut().zip(&self.output) {
                    *power += value.norm_sqr();
                }
            }
            channel.copy_within(half.., 0);
        }
        self.filled = half;
        self.windows += 1;
    }

    fn densities(&self, rate: f64) -> Vec<Vec<f64>> {
        if self.windows == 0 {
            return Vec::new();
        }
        let energy: f64 = self.window.iter().map(|w| w * w).sum();
        let scale = 2.0 / (rate * energy * self.windows as f64);
        self.power
            .chunks_exact(self.samples / 2 + 1)
            .map(|power| power.iter().map(|p| p * scale).collect())
            .collect()
    }
}
