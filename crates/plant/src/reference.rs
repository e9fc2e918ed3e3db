//! Where a motion should go.

use phiw_dynamics::Tree;
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

/// A motion to be followed: where the joints should be at a time.
///
/// Any closure `|t_s, q, v, a|` is one.
pub trait Reference {
    /// Writes positions \[rad, m\], velocities and accelerations of all joints `t_s` seconds after the
    /// motion's start.
    fn at(&self, t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]);
}

impl<F: Fn(f64, &mut [f64], &mut [f64], &mut [f64])> Reference for F {
    fn at(&self, t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        self(t_s, q, v, a);
    }
}

/// Time in which a multisine fades in and out \[s\].
const FADE_S: f64 = 1.5;
/// Reach taken for joints without limits \[rad, m\].
const UNLIMITED_REACH: f64 = 2.5;
/// Sines of each joint.
const SINES: usize = 7;

/// A sum of sines for each joint that begins and ends at rest: the usual excitation of identification.
#[derive(Clone, Debug, PartialEq)]
pub struct MultiSine {
    duration_s: f64,
    joints: Vec<FadedSines>,
}

/// A sum of sines that begins and ends at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct FadedSines {
    /// Where it begins and ends.
    pub center: f64,
    /// What the sines are about once they have faded in, against the centre.
    pub shift: f64,
    /// Amplitude, angular frequency \[rad/s\] and phase \[rad\] of each.
    pub terms: Vec<[f64; 3]>,
}

impl MultiSine {
    /// Random sines up to `highest_hz` that stay within the shares `reach` of each joint's range and `speed`
    /// of its speed limit (3 rad/s where it has none).
    pub fn random(
        tree: &Tree,
        duration_s: f64,
        highest_hz: f64,
        [reach, speed]: [f64; 2],
        rng: &mut impl Rng,
    ) -> Self {
        let joints = (0..tree.joint_count()).map(|joint| {
            let limits = tree.joint(joint).limits;
            let bounded = limits.lower.is_finite() && limits.upper.is_finite();
            let [lower, upper] =
                if bounded { [limits.lower, limits.upper] } else { [-UNLIMITED_REACH, UNLIMITED_REACH] };
            let mut sines = FadedSines { center: 0.0, shift: 0.0, terms: vec![[0.0; 3]; SINES] };
            for (number, term) in sines.terms.iter_mut().enumerate() {
                let frequency =
                    highest_hz * (number as f64 + 1.0 + rng.random_range(-0.4..0.4)) / SINES as f64;
                // Slow sines reach far, fast ones give acceleration.
                let amplitude = rng.random_range(0.4..1.0) / (number as f64 + 1.0).powf(0.8);
                *term = [amplitude, TAU * frequency, rng.random_range(0.0..TAU)];
            }
            let (mut lowest, mut highest, mut fastest) = (0.0_f64, 0.0_f64, 0.0_f64);
            for sample in 0..=(100.0 * duration_s) as usize {
                let [q, v, _] = sines.at(sample as f64 / 100.0, duration_s);
                (lowest, highest, fastest) = (lowest.min(q), highest.max(q), fastest.max(v.abs()));
            }
            let limit = if limits.velocity.is_finite() { limits.velocity } else { 3.0 };
            let scale = (reach * (upper - lower) / (highest - lowest)).min(speed * limit / fastest);
            sines.terms.iter_mut().for_each(|term| term[0] *= scale);
            let margin = 0.5 * (1.0 - reach) * (upper - lower);
            let (first, last) = (lower + margin - scale * lowest, upper - margin - scale * highest);
            sines.center = first + (last - first) * rng.random::<f64>();
            sines
        });
        MultiSine { duration_s, joints: joints.collect() }
    }

    /// How long it takes \[s\].
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }
}

impl Reference for MultiSine {
    fn at(&self, t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]) {
        for (joint, sines) in self.joints.iter().enumerate() {
            [q[joint], v[joint], a[joint]] = sines.at(t_s, self.duration_s);
        }
    }
}

impl FadedSines {
    /// Position, velocity and acceleration `t_s` after the start of a motion of `duration_s`.
    pub fn at(&self, t_s: f64, duration_s: f64) -> [f64; 3] {
        let mut sum = [self.shift, 0.0, 0.0];
        for [amplitude, frequency, phase] in &self.terms {
            let (sine, cosine) = (frequency * t_s + phase).sin_cos();
            sum[0] += amplitude * sine;
            sum[1] += amplitude * frequency * cosine;
            sum[2] -= amplitude * frequency * frequency * sine;
        }
        let [w, dw, ddw] = window(t_s.clamp(0.0, duration_s), duration_s);
        let [s, ds, dds] = sum;
        [self.center + w * s, dw * s + w * ds, ddw * s + 2.0 * dw * ds + w * dds]
    }
}

/// Rises from 0 to 1 in [`FADE_S`], or half the duration if that is less, and falls at the end.
fn window(t_s: f64, duration_s: f64) -> [f64; 3] {
    let fade = FADE_S.min(0.5 * duration_s);
    if t_s < fade {
        smooth_step(t_s / fade, fade)
    } else if t_s > duration_s - fade {
        let [w, dw, ddw] = smooth_step((duration_s - t_s) / fade, fade);
        [w, -dw, ddw]
    } else {
        [1.0, 0.0, 0.0]
    }
}

/// The polynomial of degree 7 with three vanishing derivatives at both ends.
fn smooth_step(x: f64, length: f64) -> [f64; 3] {
    let value = x.powi(4) * (35.0 + x * (-84.0 + x * (70.0 - 20.0 * x)));
    let slope = 140.0 * (x * (1.0 - x)).powi(3);
    let curvature = 420.0 * (x * (1.0 - x)).powi(2) * (1.0 - 2.0 * x);
    [value, slope / length, curvature / (length * length)]
}
