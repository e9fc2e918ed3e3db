//! Low-pass kernels and their derivatives.

use std::f64::consts::{PI, TAU};

/// A zero-phase low-pass as a windowed sinc: gain ½ at the cut-off, flat below 0.6 and nothing above 1.4 of
/// it.
///
/// Given as a function of time with its first two derivatives, so that a derivative of the filtered signal is
/// one convolution. The window is z²·I₂(z), z = β√(1−u²), a relative of Kaiser's I₀(z) that ends without a
/// step in value or slope: Kaiser's step of 0.3 % would bend the second derivative of slow motion by 1 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LowPass {
    /// Frequency where the gain is ½ (−6 dB), in Hz.
    pub cutoff_hz: f64,
    /// The window's shape.
    beta: f64,
    /// The kernel is zero from this time on, in seconds.
    half_width: f64,
}

impl LowPass {
    /// A low-pass with the given attenuation outside its band, and ripple inside it, in dB (50 to 110).
    pub fn new(cutoff_hz: f64, attenuation_db: f64) -> Self {
        // Lines through the shortest kernels that reach 62, 68, 82, 97 and 112 dB, found by trial.
        let beta = (attenuation_db - 17.0) / 7.2;
        let half_width = (0.65 + 0.375 * beta) / cutoff_hz;
        LowPass { cutoff_hz, beta, half_width }
    }

    /// Samples on one side of the middle one.
    pub fn half_length(&self, period: f64) -> usize {
        (self.half_width / period).floor().max(1.0) as usize
    }

    /// Kernel, first and second derivative `time` seconds off its middle, in 1/s, 1/s², 1/s³.
    pub fn at(&self, time: f64) -> [f64; 3] {
        let (s, w) = (self.sinc(time), self.window(time));
        [s[0] * w[0], s[1] * w[0] + s[0] * w[1], s[2] * w[0] + 2.0 * s[1] * w[1] + s[0] * w[2]]
    }

    /// sin(ωt)/(πt) and its derivatives.
    fn sinc(&self, time: f64) -> [f64; 3] {
        let omega = TAU * self.cutoff_hz;
        let x = omega * time;
        if x.abs() < 1e-2 {
            // Series, since the closed forms cancel.
            let x2 = x * x;
            return [
                omega / PI * (1.0 - x2 / 6.0 * (1.0 - x2 / 20.0)),
                omega * omega / PI * -x / 3.0 * (1.0 - x2 / 10.0 * (1.0 - x2 / 28.0)),
                omega.powi(3) / PI * -(1.0 - x2 * (0.3 - x2 / 56.0)) / 3.0,
            ];
        }
        let (sin, cos) = x.sin_cos();
        let first = (x * cos - sin) / (x * x);
        [omega / PI * sin / x, omega * omega / PI * first, omega.powi(3) / PI * (-sin / x - 2.0 * first / x)]
    }

    /// The window and its derivatives.
    pub(crate) fn window(&self, time: f64) -> [f64; 3] {
        let u = time / self.half_width;
        if u.abs() >= 1.0 {
            return [0.0; 3];
        }
        // d/dz z²I₂ = z²I₁, d/dz zI₁ = zI₀, dz/du = −β²u/z.
        let beta2 = self.beta * self.beta;
        let z2 = beta2 * (1.0 - u * u);
        let [i0, i1, i2] = bessel_ratios(z2);
        let scale = 1.0 / (beta2 * beta2 * bessel_ratios(beta2)[2]);
        let first = -beta2 * u * z2 * i1;
        let second = -beta2 * (z2 * i1 - beta2 * u * u * i0);
        [scale * z2 * z2 * i2, scale * first / self.half_width, scale * second / self.half_width.powi(2)]
    }
}

/// I₀(z), I₁(z)/z and I₂(z)/z² of z² (modified Bessel functions, by their power series: all terms are
/// positive).
fn bessel_ratios(z2: f64) -> [f64; 3] {
    let quarter = z2 / 4.0;
    std::array::from_fn(|n| {
        // I_n(z)/zⁿ = 2⁻ⁿ Σ (z²/4)^k / (k! (k+n)!).
        let mut term = [1.0, 0.5, 0.125][n];
        let mut sum = term;
        for k in 1..200 {
            term *= quarter / (k * (k + n)) as f64;
            sum += term;
            if term < 1e-17 * sum {
                break;
            }
        }
        sum
    })
}

