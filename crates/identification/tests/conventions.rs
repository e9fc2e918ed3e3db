//! Logs that count joints otherwise than the URDF.

use crate::synthetic;

use phiw_identification::checks::{Convention, ConventionKind, ConventionSettings, conventions};
use phiw_telemetry::Recording;

const JOINTS: usize = 4;
const VISCOUS: f64 = 2.0;
const NOISE: f64 = 0.2;

/// What is found in the log of a robot after `change`.
fn found(seed: u64, change: impl FnOnce(&mut Recording)) -> Vec<Convention> {
    let tree = synthetic::robot(seed, JOINTS);
    let mut log = synthetic::recording(&tree, seed, 60.0, VISCOUS, NOISE, seed);
    change(&mut log);
    let blocks = synthetic::blocks(&log, 4096);
    let data = synthetic::data(&blocks, synthetic::folds(60.0, 6), Vec::new());
    conventions(&tree, &data, &ConventionSettings::default()).unwrap()
}

fn times(values: &mut [f64], joint: usize, factor: f64) {
    values.iter_mut().skip(joint).step_by(JOINTS).for_each(|value| *value *= factor);
}

fn turn_position(log: &mut Recording, joint: usize) {
    times(&mut log.q, joint, -1.0);
    [&mut log.qd, &mut log.qdd].into_iter().flatten().for_each(|values| times(values, joint, -1.0));
}

#[test]
fn a_log_as_the_urdf_has_it_is_read_as_it_is() {
    for seed in 0..8 {
        assert_eq!(found(seed, |_| ()), [], "robot {seed}");
    }
}

#[test]
fn each_difference_is_told_by_its_kind_and_joints() {
    for seed in 0..6 {
        let joint = 1 + seed as usize % 3;
        let only = |kind: ConventionKind, joints: &[usize], change: &dyn Fn(&mut Recording)| {
            let found = found(seed, change);
            assert_eq!(found.len(), 1, "{kind:?} of {joints:?}: {found:?}");
            assert_eq!((&found[0].kind, found[0].joints.as_slice()), (&kind, joints), "{found:?}");
            assert!(found[0].left < found[0].left_as_named);
        };
        only(ConventionKind::TorqueSign, &[joint], &|log| times(&mut log.tau, joint, -1.0));
        only(ConventionKind::Axis, &[joint], &|log| {
            times(&mut log.tau, joint, -1.0);
            turn_position(log, joint);
        });
        only(ConventionKind::PositionSign, &[joint], &|log| turn_position(log, joint));
        only(ConventionKind::AllTorqueSigns, &[], &|log| log.tau.iter_mut().for_each(|tau| *tau *= -1.0));
        // A slider's column is not taken for a hinge's.
        let tree = synthetic::robot(seed, JOINTS);
        if tree.joint(joint - 1).joint_type != tree.joint(joint).joint_type {
            continue;
        }
        only(ConventionKind::SwappedTorques, &[joint - 1, joint], &|log| {
            log.tau.chunks_mut(JOINTS).for_each(|row| row.swap(joint - 1, joint));
        });
        only(ConventionKind::Swapped, &[joint - 1, joint], &|log| {
            let signals = [&mut log.qd, &mut log.qdd].into_iter().flatten().chain([&mut log.q, &mut log.tau]);
            signals.for_each(|values| values.chunks_mut(JOINTS).for_each(|row| row.swap(joint - 1, joint)));
        });
    }
}

#[test]
fn torques_of_another_unit_are_told_with_their_factor() {
    for seed in 0..6 {
        let found = found(seed, |log| times(&mut log.tau, 1, 50.0));
        let [Convention { kind: ConventionKind::TorqueScale(scale), joints, .. }] = found.as_slice() else {
            panic!("robot {seed}: {found:?}")
        };
        assert!((scale - 50.0).abs() < 5.0 && *joints == [1], "robot {seed}: {found:?}");
    }
}

