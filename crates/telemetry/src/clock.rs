//! The times at which samples were taken, where the stamps jitter.

use crate::columns::Layout;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What the time stamps of a log mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Clock {
    /// Samples were taken at equal distances; where stamps jitter, it is the stamping that does. The stamps
    /// are kept, and not used for differentiation.
    Uniform,
    /// Samples were taken when the stamps say; they are interpolated to equal distances (by cubics through
    /// four samples, inside a segment).
    Stamped,
}

impl fmt::Display for Clock {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Clock::Uniform => "uniform",
            Clock::Stamped => "stamped",
        })
    }
}

/// How the [`Clock`] is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum ClockChoice {
    /// The one under which the positions are smoother; see [`Survey::clock`](crate::Survey::clock).
    #[default]
    Auto,
    /// This one.
    Fixed(Clock),
}

/// Error of the middle of five samples against the cubic through the other four, at equal distances. White
/// noise of deviation σ gives σ·√70/6.
pub(crate) fn uniform_interpolation_error(x: [f64; 5]) -> f64 {
    x[2] - (4.0 * (x[1] + x[3]) - x[0] - x[4]) / 6.0
}

/// Error of the middle of five samples against the cubic through the other four, at the stamps `t`.
pub(crate) fn stamped_interpolation_error(t: [f64; 5], x: [f64; 5]) -> f64 {
    let weights = lagrange([t[0], t[1], t[3], t[4]], t[2]);
    x[2] - (weights[0] * x[0] + weights[1] * x[1] + weights[2] * x[3] + weights[3] * x[4])
}

/// Weights of four samples at stamps `t` in the value at `at` of the cubic through them.
pub(crate) fn lagrange(t: [f64; 4], at: f64) -> [f64; 4] {
    std::array::from_fn(|i| (0..4).filter(|&j| j != i).map(|j| (at - t[j]) / (t[i] - t[j])).product())
}

/// Interpolates the samples of a segment to equal distances, as they come.
pub(crate) struct Resampler {
    period: f64,
    width: usize,
    /// The last four samples, oldest first, flat.
    recent: Vec<f64>,
    seen: usize,
    t_start: f64,
    /// Grid points handed out.
    handed: usize,
    output: Vec<f64>,
    /// Values that are held, not interpolated, since they may be missing.
    held: Vec<bool>,
}

impl Resampler {
    pub fn new(period: f64, layout: &Layout) -> Self {
        let width = layout.width;
        Resampler {
            period,
            width,
            recent: vec![0.0; 4 * width],
            seen: 0,
            t_start: 0.0,
            handed: 0,
            output: vec![0.0; width],
            held: (0..width).map(|place| layout.may_be_missing(place)).collect(),
        }
    }

    /// Takes the next sample and hands out the grid points that are known by it.
    pub fn push(&mut self, values: &[f64], mut hand_out: impl FnMut(&[f64])) {
        if self.seen == 0 {
            self.t_start = values[0];
        }
        self.recent.copy_within(self.width.., 0);
        self.recent[3 * self.width..].copy_from_slice(values);
        self.seen += 1;
        if self.seen >= 4 {
            // The cubic is most accurate between its two middle samples; at the start of the segment it is
            // also used before them.
            let until = self.recent[2 * self.width];
            self.hand_out_until(until, &mut hand_out);
        }
    }

    /// The segment is over: hands out the rest and starts anew.
    pub fn end_segment(&mut self, mut hand_out: impl FnMut(&[f64])) {
        if self.seen >= 4 {
            // The last sample is kept if its stamp is late by rounding only.
            let until = self.recent[3 * self.width] + 1e-6 * self.period;
            self.hand_out_until(until, &mut hand_out);
        }
        self.seen = 0;
        self.handed = 0;
    }

    fn hand_out_until(&mut self, until: f64, hand_out: &mut impl FnMut(&[f64])) {
        let t: [f64; 4] = std::array::from_fn(|i| self.recent[i * self.width]);
        loop {
            let at = self.t_start + self.handed as f64 * self.period;
            if at > until {
                return;
            }
            let weights = lagrange(t, at);
            let nearest =
                (0..4).min_by(|&a, &b| (t[a] - at).abs().total_cmp(&(t[b] - at).abs())).unwrap_or(3);
            self.output[0] = at;
            for place in 1..self.width {
                self.output[place] = if self.held[place] {
                    self.recent[nearest * self.width + place]
                } else {
                    (0..4).map(|i| weights[i] * self.recent[i * self.width + place]).sum()
                };
            }
            hand_out(&self.output);
            self.handed += 1;
        }
    }
}