/// Taps that smooth a sampled signal and differentiate it once and twice, exact for polynomials of third
/// degree.
///
/// Near the end of a segment, where the low-pass would stick out, taps of a local least-squares polynomial of
/// fifth degree take its place, so that no sample has to be invented; it follows motion in the band better
/// than any cut low-pass, and noise grows only in the last few samples.
///
/// Up to 0.6 of the cut-off the gains are the ideal ones to about 1e-4, with 80 dB. Only the second
/// derivative is worse where a cut-off above a tenth of the sample rate leaves few taps: 1e-3 at most.
#[derive(Debug, Clone, PartialEq)]
pub struct SmoothingKernel {
    low_pass: LowPass,
    period: f64,
    half_length: usize,
    /// Taps at offsets −half…half for value, first and second derivative.
    full: [Vec<f64>; 3],
}

impl SmoothingKernel {
    /// Degree of polynomials that pass the full kernel unchanged.
    const DEGREE: usize = 3;
    /// Degree of the local polynomial at the end of a segment.
    const DEGREE_AT_END: usize = 5;
    /// Its reach times the cut-off: where it has samples on both sides, its bandwidth is then about that of
    /// the low-pass.
    const REACH_AT_END: f64 = 1.5;
    /// Its least reach in samples: one side alone must determine it.
    const LEAST_REACH: f64 = 8.0;

    /// The taps of `low_pass` for samples `period` seconds apart.
    pub fn new(low_pass: LowPass, period: f64) -> Self {
        let half_length = low_pass.half_length(period).max(Self::LEAST_REACH as usize);
        let offsets =
            || (-(half_length as isize)..=half_length as isize).map(|offset| offset as f64 * period);
        let mut full = [const { Vec::new() }; 3];
        for [value, first, second] in offsets().map(|time| low_pass.at(time)) {
            // The tap at +j weighs the sample after, hence the odd derivative's sign.
            full[0].push(value * period);
            full[1].push(-first * period);
            full[2].push(second * period);
        }
        // A correction in the shape of the window makes the kernel exact for polynomials.
        let weights: Vec<f64> = offsets().map(|time| low_pass.window(time)[0]).collect();
        correct_moments(&weights, half_length, period, Self::DEGREE, &mut full);
        SmoothingKernel { low_pass, period, half_length, full }
    }

    /// Samples on one side of the middle one.
    pub fn half_length(&self) -> usize {
        self.half_length
    }

    /// The low-pass that the taps were made from.
    pub fn low_pass(&self) -> LowPass {
        self.low_pass
    }

    /// Taps for the value (order 0) and its derivatives (1, 2): the result at sample k is Σ taps\[j\]·x\[k −
    /// half + j\].
    ///
    /// # Panics
    /// For an order above 2.
    pub fn taps(&self, order: usize) -> &[f64] {
        &self.full[order]
    }

    /// Complex gain at a frequency in Hz, as (real, imaginary), of the taps of an order.
    ///
    /// # Panics
    /// For an order above 2.
    pub fn gain(&self, order: usize, frequency_hz: f64) -> (f64, f64) {
        let angle = TAU * frequency_hz * self.period;
        self.full[order].iter().enumerate().fold((0.0, 0.0), |(re, im), (j, tap)| {
            let (sin, cos) = (angle * (j as f64 - self.half_length as f64)).sin_cos();
            (re + tap * cos, im + tap * sin)
        })
    }

    /// Standard deviation of the value and its derivatives for unit white noise on the samples.
    pub fn noise_gain(&self) -> [f64; 3] {
        self.full.each_ref().map(|taps| root_sum_of_squares(taps))
    }

    /// The same where only `before` samples precede the middle one (fewer than
    /// [`half_length`](SmoothingKernel::half_length)).
    pub fn noise_gain_at_end(&self, before: usize) -> [f64; 3] {
        let mut taps = EndTaps::default();
        self.taps_at_end(before, self.half_length, &mut taps);
        taps.taps.each_ref().map(|taps| root_sum_of_squares(taps))
    }

