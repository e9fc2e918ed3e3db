//! A joint that sticks where it reverses.

use super::robot::{RATE, SECONDS, URDF, folds, named, traced_recording};
use phiw_dynamics::Workspace;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_telemetry::Recording;
use std::f64::consts::TAU;

/// Step of both encoders \[rad\]: 13 bits.
const STEP: f64 = TAU / 8192.0;

/// Two joints with viscous and Coulomb friction. Around each reversal the elbow creeps by less than its
/// encoder shows, while its friction goes from one end to the other.
fn sticking(seed: u64) -> Recording {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let mut random = RandomNumbers::new(seed);
    let sines: Vec<[f64; 3]> = (0..8)
        .map(|k| {
            let frequency = 0.11 + 0.17 * f64::from(k % 4) + random.uniform(0.0, 0.05);
            [random.uniform(0.2, 0.4), TAU * frequency, random.uniform(0.0, TAU)]
        })
        .collect();
    let mut workspace = Workspace::new(&tree);
    let mut recording = Recording { joints: vec!["shoulder".into(), "elbow".into()], ..Recording::default() };
    let mut elbow = [0.0, 0.0];
    for row in 0..(RATE * SECONDS) as usize {
        let t = row as f64 / RATE;
        let (mut q, mut qd, mut qdd) = ([0.0; 2], [0.0; 2], [0.0; 2]);
        for (index, [amplitude, omega, phase]) in sines.iter().enumerate() {
            let (sine, cosine) = (omega * t + phase).sin_cos();
            q[index / 4] += amplitude * sine;
            qd[index / 4] += amplitude * omega * cosine;
            qdd[index / 4] -= amplitude * omega * omega * sine;
        }
        // Slow where it was slower than 0.8 rad/s.
        let (square, soft) = (qd[1] * qd[1], 0.64);
        let kept = (square / (square + soft)).powi(2);
        qdd[1] *= kept * (square + 5.0 * soft) / (square + soft);
        qd[1] *= kept;
        elbow = [elbow[0] + 0.5 / RATE * (elbow[1] + qd[1]), qd[1]];
        q[1] = elbow[0];
        let mut torque = [0.0; 2];
        tree.inverse_dynamics(&q, &qd, &qdd, &mut workspace, &mut torque).unwrap();
        for joint in 0..2 {
            torque[joint] += 0.4 * qd[joint] + [0.6, 2.0][joint] * (qd[joint] / 0.004).tanh();
        }
        for torque in &mut torque {
            *torque += 0.03 * ((0..12).map(|_| random.uniform(0.0, 1.0)).sum::<f64>() - 6.0);
        }
        recording.t.push(t);
        recording.q.extend(q.map(|q| (q / STEP).round() * STEP));
        recording.tau.extend(torque);
    }
    recording
}

/// Rows counted where the joint moved for half of the filter's window. What it carried while it stuck came
/// before its motion, and was taken for a Stribeck friction here, for a delay of a joint elsewhere.
#[test]
fn a_joint_that_sticks_has_friction_and_nothing_else() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let tracing = traced_recording(&tree, &sticking(6), None, folds().0, &[]);
    let names = named(&tracing);
    let kinds: Vec<&str> = names.iter().map(|(kind, _)| kind.as_str()).collect();
    assert!(kinds.iter().all(|kind| ["viscous_friction", "coulomb_friction"].contains(kind)), "{names:?}");
    assert_eq!(names.len(), 4, "{names:?}");
}
