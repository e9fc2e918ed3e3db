//! The same way in more time.

use super::{Motion, MotionDataset};
use crate::CurriculumError;

impl Motion {
    /// The same path `times` times slower, with samples as often as before: velocities are smaller by
    /// `times` and accelerations by its square. Its name says so: `wipe_01 ×2`.
    ///
    /// Between samples positions are cubics that have the samples' velocities, and velocities cubics that
    /// have the accelerations; accelerations are linear.
    ///
    /// # Errors
    /// `times` is not a number from 1.
    pub fn slower(&self, times: f64) -> Result<Self, CurriculumError> {
        if !(times.is_finite() && times >= 1.0) {
            let must_be = "a number from 1, how many times longer the motion takes";
            return Err(CurriculumError::Value { what: "the slowness of a motion", value: times, must_be });
        }
        let (joints, period_s) = (self.joints, self.period_s);
        // Rounding must not lose the last sample.
        let samples = ((self.samples() - 1) as f64 * times + 1e-9) as usize + 1;
        let mut signals = [0; 3].map(|_| Vec::with_capacity(samples * joints));
        for sample in 0..samples {
            let place = sample as f64 / times;
            let before = (place as usize).min(self.samples() - 2);
            let x = (place - before as f64).clamp(0.0, 1.0);
            let [[q0, v0, a0], [q1, v1, a1]] = [self.sample(before), self.sample(before + 1)];
            for joint in 0..joints {
                let cubic = |value: [f64; 2], slope: [f64; 2]| hermite(x, period_s, value, slope);
                signals[0].push(cubic([q0[joint], q1[joint]], [v0[joint], v1[joint]]));
                signals[1].push(cubic([v0[joint], v1[joint]], [a0[joint], a1[joint]]) / times);
                signals[2].push((a0[joint] + x * (a1[joint] - a0[joint])) / (times * times));
            }
        }
        let name = format!("{} ×{times}", self.name);
        let slower = Motion::new(&name, &self.task, joints, period_s, signals)?;
        Ok(Motion { times_slower: self.times_slower * times, ..slower })
    }
}

/// The cubic with these values and slopes at both ends of a step of `period_s`, at its share `x`.
fn hermite(x: f64, period_s: f64, [y0, y1]: [f64; 2], [s0, s1]: [f64; 2]) -> f64 {
    let left = 1.0 - x;
    y0 * (1.0 + 2.0 * x) * left * left
        + y1 * (3.0 - 2.0 * x) * x * x
        + period_s * x * left * (s0 * left - s1 * x)
}

impl MotionDataset {
    /// The motions, and after them all of them once more for each of `times`, so many times slower. The
    /// motion that one of index i was made of is i modulo the number of motions.
    ///
    /// # Errors
    /// One of `times` is not a number from 1.
    pub fn with_slower(self, times: &[f64]) -> Result<Self, CurriculumError> {
        let recorded = self.motions.len();
        let mut motions = self.motions;
        for &times in times {
            for index in 0..recorded {
                motions.push(motions[index].slower(times)?);
            }
        }
        Ok(MotionDataset { motions })
    }
}
