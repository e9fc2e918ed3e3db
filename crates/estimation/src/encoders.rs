//! The motion at each command, from encoders alone.
//!
//! A command is held until the next, and with it, nearly, the acceleration: friction takes some of it within
//! the period. So a joint's angle is a cubic between commands: it is continuous, its speed is continuous, and
//! its acceleration jumps where a command, or the noise in it, does. A filter would smear such a jump over
//! the periods around it, and what the noise of a period has done to the motion would be in the periods
//! before it. (Were the acceleration constant in each period, frictions would come out a third too large.)
//!
//! Where encoders are read several times a period, their readings alone decide. Where they are read once a
//! period, a speed that alternates from knot to knot is not seen by them: the accelerations are then held to
//! their mean over the neighbouring periods, each within the spread that the readings show.

use crate::banded::Banded;
use crate::readings::{ROUNDING, Readings, hermite};
use crate::{EstimationError, MotionLog};
use phiw_dynamics::check::check_size;
use phiw_telemetry::Recording;

/// Periods on either side over which the mean acceleration is taken.
const NEIGHBOURS: usize = 5;
/// Standard deviation of what an acceleration changes by within a period, over that of the acceleration: a
/// forearm behind a large gear loses a third to friction.
const CHANGE: f64 = 0.3;

impl MotionLog {
    /// From a recording of encoders alone, read every `recording` period or less often than every `period_s`
    /// \[s\], for which a command is held; the first row is that of a command. `steps` are those of each
    /// joint's encoder \[rad, m\]. The torques are those recorded nearest to each command.
    ///
    /// # Errors
    /// It is shorter than three periods.
    pub fn of_encoders(recording: &Recording, period_s: f64, steps: &[f64]) -> Result<Self, EstimationError> {
        let joints = recording.joints.len();
        check_size("steps of the encoders", steps.len(), joints)?;
        let (Some(&first), Some(&last)) = (recording.t.first(), recording.t.last()) else {
            return Err(EstimationError::Log("it has no rows"));
        };
        let periods = ((last - first) / period_s + 1e-6).floor() as usize;
        if periods < 3 {
            return Err(EstimationError::Log("it is shorter than three control periods"));
        }
        let rows = periods + 1;
        let places: Vec<f64> = recording.t.iter().map(|t| (t - first) / period_s).collect();
        let mut log = MotionLog { joints, period_s, ..MotionLog::default() };
        (log.q, log.qd) = (vec![0.0; rows * joints], vec![0.0; rows * joints]);
        for (joint, &step) in steps.iter().enumerate() {
            let angles: Vec<f64> = recording.q.iter().skip(joint).step_by(joints).copied().collect();
            let knots = Spline { places: &places, angles: &angles, periods }.fit(step);
            for (row, knot) in knots.chunks_exact(2).enumerate() {
                log.q[row * joints + joint] = knot[0];
                log.qd[row * joints + joint] = knot[1] / period_s;
            }
        }
        log.readings = Some(Readings::of(recording, &places, periods, steps));
        let mut nearest = 0;
        for row in 0..rows {
            let away = |sample: usize| (places[sample] - row as f64).abs();
            while nearest + 1 < places.len() && away(nearest + 1) <= away(nearest) {
                nearest += 1;
            }
            log.tau.extend_from_slice(
                recording.tau.get(nearest * joints..(nearest + 1) * joints).unwrap_or(&[]),
            );
        }
        Ok(log)
    }
}

/// Readings of one joint, at places counted in periods.
struct Spline<'a> {
    places: &'a [f64],
    angles: &'a [f64],
    periods: usize,
}

