//! What encoders say of a motion, period by period.

use phiw_telemetry::Recording;
use serde::{Deserialize, Serialize};

/// Standard deviation of rounding to a step, over the step: 1/√12.
pub(crate) const ROUNDING: f64 = 0.288_675_134_594_812_9;
/// Unknowns of a cubic between two knots: angle, and speed times the period, at each.
pub(crate) const CUBIC: usize = 4;
/// Elements of the lower triangle of the products of their shares.
const TRIANGLE: usize = CUBIC * (CUBIC + 1) / 2;

/// Shares of a cubic's four unknowns in the angle at `x` of a period (Hermite).
pub(crate) fn hermite(x: f64) -> [f64; CUBIC] {
    let y = 1.0 - x;
    [(1.0 + 2.0 * x) * y * y, x * y * y, x * x * (1.0 + 2.0 * y), -x * x * y]
}

/// The readings of a motion's encoders as normal equations of a cubic in each period: all that a smoothing
/// needs of them, however many there were.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Readings {
    /// Standard deviation of a reading of each joint \[rad, m\].
    pub(crate) noise: Vec<f64>,
    /// For each period, the lower triangle of Σ shares·sharesᵀ: all joints are read at once.
    pub(crate) products: Vec<f64>,
    /// For each period and joint, Σ shares·angle.
    pub(crate) sums: Vec<f64>,
}

impl Readings {
    pub(crate) fn of(recording: &Recording, places: &[f64], periods: usize, steps: &[f64]) -> Self {
        let joints = recording.joints.len();
        let mut readings = Readings {
            noise: steps.iter().map(|step| ROUNDING * step).collect(),
            products: vec![0.0; periods * TRIANGLE],
            sums: vec![0.0; periods * joints * CUBIC],
        };
        for (place, angles) in places.iter().zip(recording.q.chunks_exact(joints)) {
            let period = (place.max(0.0) as usize).min(periods - 1);
            let shares = hermite(place - period as f64);
            let mut element = period * TRIANGLE;
            for high in 0..CUBIC {
                for low in 0..=high {
                    readings.products[element] += shares[high] * shares[low];
                    element += 1;
                }
            }
            for (joint, angle) in angles.iter().enumerate() {
                let first = (period * joints + joint) * CUBIC;
                for (sum, share) in readings.sums[first..first + CUBIC].iter_mut().zip(shares) {
                    *sum += share * angle;
                }
            }
        }
        readings
    }

    /// Σ shares·sharesᵀ of a period, and for a joint what its readings have beside a cubic, Σ shares·(angle −
    /// cubic).
    pub(crate) fn of_period(
        &self,
        period: usize,
        joint: usize,
        cubic: [f64; CUBIC],
    ) -> ([[f64; CUBIC]; CUBIC], [f64; CUBIC]) {
        let mut products = [[0.0; CUBIC]; CUBIC];
        let mut element = period * TRIANGLE;
        for high in 0..CUBIC {
            for low in 0..=high {
                products[high][low] = self.products[element];
                products[low][high] = self.products[element];
                element += 1;
            }
        }
        let first = (period * self.noise.len() + joint) * CUBIC;
        let left = std::array::from_fn(|row| {
            let own: f64 = products[row].iter().zip(cubic).map(|(product, value)| product * value).sum();
            self.sums[first + row] - own
        });
        (products, left)
    }
}