#[test]
fn torques_without_the_robots_weight_are_told() {
    let mut told = 0;
    for seed in 0..8 {
        let tree = synthetic::robot(seed, JOINTS);
        let mut left_out = 0.0_f64;
        let found = found(seed, |log| {
            let (rest, mut weight) = ([0.0; JOINTS], [0.0; JOINTS]);
            let (mut weights, mut torques) = ([0.0; JOINTS], [0.0; JOINTS]);
            let mut workspace = phiw_dynamics::Workspace::new(&tree);
            for row in 0..log.len() {
                let own = row * JOINTS..(row + 1) * JOINTS;
                tree.inverse_dynamics(&log.q[own.clone()], &rest, &rest, &mut workspace, &mut weight)
                    .unwrap();
                for (joint, torque) in log.tau[own].iter_mut().enumerate() {
                    *torque -= weight[joint];
                    weights[joint] += weight[joint].powi(2);
                    torques[joint] += torque.powi(2);
                }
            }
            left_out = (0..JOINTS).map(|joint| weights[joint] / torques[joint]).fold(0.0, f64::max);
        });
        let kinds: Vec<_> = found.iter().map(|found| found.kind.clone()).collect();
        // A weight that hardly shows is not missed, and other bodies may do for one.
        let is_heavy = left_out > 1.0 && kinds == [ConventionKind::NoGravity];
        assert!(is_heavy || kinds.is_empty(), "robot {seed}: {kinds:?}");
        told += usize::from(is_heavy);
    }
    assert!(told >= 4, "told on {told} robots");
}

#[test]
fn two_joints_that_turn_the_other_way_are_both_told() {
    let found = found(1, |log| {
        for joint in [1, 3] {
            times(&mut log.tau, joint, -1.0);
            turn_position(log, joint);
        }
    });
    let mut axes: Vec<_> = found.iter().map(|found| (found.kind.clone(), found.joints[0])).collect();
    axes.sort_by_key(|(_, joint)| *joint);
    assert_eq!(axes, [(ConventionKind::Axis, 1), (ConventionKind::Axis, 3)], "{found:?}");
}

#[test]
fn a_robot_that_hangs_is_told_with_the_direction_of_gravity() {
    let angle =
        |a: [f64; 3], b: [f64; 3]| (0..3).map(|at| a[at] * b[at]).sum::<f64>().clamp(-1.0, 1.0).acos();
    let slanting = 0.5_f64.sqrt();
    let mut told = 0;
    for downward in [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, -slanting, -slanting]] {
        for seed in 0..6 {
            let mut hung = synthetic::robot(seed, JOINTS);
            let standing = hung.gravity;
            hung.gravity = downward.map(|along| 9.81 * along);
            let log = synthetic::recording(&hung, seed, 60.0, VISCOUS, NOISE, seed);
            let blocks = synthetic::blocks(&log, 4096);
            let data = synthetic::data(&blocks, synthetic::folds(60.0, 6), Vec::new());
            hung.gravity = standing;
            let found = conventions(&hung, &data, &ConventionSettings::default()).unwrap();
            // Where gravity turns about the first joint's axis, or joints hardly feel it, it is not seen.
            let Some(first) = found.first() else { continue };
            let seen = match first.kind {
                ConventionKind::Mounting(seen) => seen,
                // From below: the same as a first joint that lies and turns the other way.
                ConventionKind::Axis if first.joints == [0] && downward[2] > 0.0 => continue,
                _ => panic!("robot {seed}, {downward:?}: {found:?}"),
            };
            assert_eq!(found.len(), 1, "robot {seed}, {downward:?}: {found:?}");
            assert!(angle(seen, downward) < 0.1, "robot {seed}, {downward:?}: {seen:?}");
            told += 1;
        }
    }
    assert!(told >= 12, "told in {told} of 18 cases");
}

#[test]
fn torques_in_a_unit_of_each_are_told_with_their_factors() {
    let factors = [0.04, 3.0, 0.3, 0.9];
    let mut told = 0;
    for seed in 0..6 {
        let found =
            found(seed, |log| (0..JOINTS).for_each(|joint| times(&mut log.tau, joint, factors[joint])));
        let Some(Convention { kind: ConventionKind::EachTorqueScale(scales), joints, .. }) = found.first()
        else {
            continue;
        };
        assert_eq!(found.len(), 1, "robot {seed}: {found:?}");
        for (scale, &joint) in scales.iter().zip(joints) {
            let over = scale / factors[joint];
            assert!((0.6..1.6).contains(&over), "robot {seed}, joint {joint}: {scale}, {found:?}");
        }
        told += usize::from(joints.len() >= 3);
    }
    assert!(told >= 4, "told on {told} robots");
}

#[test]
fn all_torques_in_another_unit_are_told_with_their_factor() {
    for seed in 0..6 {
        let found = found(seed, |log| log.tau.iter_mut().for_each(|tau| *tau *= 1000.0));
        let [Convention { kind: ConventionKind::AllTorqueScales(scale), .. }] = found.as_slice() else {
            panic!("robot {seed}: {found:?}")
        };
        assert!((900.0..1100.0).contains(scale), "robot {seed}: {scale}");
    }
}
