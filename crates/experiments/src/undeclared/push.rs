//! Somebody who pushes the robot while a log is taken.

use super::case::{DURATION, STARTS};
use super::load::WorldForce;
use super::plant::Record;
use super::rng::CaseRng;
use phiw_dynamics::Tree;
use serde::Serialize;
use std::f64::consts::PI;

/// How long a push takes \[s\].
const DURATIONS_S: [f64; 2] = [0.15, 0.8];
/// Its peak: the torques that it asks of all joints together, over their RMS in the log.
const PEAKS: [f64; 2] = [0.3, 2.0];
/// Pushes in a session, at most.
const MOST: usize = 3;
/// Where on the last link it acts \[m\], from the joint's axis.
const POINT_M: f64 = 0.1;

/// A force on the last link that comes and goes as half a sine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Push {
    /// When it begins \[s, of the session\].
    pub start_s: f64,
    /// How long it takes \[s\].
    pub duration_s: f64,
    /// Where it points, in the world.
    pub direction: [f64; 3],
    /// Torques of all joints at its peak, over their RMS in the log.
    pub peak: f64,
}

impl Push {
    /// One to three pushes in training logs.
    pub fn draw(rng: &mut CaseRng) -> Vec<Self> {
        let one = |rng: &mut CaseRng| {
            let direction = [0; 3].map(|_| rng.normal());
            let length = direction.iter().map(|value| value * value).sum::<f64>().sqrt();
            Push {
                start_s: rng.pick(&STARTS[..2]) + rng.uniform(0.05, 0.9) * DURATION,
                duration_s: rng.log_uniform(DURATIONS_S[0], DURATIONS_S[1]),
                direction: direction.map(|value| value / length),
                peak: rng.log_uniform(PEAKS[0], PEAKS[1]),
            }
        };
        (0..1 + rng.index(MOST)).map(|_| one(rng)).collect()
    }

    /// Adds what the joints deliver against it to `torque`, samples × joints.
    pub fn add_torque(&self, tree: &Tree, record: &Record, torque: &mut [f64]) {
        let joints = tree.joint_count();
        let shape = |sample: usize| {
            let phase = (record.times[sample] - self.start_s) / self.duration_s;
            if (0.0..1.0).contains(&phase) { (PI * phase).sin() } else { 0.0 }
        };
        let last = tree.bodies().len() - 1;
        let force = WorldForce { body: last, point: [POINT_M; 3], direction: self.direction };
        let mut added = vec![0.0; torque.len()];
        force.add_torque_along(tree, &record.states, shape, &mut added);
        let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let largest = added.chunks_exact(joints).map(squares).fold(0.0, f64::max);
        if largest == 0.0 {
            return;
        }
        let usual = squares(&record.torque) / record.times.len() as f64;
        let scale = self.peak * (usual / largest).sqrt();
        torque.iter_mut().zip(added).for_each(|(torque, added)| *torque += scale * added);
    }
}
