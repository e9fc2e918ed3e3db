//! A small robot whose truth is known, and logs of it.

// Each test file uses a part of this.
#![allow(dead_code)]

use phiw::arguments::{ExplainArguments, SessionArguments};
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, Workspace};
use phiw_telemetry::Recording;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Three revolute joints; `tool` is fixed.
pub const URDF: &str = r#"<robot name="three_joints">
  <link name="base"/>
  <link name="link_1"><inertial><origin xyz="0.02 0.01 0.1"/><mass value="5"/>
    <inertia ixx="0.05" iyy="0.06" izz="0.04" ixy="0.003" ixz="0" iyz="-0.002"/></inertial></link>
  <link name="link_2"><inertial><origin xyz="0.2 0.03 -0.01"/><mass value="3"/>
    <inertia ixx="0.02" iyy="0.07" izz="0.08" ixy="0" ixz="0.004" iyz="0"/></inertial></link>
  <link name="link_3"><inertial><origin xyz="0.15 -0.02 0.02"/><mass value="1.5"/>
    <inertia ixx="0.005" iyy="0.02" izz="0.021" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <link name="tool"/>
  <joint name="joint_1" type="revolute"><parent link="base"/><child link="link_1"/><origin xyz="0 0 0.3"/>
    <axis xyz="0 0 1"/><limit lower="-2.5" upper="2.5" effort="100" velocity="4"/></joint>
  <joint name="joint_2" type="revolute"><parent link="link_1"/><child link="link_2"/><origin xyz="0.05 0 0.2" rpy="0.2 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="80" velocity="4"/></joint>
  <joint name="joint_3" type="revolute"><parent link="link_2"/><child link="link_3"/><origin xyz="0.4 0 0" rpy="0 0 0.5"/>
    <axis xyz="0 1 0"/><limit lower="-2.5" upper="2.5" effort="30" velocity="4"/></joint>
  <joint name="flange" type="fixed"><parent link="link_3"/><child link="tool"/><origin xyz="0.3 0 0"/></joint>
</robot>
"#;

/// Viscous friction of the joints \[N·m·s/rad\].
pub const VISCOUS: [f64; 3] = [4.0, 2.5, 0.8];
/// Standard deviation of the torques' white noise \[N·m\].
pub const NOISE: [f64; 3] = [0.5, 0.6, 0.2];
/// Rows a second.
pub const RATE: f64 = 200.0;

/// The robot as it truly is.
pub fn tree() -> Tree {
    read_urdf(URDF, &UrdfOptions::default()).unwrap().tree
}

/// A log of the robot following sums of sines, from `seed`, with viscous friction and torque noise.
pub fn recording(seed: u64, seconds: f64) -> Recording {
    recording_of(URDF, seed, seconds)
}

/// The same of a robot of the same joints.
pub fn recording_of(urdf: &str, seed: u64, seconds: f64) -> Recording {
    recording_of_tree(&read_urdf(urdf, &UrdfOptions::default()).unwrap().tree, seed, seconds)
}

/// The same of a robot that no URDF describes.
pub fn recording_of_tree(tree: &Tree, seed: u64, seconds: f64) -> Recording {
    let mut random = RandomNumbers::new(seed);
    let joints = tree.joint_count();
    let sines: Vec<[[f64; 3]; 5]> = (0..joints)
        .map(|_| {
            std::array::from_fn(|harmonic| {
                let frequency = 0.1 * (harmonic + 1) as f64 + random.uniform(0.0, 0.08);
                [random.uniform(0.15, 0.5), TAU * frequency, random.uniform(0.0, TAU)]
            })
        })
        .collect();
    let mut recording =
        Recording { joints: tree.joint_names().map(str::to_owned).collect(), ..Recording::default() };
    let mut workspace = Workspace::new(tree);
    let mut torque = vec![0.0; joints];
    for row in 0..(seconds * RATE) as usize {
        let t = row as f64 / RATE;
        let sum = |term: &dyn Fn([f64; 3]) -> f64| -> Vec<f64> {
            sines.iter().map(|sines| sines.iter().map(|sine| term(*sine)).sum()).collect()
        };
        let q = sum(&|[a, w, p]| a * (w * t + p).sin());
        let v = sum(&|[a, w, p]| a * w * (w * t + p).cos());
        let a = sum(&|[a, w, p]| -a * w * w * (w * t + p).sin());
        tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque).unwrap();
        let measured =
            |joint: usize| torque[joint] + VISCOUS[joint] * v[joint] + NOISE[joint] * gauss(&mut random);
        recording.tau.extend((0..joints).map(measured).collect::<Vec<_>>());
        recording.t.push(t);
        recording.q.extend(q);
    }
    recording
}

/// A log as text.
pub fn csv(recording: &Recording) -> String {
    let mut text = Vec::new();
    recording.write_to(&mut text).unwrap();
    String::from_utf8(text).unwrap()
}

/// What asks `phiw explain` for logs of a folder with `robot.urdf`; results would go to `out` there.
pub fn explain_arguments(
    folder: &Path,
    [train, validate]: [Vec<PathBuf>; 2],
    declare: &[&str],
) -> ExplainArguments {
    ExplainArguments {
        session: SessionArguments {
            urdf: folder.join("robot.urdf"),
            train,
            validate,
            declare: declare.iter().map(|kind| (*kind).to_owned()).collect(),
            out: folder.join("out"),
            ..SessionArguments::default()
        },
        ..ExplainArguments::default()
    }
}

/// A standard normal number (Box and Muller 1958).
fn gauss(random: &mut RandomNumbers) -> f64 {
    let radius = (-2.0 * random.uniform(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
    radius * random.uniform(0.0, TAU).cos()
}
