//! Motions of joints that go forth and back together.

use super::rng::CaseRng;
use super::trajectory::{Reach, Trajectory, placed, room};
use phiw_dynamics::Tree;
use std::f64::consts::{PI, TAU};

/// Shortest and longest period of the common motion \[s\].
const PERIODS: [f64; 2] = [2.0, 4.0];
/// Largest share of a period that a joint is late by.
const LAG: f64 = 0.02;
/// Smallest and largest amplitude of the sines of a joint's own, over the common one.
const OWN: [f64; 2] = [0.002, 0.05];
/// Sines of a joint's own, and their frequencies \[Hz\].
const OWN_SINES: usize = 3;
const OWN_FREQUENCIES: [f64; 2] = [0.3, 2.0];
/// Harmonics of a triangle with rounded corners.
const HARMONICS: [i32; 4] = [1, 3, 5, 7];

impl Trajectory {
    /// All joints follow one triangle with rounded corners, each as far as it may, with a little of its own.
    pub fn alike(tree: &Tree, rng: &mut CaseRng, start: f64, duration: f64, reach: Option<Reach>) -> Self {
        let frequency = TAU / rng.uniform(PERIODS[0], PERIODS[1]);
        let own = rng.log_uniform(OWN[0], OWN[1]);
        let joint = |joint: usize| {
            let late = TAU * rng.uniform(0.0, LAG);
            let direction = if rng.chance(0.5) { 0.0 } else { PI };
            let common = HARMONICS.map(|harmonic| {
                let number = f64::from(harmonic);
                let sign = if harmonic % 4 == 1 { 0.0 } else { PI };
                [number.powi(-2), number * frequency, direction + sign - number * late]
            });
            let mut terms = common.to_vec();
            terms.extend((0..OWN_SINES).map(|_| {
                let frequency = TAU * rng.uniform(OWN_FREQUENCIES[0], OWN_FREQUENCIES[1]);
                [rng.uniform(0.3, 1.0) * own, frequency, rng.uniform(0.0, TAU)]
            }));
            let reach = reach.filter(|reach| reach.joint == joint);
            placed(terms, room(tree, joint), rng, duration, reach)
        };
        Trajectory { start, duration, joints: (0..tree.joint_count()).map(joint).collect(), excess: None }
    }
}