impl Spline<'_> {
    /// Angle, and speed times the period, at each knot.
    fn fit(&self, step: f64) -> Vec<f64> {
        let expected = self.expected();
        let spread = self.spread(&expected, step);
        let noise = (ROUNDING * step).max(1e-9 * spread).max(1e-12);
        let mut system = Banded::new(2 * (self.periods + 1), 4);
        for (&place, &angle) in self.places.iter().zip(self.angles) {
            let first = (place.max(0.0) as usize).min(self.periods - 1);
            let shares = hermite(place - first as f64);
            system.add(2 * first, &shares, angle, 1.0);
        }
        let weight = |spread: f64| if spread > 0.0 { (noise / spread).powi(2) } else { 1.0 };
        for (period, &acceleration) in expected.iter().enumerate() {
            // The mean acceleration, times the period's square, and how far it changes within the period.
            system.add(2 * period, &[0.0, -1.0, 0.0, 1.0], acceleration, weight(spread));
            system.add(2 * period, &[12.0, 6.0, -12.0, 6.0], 0.0, weight(CHANGE * spread));
        }
        system.solve().1
    }

    /// Angles at the knots, of the readings nearest to them.
    fn at_knots(&self) -> Vec<f64> {
        let mut nearest = 0;
        (0..=self.periods)
            .map(|knot| {
                let away = |sample: usize| (self.places[sample] - knot as f64).abs();
                while nearest + 1 < self.places.len() && away(nearest + 1) <= away(nearest) {
                    nearest += 1;
                }
                self.angles[nearest]
            })
            .collect()
    }

    /// The acceleration of each period, times its square, as its neighbours have it: the change of speed over
    /// them all.
    fn expected(&self) -> Vec<f64> {
        let knots = self.at_knots();
        let reach = NEIGHBOURS.min((self.periods - 1) / 2).max(1);
        (0..self.periods)
            .map(|period| {
                let middle = period.clamp(reach, self.periods - reach);
                let [before, here, after] = [middle - reach, middle, middle + reach].map(|knot| knots[knot]);
                (before - 2.0 * here + after) / (reach * reach) as f64
            })
            .collect()
    }

    /// Standard deviation of the accelerations about those, times the period's square: the second difference
    /// of the knots is the mean of two of them, and has the readings' rounding in it.
    fn spread(&self, expected: &[f64], step: f64) -> f64 {
        let knots = self.at_knots();
        let rounding = 6.0 * (ROUNDING * step).powi(2);
        let squares = knots.windows(3).zip(expected.windows(2)).map(|(knots, expected)| {
            let mean = 0.5 * (expected[0] + expected[1]);
            (knots[0] - 2.0 * knots[1] + knots[2] - mean).powi(2)
        });
        let mean = squares.sum::<f64>() / (knots.len() - 2) as f64;
        (2.0 * (mean - rounding)).max(rounding).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Commands that jump every period, as noise makes them.
    fn jumping(readings: usize, step: f64) -> (Recording, Vec<f64>, Vec<f64>) {
        let period_s = 0.01;
        let (mut q, mut v) = (0.3, 0.0);
        let (mut recording, mut angles, mut speeds) =
            (Recording { joints: vec!["a".to_owned()], ..Recording::default() }, vec![q], vec![v]);
        let mut random = 7_u64;
        for period in 0..400 {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let noise = (random >> 33) as f64 / f64::from(1_u32 << 30) - 1.0;
            let acceleration = 2.0 * (0.03 * f64::from(period)).sin() + 4.0 * noise;
            for reading in 0..readings {
                let t = period_s * reading as f64 / readings as f64;
                recording.t.push(period_s * f64::from(period) + t);
                let angle: f64 = q + v * t + 0.5 * acceleration * t * t;
                recording.q.push(if step > 0.0 { (angle / step).round() * step } else { angle });
                recording.tau.push(f64::from(period));
            }
            q += v * period_s + 0.5 * acceleration * period_s * period_s;
            v += acceleration * period_s;
            angles.push(q);
            speeds.push(v);
        }
        (recording, angles, speeds)
    }

    #[test]
    fn a_motion_with_jumping_accelerations_comes_back() -> Result<(), EstimationError> {
        // 17 bits at 1 kHz; many bits; 17 bits once a period.
        let bits = std::f64::consts::TAU / f64::from(1 << 17);
        for (readings, step, worst) in [(10, bits, 5e-3), (10, bits * 1e-3, 1e-4), (1, bits, 5e-2)] {
            let (recording, _, speeds) = jumping(readings, step);
            let log = MotionLog::of_encoders(&recording, 0.01, &[step])?;
            assert_eq!(log.tau[5], 5.0);
            let error = log.qd.iter().zip(&speeds).skip(5).take(380).map(|(a, b)| (a - b).abs());
            let error = error.fold(0.0, f64::max);
            assert!(error < worst, "{readings} readings of {step}: {error}");
        }
        Ok(())
    }
}
