//! The rows of a design against the regressor, whole.

use crate::synthetic;

use phiw_regressor::JointTorqueRegressor;
use proptest::prelude::*;

/// Bytes of the factors of 18 folds and of each thread.
fn exact_bytes(design: &phiw_identification::Design) -> u64 {
    let copies = (18 + rayon::current_num_threads()) as u64;
    copies * design.rows().iter().map(|row| 8 * (row.range.len() as u64).pow(2)).sum::<u64>()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, ..ProptestConfig::default() })]

    /// What the search for base parameters finds is never less than what the joints alone say: no
    /// robot whose factors fit is refused early.
    #[test]
    fn no_robot_is_refused_early_whose_factors_fit(seed in 0u64..100_000, joints in 1usize..9) {
        let tree = synthetic::robot(seed, joints);
        let fewest: usize = phiw_regressor::fewest_base_parameters(&tree).iter().sum();
        let design = synthetic::design(&tree);
        prop_assert!(fewest <= design.base().count(), "{fewest} of {}", design.base().count());
        let mut limits = phiw_limits::Limits::default();
        limits.factor_bytes = exact_bytes(&design);
        let effects = design.effects().iter().map(|effect| effect.as_ref());
        prop_assert!(phiw_identification::checks::check_size_of_robot(&tree, effects, 18, &limits).is_ok());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Every row is that of φ at the base parameters' columns, then the effects' columns, then the torque;
    /// what it leaves out is zero.
    #[test]
    fn rows_are_those_of_the_regressor(seed in 0u64..1000, joints in 1usize..9, rest_speed in 0.0..1.0f64) {
        let tree = synthetic::robot(seed, joints);
        let design = synthetic::design(&tree).with_rest_speeds(vec![rest_speed; joints]);
        let recording = synthetic::recording(&tree, seed, 2.0, 1.0, 0.1, seed);
        let regressor = JointTorqueRegressor::new(&tree);
        let (mut pairs, mut scratch) = (vec![0.0; regressor.buffer_size()], regressor.scratch());
        let mut phi = vec![0.0; regressor.rows() * regressor.columns()];
        let mut row = vec![0.0; design.evaluation_width()];
        for block in synthetic::blocks(&recording, 64) {
            let mut evaluation = design.scratch();
            evaluation.begin(&block).unwrap();
            for sample in block.warm_up..block.len() {
                let signals = block.signals(sample);
                evaluation.evaluate(&block, sample, &mut row).unwrap();
                regressor.compute(&tree, signals.q, signals.qd, signals.qdd, &mut scratch, &mut pairs).unwrap();
                regressor.scatter(&pairs, &mut phi).unwrap();
                for (joint, layout) in design.rows().iter().enumerate() {
                    let mut expected: Vec<f64> =
                        design.base().independent().iter().map(|&column| phi[joint * regressor.columns() + column]).collect();
                    expected.extend((0..joints).map(|other| if other == joint { signals.qd[joint] } else { 0.0 }));
                    let (torque, columns) = row[layout.range.clone()].split_last().unwrap();
                    prop_assert_eq!(*torque, signals.tau[joint]);
                    let mut found = vec![0.0; design.parameter_count()];
                    layout.parameters.iter().zip(columns).for_each(|(&parameter, column)| found[parameter] = *column);
                    prop_assert_eq!(found, expected);
                    prop_assert_eq!(design.counts(&row, joint), signals.qd[joint].abs() > rest_speed);
                }
            }
        }
    }
}

#[test]
fn keeping_effects_keeps_their_order_and_the_rest_rule() {
    let tree = synthetic::robot(3, 4);
    let design = synthetic::design(&tree).with_rest_speeds(vec![0.1; 4]);
    let (base, width) = (design.base().count(), design.width());
    let kept = design.keep(&[2, 0]);
    let joints: Vec<String> = kept.effects().iter().flat_map(|effect| effect.spec().joints).collect();
    assert_eq!(joints, [tree.joint(2).joint.clone(), tree.joint(0).joint.clone()]);
    assert_eq!((kept.parameter_count(), kept.width()), (base + 2, width - 2));
    assert_eq!(kept.effect_parameters(1), base + 1..base + 2);
    let mut row = vec![0.0; kept.evaluation_width()];
    assert!(!kept.counts(&row, 1));
    row[kept.width() + 1] = 1.0;
    assert!(kept.counts(&row, 1));
}

/// 500 joints took 115 s and 11.9 GB before anything was said.
#[test]
fn factors_that_do_not_fit_into_memory_are_refused_before_the_work() {
    let tree = synthetic::robot(4, 5);
    let design = synthetic::design(&tree);
    let mut limits = phiw_limits::Limits::default();
    assert!(phiw_identification::checks::check_size_of_factors(&design, 18, &limits).is_ok());
    limits.factor_bytes = 1000;
    let error =
        phiw_identification::checks::check_size_of_factors(&design, 18, &limits).unwrap_err().to_string();
    assert!(error.contains("5 joints") && error.contains("--hold"), "{error}");
}

/// 200 joints with friction took 40 s and 20 GB in the search for their base parameters, before their size
/// was looked at.
#[test]
fn a_robot_of_200_joints_is_refused_before_its_base_parameters_are_searched_for() {
    let joint = |number: usize| {
        let axis = ["1 0 0", "0 1 0", "0 0 1"][number % 3];
        format!(
            r#"<link name="l{number}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="j{number}" type="continuous"><parent link="l{}"/><child link="l{number}"/><origin xyz="0.1 0.2 0.3"/><axis xyz="{axis}"/></joint>"#,
            number - 1
        )
    };
    let chain = |joints: usize| {
        let joints: String = (1..=joints).map(joint).collect();
        let xml = format!(r#"<robot name="chain"><link name="l0"/>{joints}</robot>"#);
        phiw_dynamics::urdf::read_urdf(&xml, &Default::default()).unwrap().tree
    };
    let limits = phiw_limits::Limits::default();
    let check =
        |joints: usize| phiw_identification::checks::check_size_of_robot(&chain(joints), [], 18, &limits);
    let error = check(200).unwrap_err().to_string();
    // The first body has one, each after it seven.
    assert!(error.contains("200 joints with 1394 parameters or more") && error.contains("--hold"), "{error}");
    assert!(check(60).is_ok());
    let base = phiw_regressor::BaseParameters::of_tree(&chain(6), Default::default()).unwrap();
    assert_eq!(phiw_regressor::fewest_base_parameters(&chain(6)).iter().sum::<usize>(), 36);
    assert!((36..=38).contains(&base.count()), "{}", base.count());
}
