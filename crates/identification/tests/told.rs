//! What logs tell, on robots where it is known.

use crate::synthetic;

use phiw_dynamics::Tree;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_identification::consistent::{Consistent, ConsistentSettings, consistent};
use phiw_identification::fitting::{accumulate, fit};
use phiw_identification::told::{InformationSettings, Told, told};
use phiw_identification::{Design, Fold};
use phiw_regressor::BaseParameters;
use phiw_telemetry::Recording;
use synthetic::recording;

/// The rigid body alone, fitted to a recording in ten folds, and what that tells.
fn told_of(tree: &Tree, recording: &Recording, seconds: f64) -> (Told, Consistent) {
    let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
    let rest_speeds = vec![1e-6; tree.joint_count()];
    let design = Design::new(tree.clone(), base, Vec::new()).with_rest_speeds(rest_speeds);
    let folds: Vec<Fold> = synthetic::folds(seconds, 10);
    let blocks = synthetic::blocks(recording, 1000);
    let factors = accumulate(&design, &folds, &[&blocks]).unwrap();
    let fit = fit(&design, &factors).unwrap();
    let settings = ConsistentSettings::default();
    let consistent = consistent(&design, &fit, &factors, &factors, &settings).unwrap();
    (told(&design, &fit, &factors, &consistent, InformationSettings::default()).unwrap(), consistent)
}

/// Two links of 0.5 m that turn about z in a vertical plane (gravity along −y of the links' frames).
const PLANAR: &str = r#"<robot name="planar">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0.01 0"/><mass value="3"/>
    <inertia ixx="0.02" iyy="0.06" izz="0.07" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.25 0.02 0"/><mass value="2"/>
    <inertia ixx="0.01" iyy="0.04" izz="0.045" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><origin xyz="0 0 1" rpy="1.5707963267948966 0 0"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0.5 0 0"/><axis xyz="0 0 1"/></joint>
</robot>"#;

fn planar() -> Tree {
    read_urdf(PLANAR, &UrdfOptions::default()).unwrap().tree
}

/// In closed form the torques of a planar arm depend on I₂, m₂c₂, I₁ + l²m₂ and m₁c₁ₓ + l·m₂ and m₁c₁ᵧ
/// (Khalil & Dombre, "Modeling, Identification and Control of Robots", 2002, section 9.4).
#[test]
fn a_planar_arm_tells_what_its_closed_form_says() {
    let tree = planar();
    let (found, consistent) = told_of(&tree, &recording(&tree, 1, 60.0, 0.0, 0.02, 2), 60.0);
    let alone: Vec<usize> = found.alone().iter().map(|told| told.0).collect();
    // m₁c₁ᵧ of the upper link (2); m₂c₂ₓ, m₂c₂ᵧ and I₂zz of the lower one (11, 12, 19).
    assert_eq!(alone, [2, 11, 12, 19]);
    for (parameter, value, std) in found.alone() {
        let truth = tree.inertial_parameters()[parameter];
        assert!((value - truth).abs() < 4.0 * std, "{parameter}: {value} ± {std}, in truth {truth}");
        assert_eq!(value, consistent.standard[parameter]);
    }
    let sums = found.sums();
    assert_eq!(sums.len(), 2, "{sums:?}");
    let length: f64 = 0.5;
    for (sum, (leading, factor)) in sums.iter().zip([(1, length), (9, length * length)]) {
        assert_eq!(sum.terms[0], (leading, 1.0));
        assert_eq!(sum.terms.len(), 2, "{sums:?}");
        assert_eq!(sum.terms[1].0, 10, "with the mass of the lower link: {sums:?}");
        assert!((sum.terms[1].1 - factor).abs() < 0.02, "{sums:?}");
        let truth: f64 =
            sum.terms.iter().map(|(parameter, factor)| factor * tree.inertial_parameters()[*parameter]).sum();
        assert!((sum.value - truth).abs() < 4.0 * sum.std + 0.01 * truth, "{sum:?} {truth}");
    }
    let rest = found.not_at_all(&sums);
    assert_eq!(rest, [0, 3, 4, 5, 6, 7, 8, 13, 14, 15, 16, 17, 18]);
    assert_eq!(found.directions(), 6);
}

