//! A joint that swings about its middle: a few harmonics that set in and end at rest, within the joint's
//! limits.

use phiw_dynamics::Tree;
use std::f64::consts::TAU;

/// Harmonics of each joint, as most of the literature takes.
const HARMONICS: usize = 5;
/// Time in which a motion sets in and ends \[s\].
const RAMP_S: f64 = 0.5;
/// Joints without limits are taken to turn so far to either side \[rad\], and to be so fast \[rad/s\].
const UNLIMITED: [f64; 2] = [2.0, 4.0];
/// Shares of the limits of position and speed that are used: the rest is for a motion that is not the one
/// that was asked for.
const USED: [f64; 2] = [0.7, 0.7];
/// Time between the samples at which the largest swing of a shape is looked for \[s\].
const SHAPE_S: f64 = 0.05;
/// Coefficients, free of all limits: for each joint the middle, the size and two for each harmonic.
pub const FREE: usize = 2 + 2 * HARMONICS;

/// The motion of one joint.
pub struct Swing {
    middle: f64,
    amplitude: f64,
    /// Sine and cosine of each harmonic.
    harmonics: [[f64; 2]; HARMONICS],
    duration_s: f64,
}

impl Swing {
    /// From numbers without limits: the middle, the size, and sine and cosine of each harmonic. Middle and
    /// amplitude are `size` of what these ask for, from the neutral position.
    pub fn new(tree: &Tree, joint: usize, free: &[f64], size: f64, duration_s: f64) -> Self {
        let limits = tree.joint(joint).limits;
        let bounded = |limit: f64, unlimited: f64| if limit.is_finite() { limit } else { unlimited };
        let neutral = tree.neutral_configuration()[joint];
        let lower = bounded(limits.lower, neutral - UNLIMITED[0]);
        let upper = bounded(limits.upper, neutral + UNLIMITED[0]);
        let fastest = USED[1] * limits.velocity.min(UNLIMITED[1]);
        let half = 0.5 * USED[0] * (upper - lower);
        let wanted = 0.5 * (lower + upper) + half * free[0].tanh();
        let mut harmonics = [[0.0; 2]; HARMONICS];
        for (own, free) in harmonics.iter_mut().zip(free[2..].chunks_exact(2)) {
            own.copy_from_slice(free);
        }
        let mut swing =
            Swing { middle: neutral + size * (wanted - neutral), amplitude: 1.0, harmonics, duration_s };
        // The largest swing and speed of the shape, over its samples.
        let mut largest: [f64; 2] = [f64::MIN_POSITIVE; 2];
        let mut t = 0.0;
        while t < duration_s {
            let [q, v, _] = swing.at(t);
            largest = [largest[0].max((q - swing.middle).abs()), largest[1].max(v.abs())];
            t += SHAPE_S;
        }
        let room = half - (swing.middle - 0.5 * (lower + upper)).abs();
        let share = 1.0 / (1.0 + (-free[1]).exp());
        swing.amplitude = (size * share * room.max(0.0) / largest[0]).min(fastest / largest[1]);
        swing
    }

    /// Position \[rad, m\], velocity and acceleration.
    pub fn at(&self, t: f64) -> [f64; 3] {
        let mut shape = [0.0; 3];
        for (k, [sine, cosine]) in self.harmonics.iter().enumerate() {
            let rate = TAU * (k + 1) as f64 / self.duration_s;
            let (s, c) = (rate * t).sin_cos();
            shape[0] += sine * s + cosine * c;
            shape[1] += rate * (sine * c - cosine * s);
            shape[2] -= rate * rate * (sine * s + cosine * c);
        }
        let left = ramp(t);
        let [right, slope, bend] = ramp(self.duration_s - t);
        let right = [right, -slope, bend];
        let window = product(left, right);
        let [q, v, a] = product(window, shape);
        [self.middle + self.amplitude * q, self.amplitude * v, self.amplitude * a]
    }
}

/// From 0 to 1 in `RAMP_S`, with two continuous derivatives.
fn ramp(t: f64) -> [f64; 3] {
    let x = (t / RAMP_S).clamp(0.0, 1.0);
    let value = x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
    let slope = 30.0 * x * x * (1.0 - x) * (1.0 - x);
    let bend = 60.0 * x * (1.0 - x) * (1.0 - 2.0 * x);
    [value, slope / RAMP_S, bend / (RAMP_S * RAMP_S)]
}

/// A product's value and two derivatives.
fn product(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2]]
}

#[cfg(test)]
mod tests {
    use super::{FREE, Swing};
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
    use proptest::prelude::*;

    const DURATION_S: f64 = 6.0;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]

        /// Whatever the coefficients, each joint stays within its limits, begins and ends at rest, and has
        /// the derivatives that it says.
        #[test]
        fn a_swing_keeps_the_limits_and_its_word(
            free in prop::collection::vec(-3.0..3.0f64, FREE),
            size in 0.01..1.0f64,
        ) {
            let robot = crate::environment::workspace_root().unwrap().join("models/upper_body18.urdf");
            let tree = read_urdf_file(&robot, &UrdfOptions::default()).unwrap().tree;
            for joint in 0..tree.joint_count() {
                let limits = tree.joint(joint).limits;
                let swing = Swing::new(&tree, joint, &free, size, DURATION_S);
                for end in [0.0, DURATION_S] {
                    let [_, v, a] = swing.at(end);
                    prop_assert!(v.abs() < 1e-9 && a.abs() < 1e-9, "{v} {a}");
                }
                for step in 1..120 {
                    let t = DURATION_S * f64::from(step) / 120.0;
                    let [q, v, a] = swing.at(t);
                    prop_assert!(q >= limits.lower && q <= limits.upper, "{q}");
                    prop_assert!(v.abs() <= limits.velocity, "{v}");
                    let h = 1e-5;
                    let [[q0, v0, _], [q1, v1, _]] = [swing.at(t - h), swing.at(t + h)];
                    prop_assert!(((q1 - q0) / (2.0 * h) - v).abs() < 1e-4 * (1.0 + v.abs()), "{v}");
                    prop_assert!(((v1 - v0) / (2.0 * h) - a).abs() < 1e-3 * (1.0 + a.abs()), "{a}");
                }
            }
        }
    }
}
