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
///
/// A joint that moves by a step and more from reading to reading has errors of rounding that know nothing of
/// each other. One that moves slower reads the same for a while, and so long its errors are one: these
/// readings count for one together. When they change, the angle is that between the two steps, as exactly as
/// the time of the change is known.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Readings {
    /// Standard deviation of a reading of each joint \[rad, m\].
    pub(crate) noise: Vec<f64>,
    /// For each period and joint, the lower triangle of Σ weight·shares·sharesᵀ.
    pub(crate) products: Vec<f64>,
    /// For each period and joint, Σ weight·shares·angle.
    pub(crate) sums: Vec<f64>,
}

/// What is known of an angle at a place, counted in periods, in the precision of a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Known {
    place: f64,
    angle: f64,
    weight: f64,
}

/// Longest run of equal readings that sharpens the change at its end. Beyond that the error is no longer
/// that of the time, since an encoder's own lines are a tenth of a step off. Set by hand, no command
/// calibrates it.
const LONGEST_RUN: usize = 10;

/// What readings say of one joint's angle.
fn known(places: &[f64], angles: &[f64], step: f64) -> Vec<Known> {
    let mut all = Vec::with_capacity(angles.len());
    let mut before: Option<usize> = None;
    let mut first = 0;
    for run in angles.chunk_by(|a, b| (a - b).abs() < 0.5 * step) {
        let weight = 1.0 / run.len() as f64;
        if let Some(before) = before
            && (angles[first] - angles[first - 1]).abs() < 1.5 * step
        {
            // Slower than a step in so many readings, it moved by less than a step over so many in one.
            let sharper = before.min(run.len()).min(LONGEST_RUN);
            if sharper > 1 {
                let middle = |values: &[f64]| 0.5 * (values[first - 1] + values[first]);
                let weight = (sharper * sharper) as f64;
                all.push(Known { place: middle(places), angle: middle(angles), weight });
            }
        }
        let readings = places[first..].iter().zip(run);
        all.extend(readings.map(|(&place, &angle)| Known { place, angle, weight }));
        before = Some(run.len());
        first += run.len();
    }
    all
}

impl Readings {
    pub(crate) fn of(recording: &Recording, places: &[f64], periods: usize, steps: &[f64]) -> Self {
        let joints = recording.joints.len();
        let mut readings = Readings {
            noise: steps.iter().map(|step| ROUNDING * step).collect(),
            products: vec![0.0; periods * joints * TRIANGLE],
            sums: vec![0.0; periods * joints * CUBIC],
        };
        for (joint, &step) in steps.iter().enumerate() {
            let angles: Vec<f64> = recording.q.iter().skip(joint).step_by(joints).copied().collect();
            for Known { place, angle, weight } in known(places, &angles, step) {
                let period = (place.max(0.0) as usize).min(periods - 1);
                let shares = hermite(place - period as f64);
                let own = period * joints + joint;
                let mut products = readings.products[own * TRIANGLE..].iter_mut();
                for high in 0..CUBIC {
                    for (low, product) in (0..=high).zip(&mut products) {
                        *product += weight * shares[high] * shares[low];
                    }
                }
                for (sum, share) in readings.sums[own * CUBIC..].iter_mut().zip(shares) {
                    *sum += weight * share * angle;
                }
            }
        }
        readings
    }

    /// Whether they are of a log of so many periods and joints: those that an earlier version wrote down are
    /// not.
    pub(crate) fn fits(&self, periods: usize, joints: usize) -> bool {
        let count = periods * joints;
        let sizes = [self.noise.len(), self.products.len(), self.sums.len()];
        sizes == [joints, count * TRIANGLE, count * CUBIC]
    }

    /// Σ weight·shares·sharesᵀ of a period and joint, and what its readings have beside a cubic, Σ
    /// weight·shares·(angle − cubic).
    pub(crate) fn of_period(
        &self,
        period: usize,
        joint: usize,
        cubic: [f64; CUBIC],
    ) -> ([[f64; CUBIC]; CUBIC], [f64; CUBIC]) {
        let own = period * self.noise.len() + joint;
        let mut products = [[0.0; CUBIC]; CUBIC];
        let mut element = own * TRIANGLE;
        for high in 0..CUBIC {
            for low in 0..=high {
                products[high][low] = self.products[element];
                products[low][high] = self.products[element];
                element += 1;
            }
        }
        let left = std::array::from_fn(|row| {
            let own_row: f64 = products[row].iter().zip(cubic).map(|(product, value)| product * value).sum();
            self.sums[own * CUBIC + row] - own_row
        });
        (products, left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readings_of_another_log_are_told() {
        let recording = Recording { joints: vec!["a".to_owned()], q: vec![0.0; 5], ..Recording::default() };
        let readings = Readings::of(&recording, &[0.0, 1.0, 2.0, 3.0, 4.0], 4, &[1e-3]);
        assert!(readings.fits(4, 1));
        assert!(!readings.fits(5, 1) && !readings.fits(2, 2) && !Readings::default().fits(4, 1));
    }

    /// A joint that takes four readings for a step, stands, and then takes two steps a reading.
    #[test]
    fn a_slow_joint_is_known_where_its_reading_changes() {
        let steps = [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 3.0, 5.0];
        let places: Vec<f64> = (0..steps.len()).map(|index| 0.1 * index as f64).collect();
        let all = known(&places, &steps, 1.0);
        let changes: Vec<&Known> = all.iter().filter(|known| known.weight > 1.0).collect();
        let [Known { place, angle, weight }] = changes[..] else { panic!("{changes:?}") };
        assert!((place - 0.35).abs() < 1e-12 && *angle == 0.5 && *weight == 16.0, "{changes:?}");
        let whole: f64 = all.iter().filter(|known| known.weight <= 1.0).map(|known| known.weight).sum();
        // Two runs and two readings that differ.
        assert!((whole - 4.0).abs() < 1e-12, "{whole}");
        // Readings of a sensor without steps are all different.
        assert_eq!(known(&places, &[0.0; 10], 0.0).len(), 10);
    }
}
