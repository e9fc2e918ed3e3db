//! Smoothing and differentiating whole stretches of samples.

use crate::kernel::{EndTaps, SmoothingKernel};
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use std::ops::Range;
use std::sync::Arc;

/// Applies a [`SmoothingKernel`] to many samples at once: by fast convolution (overlap-save) where the full
/// kernel fits, tap by tap at the ends of a segment.
pub(crate) struct Differentiator {
    kernel: SmoothingKernel,
    forward: Arc<dyn RealToComplex<f64>>,
    backward: Arc<dyn ComplexToReal<f64>>,
    /// Spectra of the three kernels, scaled for the unnormalised transforms.
    responses: [Vec<Complex<f64>>; 3],
    time: Vec<f64>,
    signal: Vec<Complex<f64>>,
    product: Vec<Complex<f64>>,
    scratch: Vec<Complex<f64>>,
    end_taps: EndTaps,
}

impl Differentiator {
    pub fn new(kernel: SmoothingKernel) -> Self {
        let half = kernel.half_length();
        let size = (8 * half).next_power_of_two().max(256);
        let mut planner = RealFftPlanner::new();
        let (forward, backward) = (planner.plan_fft_forward(size), planner.plan_fft_inverse(size));
        let mut time = forward.make_input_vec();
        let scratch = forward.get_scratch_len().max(backward.get_scratch_len());
        let mut scratch = vec![Complex::default(); scratch];
        let responses = std::array::from_fn(|order| {
            time.fill(0.0);
            for (j, tap) in kernel.taps(order).iter().enumerate() {
                // Correlation is convolution with the reversed kernel, whose middle lies at time 0.
                time[(size + half - j) % size] = tap / size as f64;
            }
            let mut response = forward.make_output_vec();
            // Fails only where lengths do not match, and they come from the plan itself.
            let _ = forward.process_with_scratch(&mut time, &mut response, &mut scratch);
            response
        });
        Differentiator {
            signal: forward.make_output_vec(),
            product: forward.make_output_vec(),
            kernel,
            forward,
            backward,
            responses,
            time,
            scratch,
            end_taps: Default::default(),
        }
    }

    /// Smooths and differentiates several signals of a segment of `length` samples.
    ///
    /// `wanted` says for each signal which of value, first and second derivative are asked for; `x(signal,
    /// k)` is sample k, known within a half-length around `range`; `put(signal, order, k, value)` gets the
    /// results for all k in `range`.
    pub fn apply(
        &mut self,
        wanted: &[[bool; 3]],
        length: usize,
        range: Range<usize>,
        x: impl Fn(usize, usize) -> f64,
        mut put: impl FnMut(usize, usize, usize, f64),
    ) {
        let half = self.kernel.half_length();
        // Samples for which the full kernel lies inside the segment.
        let inner_start = half.clamp(range.start, range.end);
        let inner_end = length.saturating_sub(half).clamp(inner_start, range.end);
        for k in (range.start..inner_start).chain(inner_end..range.end) {
            self.kernel.taps_at_end(k, length - 1 - k, &mut self.end_taps);
            for (signal, wanted) in wanted.iter().enumerate() {
                self.at_end(wanted, k, |k| x(signal, k), |order, value| put(signal, order, k, value));
            }
        }
        let chunk = self.time.len() - 2 * half;
        for start in (inner_start..inner_end).step_by(chunk) {
            let part = start..(start + chunk).min(inner_end);
            for (signal, wanted) in wanted.iter().enumerate() {
                self.inside(
                    wanted,
                    part.clone(),
                    |k| x(signal, k),
                    |order, k, value| put(signal, order, k, value),
                );
            }
        }
    }

    fn at_end(
        &self,
        wanted: &[bool; 3],
        k: usize,
        x: impl Fn(usize) -> f64,
        mut put: impl FnMut(usize, f64),
    ) {
        let first = k - self.end_taps.before;
        // The middle sample is subtracted first: the sums are smaller then, and so is their rounding error.
        let middle = x(k);
        for order in (0..3).filter(|&order| wanted[order]) {
            let taps = self.end_taps.taps[order].iter().enumerate();
            let sum: f64 = taps.map(|(j, tap)| tap * (x(first + j) - middle)).sum();
            put(order, if order == 0 { middle + sum } else { sum });
        }
    }

    fn inside(
        &mut self,
        wanted: &[bool; 3],
        range: Range<usize>,
        x: impl Fn(usize) -> f64,
        mut put: impl FnMut(usize, usize, f64),
    ) {
        let half = self.kernel.half_length();
        let first = range.start - half;
        let needed = range.len() + 2 * half;
        let middle = x(range.start);
        for (i, value) in self.time.iter_mut().enumerate() {
            *value = if i < needed { x(first + i) - middle } else { 0.0 };
        }
        if self.forward.process_with_scratch(&mut self.time, &mut self.signal, &mut self.scratch).is_err() {
            return;
        }
        for order in (0..3).filter(|&order| wanted[order]) {
            for ((product, signal), response) in
                self.product.iter_mut().zip(&self.signal).zip(&self.responses[order])
            {
                *product = signal * response;
            }
            // The inverse transform requires these two to be real; rounding may leave an imaginary part.
            let last = self.product.len() - 1;
            self.product[0].im = 0.0;
            self.product[last].im = 0.0;
            let _ = self.backward.process_with_scratch(&mut self.product, &mut self.time, &mut self.scratch);
            for (i, k) in range.clone().enumerate() {
                let value = self.time[half + i];
                put(order, k, if order == 0 { middle + value } else { value });
            }
        }
    }
}
