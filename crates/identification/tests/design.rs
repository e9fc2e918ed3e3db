//! The rows of a design against the regressor, whole.

mod synthetic;

use phiw_regressor::JointTorqueRegressor;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Every row is that of φ at the base parameters' columns, then the effects' columns, then the torque; what it leaves out is zero.
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
    assert!(phiw_identification::check_size_of_factors(&design, 18, &limits).is_ok());
    limits.factor_bytes = 1000;
    let error = phiw_identification::check_size_of_factors(&design, 18, &limits).unwrap_err().to_string();
    assert!(error.contains("5 joints") && error.contains("--hold"), "{error}");
}
