//! Filters without delay that torques go through before they are published.

use serde::Serialize;
use std::f64::consts::PI;

/// A filter over a whole log.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Smoothing {
    /// The mean over neighbouring samples, three times, of which half is left at the corner \[Hz\].
    Means {
        /// The corner \[Hz\].
        corner: f64,
    },
    /// A Butterworth filter of second order, forwards and backwards, of which half is left at the corner
    /// \[Hz\].
    Butterworth {
        /// The corner \[Hz\].
        corner: f64,
    },
}

/// Where the third power of sin(x)/x is a half.
const HALF_OF_THREE_MEANS: f64 = 1.150;

impl Smoothing {
    /// The frequency of which half is left \[Hz\].
    pub fn corner(self) -> f64 {
        let (Smoothing::Means { corner } | Smoothing::Butterworth { corner }) = self;
        corner
    }

    /// Smooths a joint's torques, sampled at `rate` \[Hz\].
    pub fn apply(self, rate: f64, values: &mut [f64]) {
        match self {
            Smoothing::Means { corner } => {
                let aside =
                    (0.5 * (HALF_OF_THREE_MEANS / PI * rate / corner - 1.0)).round().max(0.0) as usize;
                (0..3).for_each(|_| mean_of_neighbours(aside, values));
            }
            Smoothing::Butterworth { corner } => {
                for _ in 0..2 {
                    butterworth(corner / rate, values);
                    values.reverse();
                }
            }
        }
    }
}

/// The mean over `aside` samples to each side.
fn mean_of_neighbours(aside: usize, values: &mut [f64]) {
    let mut sums = vec![0.0];
    values.iter().for_each(|value| sums.push(sums[sums.len() - 1] + value));
    let count = values.len();
    for (sample, value) in values.iter_mut().enumerate() {
        let (from, to) = (sample.saturating_sub(aside), (sample + aside + 1).min(count));
        *value = (sums[to] - sums[from]) / (to - from) as f64;
    }
}

/// Second order, by the bilinear transform; begins at rest at the first value.
fn butterworth(corner_over_rate: f64, values: &mut [f64]) {
    let warped = (PI * corner_over_rate.min(0.45)).tan();
    let scale = 1.0 / (1.0 + std::f64::consts::SQRT_2 * warped + warped * warped);
    let direct = warped * warped * scale;
    let back = [
        2.0 * (warped * warped - 1.0) * scale,
        (1.0 - std::f64::consts::SQRT_2 * warped + warped * warped) * scale,
    ];
    let first = values.first().copied().unwrap_or_default();
    let ([mut x1, mut x2], [mut y1, mut y2]) = ([first; 2], [first; 2]);
    for value in values {
        let out = direct * (*value + 2.0 * x1 + x2) - back[0] * y1 - back[1] * y2;
        (x2, x1, y2, y1) = (x1, *value, y1, out);
        *value = out;
    }
}

#[cfg(test)]
mod tests {
    use super::Smoothing;
    use std::f64::consts::TAU;

    /// Half of a sinusoid is left at the corner, nearly all of it far below and nearly nothing far above, and
    /// it is not shifted.
    #[test]
    fn half_is_left_at_the_corner_without_a_delay() {
        let rate = 1000.0;
        for smoothing in [Smoothing::Means { corner: 5.0 }, Smoothing::Butterworth { corner: 5.0 }] {
            for (frequency, low, high) in [(0.5, 0.98, 1.01), (5.0, 0.48, 0.52), (20.0, -0.05, 0.05)] {
                let phase = |sample: usize| TAU * frequency * sample as f64 / rate;
                let mut values: Vec<f64> = (0..20_000).map(|sample| phase(sample).sin()).collect();
                smoothing.apply(rate, &mut values);
                let along = |shape: fn(f64) -> f64| {
                    (8000..12_000).map(|sample| values[sample] * shape(phase(sample))).sum::<f64>() / 2000.0
                };
                let (left, shifted) = (along(f64::sin), along(f64::cos));
                assert!((low..high).contains(&left), "{smoothing:?} {frequency}: {left}");
                assert!(shifted.abs() < 0.01, "{smoothing:?} {frequency}: {shifted}");
            }
        }
    }
}
