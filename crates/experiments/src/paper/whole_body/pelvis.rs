//! Motion of a pelvis over feet that stay: synthetic, from a name.

use phiw_plant::FadedSines;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};
use std::f64::consts::TAU;

/// How far it goes along and about each axis: forwards, sideways, down \[m\]; yaw, pitch, roll \[rad\].
const REACH: [f64; 6] = [0.035, 0.04, 0.10, 0.25, 0.12, 0.08];
/// The liveliest does all of it, the calmest this share.
const CALMEST: f64 = 0.25;
/// Sines of each axis, and their highest frequency \[Hz\].
const SINES: usize = 4;
const HIGHEST_HZ: f64 = 1.0;
/// The axis that only goes down: above the stance the knees would be straight.
const DOWN: usize = 2;

/// Sums of sines that begin and end at rest in the stance.
#[derive(Clone, Debug, PartialEq)]
pub struct PelvisMotion {
    duration_s: f64,
    /// Against the stance, along and about each axis.
    axes: [FadedSines; 6],
}

impl PelvisMotion {
    /// The motion that goes with a name: always the same.
    pub fn of_name(name: &str, duration_s: f64) -> Self {
        let digest = Sha256::digest(name.as_bytes());
        let mut rng = ChaCha8Rng::from_seed(digest.into());
        let vigour = rng.random_range(CALMEST..1.0);
        let axes = std::array::from_fn(|axis| {
            let mut terms: Vec<[f64; 3]> = (0..SINES)
                .map(|number| {
                    let share = (number as f64 + rng.random_range(0.6..1.4)) / SINES as f64;
                    let amplitude = rng.random_range(0.4..1.0) / (number as f64 + 1.0);
                    [amplitude, TAU * HIGHEST_HZ * share, rng.random_range(0.0..TAU)]
                })
                .collect();
            // No sum is larger than that of its amplitudes.
            let largest: f64 = terms.iter().map(|term| term[0]).sum();
            let reach = if axis == DOWN { 0.5 * REACH[axis] } else { REACH[axis] };
            terms.iter_mut().for_each(|term| term[0] *= vigour * reach / largest);
            let shift = if axis == DOWN { -vigour * reach } else { 0.0 };
            FadedSines { center: 0.0, shift, terms }
        });
        PelvisMotion { duration_s, axes }
    }

    /// The same, larger or smaller.
    pub fn times(mut self, share: f64) -> Self {
        for axis in &mut self.axes {
            axis.terms.iter_mut().for_each(|term| term[0] *= share);
            axis.shift *= share;
        }
        self
    }

    /// Place, velocity and acceleration against the stance along all axes.
    pub fn at(&self, t_s: f64) -> [[f64; 6]; 3] {
        let mut moved = [[0.0; 6]; 3];
        for (axis, sines) in self.axes.iter().enumerate() {
            let state = sines.at(t_s, self.duration_s);
            moved.iter_mut().zip(state).for_each(|(moved, value)| moved[axis] = value);
        }
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn derivatives_are_derivatives_and_it_begins_and_ends_at_rest() {
        let motion = PelvisMotion::of_name("stir_01", 4.0);
        assert_eq!(motion, PelvisMotion::of_name("stir_01", 4.0));
        assert_ne!(motion, PelvisMotion::of_name("stir_02", 4.0));
        for end in [0.0, 4.0] {
            assert!(motion.at(end).iter().flatten().all(|value| value.abs() < 1e-9));
        }
        let step = 1e-5;
        for t in [0.3, 1.4, 2.0, 3.1] {
            let [before, now, after] = [-step, 0.0, step].map(|shift| motion.at(t + shift));
            for axis in 0..6 {
                for order in 0..2 {
                    let slope = (after[order][axis] - before[order][axis]) / (2.0 * step);
                    assert!((slope - now[order + 1][axis]).abs() < 1e-6, "{axis} at {t} s");
                }
                assert!(now[0][axis].abs() <= REACH[axis]);
            }
            assert!(now[0][DOWN] <= 0.0);
        }
    }
}