/// Where the last joint stands still, its torque is static friction's and does not count, and its link is a
/// part of the one before it: three sums of both are told, and nothing by itself.
#[test]
fn a_link_whose_joint_never_moves_is_told_only_with_the_one_before_it() {
    let tree = planar();
    let mut log = recording(&tree, 1, 60.0, 0.0, 0.0, 2);
    let still: f64 = 0.3;
    let mut workspace = phiw_dynamics::Workspace::new(&tree);
    let mut random = RandomNumbers::new(5);
    for row in 0..log.t.len() {
        let own = 2 * row..2 * row + 2;
        log.q[own.clone()][1] = still;
        log.qd.as_mut().unwrap()[own.clone()][1] = 0.0;
        log.qdd.as_mut().unwrap()[own.clone()][1] = 0.0;
        let (v, a) = (log.qd.as_ref().unwrap(), log.qdd.as_ref().unwrap());
        let [q, v, a] = [&log.q, v, a].map(|signal| signal[own.clone()].to_vec());
        tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut log.tau[own.clone()]).unwrap();
        log.tau[own].iter_mut().for_each(|torque| *torque += random.uniform(-0.05, 0.05));
    }
    let (found, _) = told_of(&tree, &log, 60.0);
    assert_eq!(found.directions(), 3);
    assert!(found.alone().is_empty(), "{:?}", found.alone());
    let sums = found.sums();
    let leading: Vec<usize> = sums.iter().map(|sum| sum.terms[0].0).collect();
    assert_eq!(leading, [1, 2, 9], "first moments and moment of inertia of the upper link: {sums:?}");
    // Of two bodies that are one: m₁c₁ₓ + l·m₂ + cos(q)·m₂c₂ₓ − sin(q)·m₂c₂ᵧ, and so on.
    let (l, sine, cosine) = (0.5, still.sin(), still.cos());
    let whole = [
        vec![(1, 1.0), (10, l), (11, cosine), (12, -sine)],
        vec![(2, 1.0), (11, sine), (12, cosine)],
        vec![(9, 1.0), (19, 1.0), (10, l * l), (11, 2.0 * l * cosine), (12, -2.0 * l * sine)],
    ];
    for (sum, whole) in sums.iter().zip(&whole) {
        for (parameter, factor) in &sum.terms {
            let expected = whole.iter().find(|term| term.0 == *parameter);
            let expected = expected.unwrap_or_else(|| panic!("{parameter} in {sum:?}")).1;
            assert!((factor - expected).abs() < 0.03, "{sum:?}");
        }
        let of_truth = |terms: &[(usize, f64)]| -> f64 {
            terms.iter().map(|(parameter, factor)| factor * tree.inertial_parameters()[*parameter]).sum()
        };
        let truth = of_truth(&sum.terms);
        assert!((sum.value - truth).abs() < 4.0 * sum.std, "{sum:?} {truth}");
    }
}

/// A log that says everything tells as many directions as there are base parameters, and every base
/// parameter is in what is written.
#[test]
fn a_log_with_everything_tells_all_base_parameters() {
    let tree = synthetic::robot(3, 4);
    let (found, _) = told_of(&tree, &recording(&tree, 2, 120.0, 0.0, 1e-5, 3), 120.0);
    let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
    assert_eq!(found.directions(), base.count());
    let sums = found.sums();
    assert_eq!(found.alone().len() + sums.len(), base.count(), "{sums:?}");
    let unfelt = base.unidentifiable();
    let rest = found.not_at_all(&sums);
    assert!(unfelt.iter().all(|parameter| rest.contains(parameter)), "{rest:?} {unfelt:?}");
}

/// Motion that turns the elbow tells what standing still does not; the same motion once more tells next to
/// nothing.
#[test]
fn another_motion_is_worth_what_it_adds() {
    let tree = planar();
    let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
    let design = Design::new(tree.clone(), base, Vec::new());
    let everything = [Fold { log: 0, start: f64::NEG_INFINITY, end: f64::INFINITY }];
    let rows = |found: &Told, recording: &Recording| {
        let blocks = synthetic::blocks(recording, 1000);
        let factor = accumulate(&design, &everything, &[&blocks]).unwrap().swap_remove(0);
        found.rows(&design, &factor, &[0, 1, 2, 3, 4, 5], 1.0).unwrap()
    };
    let slow = {
        let mut slow = recording(&tree, 1, 60.0, 0.0, 0.5, 2);
        // The same way in ten times the time: weights are felt, inertias are not.
        slow.t.iter_mut().for_each(|t| *t *= 10.0);
        slow.qd.iter_mut().flatten().for_each(|v| *v *= 0.1);
        slow.qdd.iter_mut().flatten().for_each(|a| *a *= 0.01);
        let mut random = RandomNumbers::new(5);
        for row in 0..slow.t.len() {
            let own = 2 * row..2 * row + 2;
            let (v, a) = (slow.qd.as_ref().unwrap(), slow.qdd.as_ref().unwrap());
            let state = [&slow.q[own.clone()], &v[own.clone()], &a[own.clone()]].map(<[f64]>::to_vec);
            let torque = &mut slow.tau[own];
            tree.inverse_dynamics(
                &state[0],
                &state[1],
                &state[2],
                &mut phiw_dynamics::Workspace::new(&tree),
                torque,
            )
            .unwrap();
            torque.iter_mut().for_each(|torque| *torque += random.uniform(-0.8, 0.8));
        }
        slow
    };
    let (found, _) = told_of(&tree, &slow, 600.0);
    let fast = rows(&found, &recording(&tree, 4, 60.0, 0.0, 0.0, 1));
    let again = rows(&found, &slow);
    let (of_fast, of_again) = (found.nats_of_untold(&fast).unwrap(), found.nats_of_untold(&again).unwrap());
    assert!(of_fast > of_again && of_fast > 1.0, "{of_fast} {of_again}");
    let with_fast = found.with_rows(&fast).unwrap();
    assert!(with_fast.directions() > found.directions());
    assert!(with_fast.alone().iter().any(|told| told.0 == 19), "{:?}", with_fast.alone());
}