    /// Taps where `before` samples precede and `after` follow the middle one, and one is too few for the full
    /// kernel.
    pub(crate) fn taps_at_end(&self, before: usize, after: usize, out: &mut EndTaps) {
        let reach = (Self::REACH_AT_END / (self.low_pass.cutoff_hz * self.period)).max(Self::LEAST_REACH);
        let last = (reach.ceil() as usize - 1).min(self.half_length);
        let (before, after) = (before.min(last), after.min(last));
        if (out.before, out.after) == (before, after) && !out.weights.is_empty() {
            return;
        }
        (out.before, out.after) = (before, after);
        out.weights.clear();
        // The triweight is smooth at the ends of its support, so taps change little from sample to sample.
        out.weights.extend(
            (0..=before + after).map(|j| (1.0 - ((j as f64 - before as f64) / reach).powi(2)).powi(3)),
        );
        for taps in &mut out.taps {
            taps.clear();
            taps.resize(before + after + 1, 0.0);
        }
        correct_moments(&out.weights, before, self.period, Self::DEGREE_AT_END, &mut out.taps);
    }
}

/// Taps of one place near the end of a segment.
#[derive(Debug, Default)]
pub(crate) struct EndTaps {
    /// Samples that they reach back.
    pub before: usize,
    after: usize,
    /// For value, first and second derivative.
    pub taps: [Vec<f64>; 3],
    weights: Vec<f64>,
}

fn root_sum_of_squares(taps: &[f64]) -> f64 {
    taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt()
}

/// Polynomial terms at most.
const TERMS: usize = 6;

/// Adds weights·polynomial to the taps for value, first and second derivative at sample `middle`, so that
/// they are exact for polynomials up to `degree`. From taps of zero this makes those of the weighted
/// least-squares polynomial.
fn correct_moments(weights: &[f64], middle: usize, period: f64, degree: usize, taps: &mut [Vec<f64>; 3]) {
    let terms = degree + 1;
    // Offsets from the centre in units of half the length: powers of −1…1 keep the small system well
    // conditioned.
    let half = (weights.len() - 1) as f64 / 2.0;
    let powers = |j: usize| {
        let u = (j as f64 - half) / half;
        let mut powers = [1.0; 2 * TERMS];
        for i in 1..powers.len() {
            powers[i] = powers[i - 1] * u;
        }
        powers
    };
    let mut gram = [[0.0; TERMS]; TERMS];
    for (j, weight) in weights.iter().enumerate() {
        let powers = powers(j);
        for (row, column) in (0..terms).flat_map(|row| (0..terms).map(move |column| (row, column))) {
            gram[row][column] += weight * powers[row + column];
        }
    }
    let at_middle = powers(middle);
    for (order, taps) in taps.iter_mut().enumerate() {
        // The exact operator applied to each power, minus the taps applied to it.
        let mut missing = [0.0; TERMS];
        for i in order..terms {
            let falling: usize = (i - order + 1..=i).product();
            missing[i] = falling as f64 * at_middle[i - order] / (half * period).powi(order as i32);
        }
        for (j, tap) in taps.iter().enumerate() {
            for (missing, power) in missing[..terms].iter_mut().zip(powers(j)) {
                *missing -= tap * power;
            }
        }
        let polynomial = solve(gram, missing, terms);
        for (j, tap) in taps.iter_mut().enumerate() {
            let value: f64 = polynomial[..terms].iter().zip(powers(j)).map(|(a, power)| a * power).sum();
            *tap += weights[j] * value;
        }
    }
}

/// Solves the leading `n`×`n` system by elimination with pivots; the matrix is a Gram matrix of distinct
/// points, so it is regular.
fn solve(mut a: [[f64; TERMS]; TERMS], mut b: [f64; TERMS], n: usize) -> [f64; TERMS] {
    for column in 0..n {
        let pivot =
            (column..n).max_by(|&i, &j| a[i][column].abs().total_cmp(&a[j][column].abs())).unwrap_or(column);
        a.swap(column, pivot);
        b.swap(column, pivot);
        for row in column + 1..n {
            let factor = a[row][column] / a[column][column];
            for k in column..n {
                a[row][k] -= factor * a[column][k];
            }
            b[row] -= factor * b[column];
        }
    }
    for row in (0..n).rev() {
        for k in row + 1..n {
            b[row] -= a[row][k] * b[k];
        }
        b[row] /= a[row][row];
    }
    b
}
