//! Joints of a leg that go forth and back together, so that much of what one torque has could be of another's
//! motion.

use super::robot::{RATE, SECONDS, folds, named, traced_recording};
use phiw_dynamics::Workspace;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_telemetry::Recording;
use std::f64::consts::TAU;

const URDF: &str = r#"<robot name="leg"><link name="base"/>
  <link name="upper">
    <inertial><origin xyz="0 0.02 0"/>
    <mass value="0.7"/>
    <inertia ixx="0.0008" iyy="0.0008" izz="0.0003" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="middle">
    <inertial><origin xyz="0 0 -0.03"/>
    <mass value="1.2"/>
    <inertia ixx="0.006" iyy="0.006" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower">
    <inertial><origin xyz="0 0 -0.09"/>
    <mass value="0.25"/>
    <inertia ixx="0.002" iyy="0.002" izz="0.0007" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="hip" type="revolute">
    <parent link="base"/><child link="upper"/>
    <axis xyz="1 0 0"/><limit lower="-1" upper="1" effort="20" velocity="20"/></joint>
  <joint name="thigh" type="revolute">
    <parent link="upper"/><child link="middle"/><origin xyz="0 0.1 0"/>
    <axis xyz="0 1 0"/><limit lower="-1" upper="3" effort="20" velocity="20"/></joint>
  <joint name="calf" type="revolute">
    <parent link="middle"/><child link="lower"/><origin xyz="0 0 -0.21"/>
    <axis xyz="0 1 0"/><limit lower="-3" upper="0" effort="20" velocity="20"/></joint>
</robot>"#;

/// Middle of each joint's motion, and how far it goes to either side \[rad\].
const STROKES: [(f64, f64); 3] = [(0.0, 0.26), (0.85, 0.32), (-1.85, 0.55)];
/// Share of a triangle that a rounded one is: its speed changes sign within a twentieth of the period.
const ROUNDED: f64 = 0.97;
/// Viscous and Coulomb friction \[N·m·s/rad, N·m\] of each joint.
const FRICTION: [(f64, f64); 3] = [(0.06, 0.5), (0.07, 0.3), (0.1, 0.3)];

/// What the hip cogs with \[N·m\].
const COGGING: f64 = 0.08;

/// All joints follow the same rounded triangle, each with a little of its own. The dry friction of the calf
/// is `(1 + slope·x)` times as large at a share x of its stroke, from −1 to 1, and the hip cogs.
fn leg(seed: u64, slope: f64) -> Recording {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    let mut random = RandomNumbers::new(seed);
    let own: Vec<[f64; 3]> = (0..9)
        .map(|_| {
            let frequency = TAU * random.uniform(0.5, 3.0);
            [random.uniform(0.0, 0.01), frequency, random.uniform(0.0, TAU)]
        })
        .collect();
    let lags: Vec<f64> = (0..3).map(|_| random.uniform(0.0, 0.06)).collect();
    let joints = ["hip", "thigh", "calf"].map(str::to_owned).to_vec();
    let mut recording = Recording { joints, ..Recording::default() };
    let mut workspace = Workspace::new(&tree);
    for row in 0..(RATE * SECONDS) as usize {
        let t = row as f64 / RATE;
        // Ever faster, from a period of three seconds to one of two.
        let rate = TAU / 3.0;
        let (angle, speed, gain) = (
            rate * (t + 0.5 * t * t / (2.0 * SECONDS)),
            rate * (1.0 + t / (2.0 * SECONDS)),
            0.5 * rate / SECONDS,
        );
        let (mut q, mut qd, mut qdd) = ([0.0; 3], [0.0; 3], [0.0; 3]);
        for joint in 0..3 {
            let (sine, cosine) = (angle - lags[joint]).sin_cos();
            let left = 1.0 - (ROUNDED * sine).powi(2);
            let way = STROKES[joint].1 * 4.0 / TAU;
            let rise = ROUNDED * cosine / left.sqrt();
            let curvature = -ROUNDED * sine * (1.0 - ROUNDED * ROUNDED) / left.powf(1.5);
            q[joint] = STROKES[joint].0 + way * (ROUNDED * sine).asin();
            qd[joint] = way * rise * speed;
            qdd[joint] = way * (curvature * speed * speed + rise * gain);
        }
        for (index, [amplitude, frequency, phase]) in own.iter().enumerate() {
            let (sine, cosine) = (frequency * t + phase).sin_cos();
            q[index / 3] += amplitude * sine;
            qd[index / 3] += amplitude * frequency * cosine;
            qdd[index / 3] -= amplitude * frequency * frequency * sine;
        }
        let mut torque = [0.0; 3];
        tree.inverse_dynamics(&q, &qd, &qdd, &mut workspace, &mut torque).unwrap();
        let along = (q[2] - STROKES[2].0) / STROKES[2].1;
        for joint in 0..3 {
            let (viscous, coulomb) = FRICTION[joint];
            let size = if joint == 2 { 1.0 + slope * along } else { 1.0 };
            torque[joint] += viscous * qd[joint] + size * coulomb * (qd[joint] / 0.02).tanh();
        }
        torque[0] += COGGING * (30.0 * q[0] + 1.0).sin();
        for torque in &mut torque {
            *torque += 0.01 * ((0..12).map(|_| random.uniform(0.0, 1.0)).sum::<f64>() - 6.0);
        }
        recording.t.push(t);
        recording.q.extend(q);
        recording.tau.extend(torque);
    }
    recording
}

/// Friction that varies was sought once all that is simpler had been. By then a friction of the load stood
/// for this one and for the Coulomb friction, and three times as much was left.
#[test]
fn a_friction_that_others_stand_for_is_found_from_another_start() {
    let tree = read_urdf(URDF, &UrdfOptions::default()).unwrap().tree;
    for (seed, slope) in [(1, -0.9), (4, -0.9)] {
        let tracing = traced_recording(&tree, &leg(seed, slope), None, folds().0, &[]);
        let mut expected: Vec<(String, Vec<String>)> = Vec::new();
        for joint in ["calf", "hip", "thigh"] {
            let kinds = ["coulomb_friction", "viscous_friction"];
            expected.extend(kinds.map(|kind| (kind.to_owned(), vec![joint.to_owned()])));
        }
        expected.push(("position_dependent_friction".to_owned(), vec!["calf".to_owned()]));
        expected.push(("torque_ripple".to_owned(), vec!["hip".to_owned()]));
        expected.sort();
        assert_eq!(named(&tracing), expected);
        assert!(tracing.model.held_out.relative < 0.012, "{}", tracing.model.held_out.relative);
    }
}
