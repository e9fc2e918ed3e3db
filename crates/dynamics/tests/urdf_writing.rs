//! An identified URDF holds the tree's parameters, and everything else as it was.

use crate::arbitrary;

use arbitrary::{assert_close, options};
use phiw_dynamics::Tree;
use phiw_dynamics::random_tree::{RandomNumbers, random_urdf};
use phiw_dynamics::urdf::{JointFriction, UrdfOptions, read_urdf, write_identified_urdf};
use proptest::prelude::*;
use std::path::PathBuf;

/// Other parameters, of real bodies: those of the tree scaled body by body.
fn identified(tree: &Tree, seed: u64) -> Tree {
    let random = &mut RandomNumbers::new(seed);
    let parameters: Vec<f64> = tree
        .bodies()
        .iter()
        .flat_map(|body| {
            let factor = random.uniform(0.5, 2.0);
            body.inertial.map(|x| x * factor)
        })
        .collect();
    let mut tree = tree.clone();
    tree.set_inertial_parameters(&parameters).unwrap();
    tree
}

/// Writes, reads again, compares.
#[track_caller]
fn round_trip(xml: &str, options: &UrdfOptions, seed: u64) {
    let tree = identified(&read_urdf(xml, options).unwrap().tree, seed);
    let frictions: Vec<JointFriction> = tree
        .joint_names()
        .enumerate()
        .map(|(i, joint)| JointFriction {
            joint: joint.to_owned(),
            damping: 0.1 + i as f64,
            friction: 0.7 * i as f64,
        })
        .collect();
    let written = write_identified_urdf(xml, &tree, &frictions).unwrap();
    let again = read_urdf(&written, options).unwrap().tree;
    for (found, expected) in again.bodies().iter().zip(tree.bodies()) {
        assert_eq!(
            (&found.joint, &found.link, found.parent),
            (&expected.joint, &expected.link, expected.parent)
        );
        assert_close(&found.inertial, &expected.inertial, 1e-9);
    }
    for (joint, friction) in frictions.iter().enumerate() {
        let body = again.joint(joint);
        assert_eq!((body.damping, body.friction), (friction.damping, friction.friction));
    }
    assert_eq!(write_identified_urdf(&written, &tree, &frictions).unwrap(), written);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn random_robots_survive(seed in any::<u64>(), options in options(), hold in any::<bool>()) {
        let held = if hold { vec![("joint_1".to_owned(), 0.4)] } else { Vec::new() };
        let reading = UrdfOptions { floating_base: options.floating_base, held, ..UrdfOptions::default() };
        round_trip(&random_urdf(seed, &options), &reading, seed);
    }
}

#[test]
fn real_robots_survive() {
    let data = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    for path in [
        "robots/torobo20/torobo20.urdf",
        "robots/talos/talos_full_v2.urdf",
        "robots/talos/talos_reduced.urdf",
        "robots/g1/g1_29dof_rev_1_0.urdf",
        "logs/tx40/tx40.urdf",
        "logs/emps/emps.urdf",
        "logs/kr300/kr300.urdf",
    ] {
        let Ok(xml) = std::fs::read_to_string(data.join(path)) else {
            println!("skipped: no {path}");
            continue;
        };
        for floating_base in [false, true] {
            round_trip(&xml, &UrdfOptions { floating_base, ..UrdfOptions::default() }, 7);
        }
    }
}

const ORIGINAL: &str = r#"<?xml version="1.0"?>
<!-- our robot -->
<robot name="one">
  <link name="base"/>
  <link name="arm">
    <visual><geometry><box size="1 2 3"/></geometry></visual> <!-- the box -->
  </link>
  <link name="tool">
    <inertial>
      <mass value="1"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
    </inertial>
    <visual><geometry><sphere radius="1"/></geometry></visual>
  </link>
  <joint name="pivot" type="continuous">
    <parent link="base"/>
    <child link="arm"/>
    <dynamics friction="3"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="1 0 0"/></joint>
  <transmission name="t"><joint name="pivot"/></transmission>
</robot>
"#;

const WRITTEN: &str = r#"<?xml version="1.0"?>
<!-- our robot -->
<robot name="one">
  <link name="base"/>
  <link name="arm">
    <visual><geometry><box size="1 2 3"/></geometry></visual> <!-- the box -->
    <inertial>
      <origin xyz="0.5 0 0" rpy="0 0 0"/>
      <mass value="2"/>
      <inertia ixx="1" ixy="0" ixz="0" iyy="1.5" iyz="0" izz="1.5"/>
    </inertial>
  </link>
  <link name="tool">
    <visual><geometry><sphere radius="1"/></geometry></visual>
  </link>
  <joint name="pivot" type="continuous">
    <parent link="base"/>
    <child link="arm"/>
    <dynamics damping="0.5" friction="0.25"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="arm"/><child link="tool"/><origin xyz="1 0 0"/></joint>
  <transmission name="t"><joint name="pivot"/></transmission>
</robot>
"#;

#[test]
fn the_rest_of_the_text_stays() {
    let mut tree = read_urdf(ORIGINAL, &UrdfOptions::default()).unwrap().tree;
    tree.set_inertial_parameters(&[2.0, 1.0, 0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 0.0, 2.0]).unwrap();
    let friction = JointFriction { joint: "pivot".to_owned(), damping: 0.5, friction: 0.25 };
    assert_eq!(write_identified_urdf(ORIGINAL, &tree, &[friction]).unwrap(), WRITTEN);
}

#[test]
fn what_cannot_be_written_is_an_error() {
    let tree = read_urdf(ORIGINAL, &UrdfOptions::default()).unwrap().tree;
    let refuses = |xml: &str, parameters: [f64; 10], joint: &str, expected: &str| {
        let mut tree = tree.clone();
        tree.set_inertial_parameters(&parameters).unwrap();
        let friction = JointFriction { joint: joint.to_owned(), damping: 0.0, friction: 0.0 };
        let message = write_identified_urdf(xml, &tree, &[friction]).unwrap_err().to_string();
        assert!(message.contains(expected), "`{message}` does not contain `{expected}`");
    };
    let mut moment = [0.0; 10];
    moment[2] = 0.3;
    refuses(ORIGINAL, moment, "pivot", "link `arm` has a first moment but no mass");
    refuses(
        ORIGINAL,
        [f64::NAN; 10],
        "pivot",
        "link `arm`: one of its inertial parameters is not a finite number",
    );
    refuses(ORIGINAL, [0.0; 10], "wrist", "the URDF to write has no joint `wrist`");
    refuses(
        &ORIGINAL.replace("\"arm\"", "\"leg\""),
        [0.0; 10],
        "pivot",
        "the URDF to write has no link `arm`",
    );
}
