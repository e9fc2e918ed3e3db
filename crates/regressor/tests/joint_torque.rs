//! Φw = τ over random robots and states, and the base parameters of robots whose counts are published.

use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::scalar::Lanes;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_dynamics::{Tree, Workspace};
use phiw_regressor::factor::FactorBuilder;
use phiw_regressor::{BaseParameters, BaseParametersOptions, JointTorqueRegressor, parameter_scales};
use proptest::prelude::*;
use std::path::PathBuf;

fn trees() -> impl Strategy<Value = (Tree, RandomState, RandomState)> {
    (any::<u64>(), 5..=30_usize, any::<bool>(), any::<bool>(), any::<bool>()).prop_map(
        |(seed, joints, floating_base, mimic, fixed_links)| {
            let options = RandomTreeOptions { joints, floating_base, mimic, fixed_links };
            let tree = random_tree(seed, &options).unwrap();
            let mut random = RandomNumbers::new(seed ^ 0x9e37);
            let states = (random_state(&tree, &mut random), random_state(&tree, &mut random));
            (tree, states.0, states.1)
        },
    )
}

/// φ as a dense row-major matrix.
fn dense_regressor(tree: &Tree, state: &RandomState) -> Vec<f64> {
    let regressor = JointTorqueRegressor::new(tree);
    let (mut scratch, mut pairs) = (regressor.scratch(), vec![0.0; regressor.buffer_size()]);
    regressor.compute(tree, &state.q, &state.v, &state.a, &mut scratch, &mut pairs).unwrap();
    let mut phi = vec![0.0; regressor.rows() * regressor.columns()];
    regressor.scatter(&pairs, &mut phi).unwrap();
    phi
}

fn times(phi: &[f64], parameters: &[f64]) -> Vec<f64> {
    phi.chunks_exact(parameters.len())
        .map(|row| row.iter().zip(parameters).map(|(a, b)| a * b).sum())
        .collect()
}

fn inverse_dynamics(tree: &Tree, state: &RandomState) -> Vec<f64> {
    let mut torque = vec![0.0; tree.velocity_size()];
    tree.inverse_dynamics(&state.q, &state.v, &state.a, &mut Workspace::new(tree), &mut torque).unwrap();
    torque
}

fn assert_relative(found: &[f64], expected: &[f64], tolerance: f64) {
    let scale = expected.iter().fold(1e-3, |largest: f64, value| largest.max(value.abs()));
    for (index, (left, right)) in found.iter().zip(expected).enumerate() {
        assert!((left - right).abs() <= tolerance * scale, "row {index}: {left} against {right}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn regressor_times_parameters_is_inverse_dynamics((tree, state, _) in trees()) {
        let torque = times(&dense_regressor(&tree, &state), &tree.inertial_parameters());
        assert_relative(&torque, &inverse_dynamics(&tree, &state), 1e-10);
    }

    #[test]
    fn lanes_are_single_samples_side_by_side((tree, first, second) in trees()) {
        let regressor = JointTorqueRegressor::new(&tree);
        let side_by_side = |pick: fn(&RandomState) -> &Vec<f64>| -> Vec<Lanes<4>> {
            pick(&first).iter().zip(pick(&second)).map(|(a, b)| Lanes([*a, *b, *b, *a])).collect()
        };
        let mut pairs = vec![Lanes([0.0; 4]); regressor.buffer_size()];
        regressor.compute_lanes(&tree, &side_by_side(|s| &s.q), &side_by_side(|s| &s.v), &side_by_side(|s| &s.a),
            &mut regressor.scratch(), &mut pairs).unwrap();
        for (lane, state) in [(0, &first), (1, &second), (2, &second), (3, &first)] {
            let single: Vec<f64> = pairs.iter().map(|value| value.0[lane]).collect();
            let mut phi = vec![0.0; regressor.rows() * regressor.columns()];
            regressor.scatter(&single, &mut phi).unwrap();
            assert_relative(&phi, &dense_regressor(&tree, state), 1e-12);
        }
    }

    #[test]
    fn base_parameters_say_all_that_standard_ones_say((tree, state, _) in trees()) {
        let base = BaseParameters::of_tree(&tree, BaseParametersOptions::default()).unwrap();
        // Joints that follow one coordinate at different ratios are analytic functions of it, whose
        // independence fades without a gap: what is left of them then has few digits.
        prop_assert!(tree.has_mimic() || base.rank_gap() > 1e3, "rank gap {}", base.rank_gap());
        prop_assume!(base.rank_gap() > 1e3);
        let standard = tree.inertial_parameters();
        let parameters = base.from_standard(&standard).unwrap();
        let phi = dense_regressor(&tree, &state);
        let reduced: Vec<f64> = phi.chunks_exact(standard.len())
            .flat_map(|row| base.independent().iter().map(|&column| row[column]).collect::<Vec<_>>()).collect();
        let torque = inverse_dynamics(&tree, &state);
        // Columns that are dropped are nearly dependent and no more: one tree in many was 3e-8 off.
        assert_relative(&times(&reduced, &parameters), &torque, 1e-7);

        // The way back: exact in the base parameters, and the reference itself when nothing has changed.
        let changed: Vec<f64> = parameters.iter().map(|value| 1.1 * value + 0.01).collect();
        let lifted = base.to_standard(&changed, &standard).unwrap();
        assert_relative(&base.from_standard(&lifted).unwrap(), &changed, 1e-9);
        assert_relative(&base.to_standard(&parameters, &standard).unwrap(), &standard, 1e-9);

        // A gradient follows: what the standard parameters change by, times theirs, is what the base
        // parameters change by, times its own.
        let gradient: Vec<f64> = (0..standard.len()).map(|index| (1.0 + index as f64).sin()).collect();
        let dot = |left: &[f64], right: &[f64]| left.iter().zip(right).map(|(a, b)| a * b).sum::<f64>();
        let moved: Vec<f64> = lifted.iter().zip(&standard).map(|(new, old)| new - old).collect();
        let step: Vec<f64> = changed.iter().zip(&parameters).map(|(new, old)| new - old).collect();
        let pulled = base.gradient_of_base(&gradient, &standard).unwrap();
        assert_relative(&[dot(&pulled, &step)], &[dot(&gradient, &moved)], 1e-7);
    }

    /// Standard parameters vary with the base parameters as these vary, and beside them as they were believed
    /// to; where nothing is known all is the belief's.
    #[test]
    fn standard_parameters_are_as_uncertain_as_the_base_parameters_and_the_belief(
        (tree, _, _) in trees(), share in 0.05..1.0, known in 0.01..0.5,
    ) {
        prop_assume!(!tree.has_mimic());
        let base = BaseParameters::of_tree(&tree, BaseParametersOptions::default()).unwrap();
        let reference = tree.inertial_parameters();
        let (count, scales) = (base.count(), parameter_scales(&reference));
        let own = faer::Mat::from_fn(count, count, |row, column| {
            known * known * if row == column { 1.0 } else { 0.3 / (1.0 + (row + column) as f64) }
        });
        let covariance = |determined: bool| {
            let determined = vec![determined; count];
            base.covariance_of_standard((own.as_ref(), &determined), &reference, share).unwrap()
        };
        let (nothing, unfelt) = (covariance(false), base.unidentifiable());
        let all = covariance(true);
        let through = base.map() * &all * base.map().transpose();
        let largest = scales.iter().fold(0.0_f64, |largest, scale| largest.max(share * scale).max(known)).powi(2);
        for row in 0..count {
            for column in 0..count {
                prop_assert!((through[(row, column)] - own[(row, column)]).abs() < 1e-6 * largest);
            }
        }
        for (row, scale) in scales.iter().enumerate() {
            for column in 0..scales.len() {
                let believed = if row == column { (share * scale).powi(2) } else { 0.0 };
                prop_assert!((nothing[(row, column)] - believed).abs() < 1e-8 * largest);
                // A parameter that no torque feels stays as it was.
                if unfelt.contains(&row) {
                    prop_assert!((all[(row, column)] - believed).abs() < 1e-8 * largest);
                }
            }
        }
    }

    /// A belief about standard parameters says of the base parameters what many draws of the standard ones
    /// say: the rows have mean zero and unit variance, independent of each other.
    #[test]
    fn prior_rows_have_unit_variance((tree, _, _) in trees(), share in 0.05..1.0) {
        prop_assume!(!tree.has_mimic());
        let base = BaseParameters::of_tree(&tree, BaseParametersOptions::default()).unwrap();
        let reference = tree.inertial_parameters();
        let rows = base.prior_rows(&reference, share).unwrap();
        let scales = parameter_scales(&reference);
        // The covariance of the rows, by pushing each standard parameter's own deviation through.
        let mut covariance = vec![0.0; base.count() * base.count()];
        for (standard, scale) in scales.iter().enumerate() {
            let mut moved = reference.clone();
            moved[standard] += share * scale;
            let w = base.from_standard(&moved).unwrap();
            let deviation: Vec<f64> = rows.chunks_exact(base.count() + 1)
                .map(|row| row[..base.count()].iter().zip(&w).map(|(a, b)| a * b).sum::<f64>() - row[base.count()]).collect();
            for (row, a) in deviation.iter().enumerate() {
                for (column, b) in deviation.iter().enumerate() {
                    covariance[row * base.count() + column] += a * b;
                }
            }
        }
        let identity: Vec<f64> = (0..covariance.len()).map(|k| f64::from(u8::from(k % (base.count() + 1) == 0))).collect();
        assert_relative(&covariance, &identity, 1e-6);
    }

    #[test]
    fn condition_number_is_that_of_the_svd_of_phi((tree, _, _) in trees(), seed in any::<u64>()) {
        let base = BaseParameters::of_tree(&tree, BaseParametersOptions::default()).unwrap();
        prop_assume!(base.rank_gap() > 1e3);
        let columns = base.count();
        let mut random = RandomNumbers::new(seed);
        let mut rows = Vec::new();
        while rows.len() < 3 * columns * columns {
            let state = random_state(&tree, &mut random);
            for row in dense_regressor(&tree, &state).chunks_exact(tree.bodies().len() * 10) {
                rows.extend(base.independent().iter().map(|&column| row[column]));
                rows.push(0.0);
            }
        }
        let mut builder = FactorBuilder::new(columns + 1);
        builder.push_rows(&rows).unwrap();
        let matrix = nalgebra::DMatrix::from_row_slice(rows.len() / (columns + 1), columns + 1, &rows);
        let values = matrix.columns(0, columns).into_owned().singular_values();
        let expected = values.max() / values.min();
        let found = builder.factor().condition_number().unwrap();
        // Rounding leaves the smallest singular value uncertain by a share of the largest.
        let tolerance = 1e-6 + 10.0 * f64::EPSILON * expected;
        prop_assert!((found / expected - 1.0).abs() < tolerance, "{} against {}", found, expected);
    }
}

/// Base parameters of a robot file, or `None` where the file is absent.
fn base_parameters_of(path: &str, held: &[&str]) -> Option<(Tree, BaseParameters)> {
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    if !file.exists() {
        println!("skipped: {path} is absent");
        return None;
    }
    let held = held.iter().map(|joint| (joint.to_string(), 0.0)).collect();
    let tree = read_urdf_file(&file, &UrdfOptions { held, ..Default::default() }).unwrap().tree;
    let base = BaseParameters::of_tree(&tree, BaseParametersOptions::default()).unwrap();
    println!(
        "{path}: {} joints, {} base parameters, rank gap {:.1e}",
        tree.joint_count(),
        base.count(),
        base.rank_gap()
    );
    Some((tree, base))
}

fn check_count(path: &str, held: &[&str], joints: usize, expected: usize) {
    if let Some((tree, base)) = base_parameters_of(path, held) {
        assert_eq!((tree.joint_count(), base.count()), (joints, expected), "{path}");
        assert!(base.rank_gap() > 1e3, "{path}: rank gap {}", base.rank_gap());
    }
}

#[test]
fn torobo_has_114_base_parameters() {
    check_count("../shared/data/robots/torobo20/torobo20.urdf", &["torso/joint_3", "head/joint_1"], 18, 114);
}

#[test]
fn viscous_friction_makes_132_of_them() {
    let held = ["torso/joint_3", "head/joint_1"];
    let Some((tree, base)) = base_parameters_of("../shared/data/robots/torobo20/torobo20.urdf", &held) else {
        return;
    };
    let joints = tree.joint_count();
    let mut builder = FactorBuilder::new(base.count() + joints + 1);
    let mut random = RandomNumbers::new(4);
    for _ in 0..200 {
        let state = random_state(&tree, &mut random);
        let phi = dense_regressor(&tree, &state);
        for (joint, row) in phi.chunks_exact(10 * tree.bodies().len()).enumerate() {
            let friction = (0..joints).map(|other| if other == joint { state.v[joint] } else { 0.0 });
            let row: Vec<f64> =
                base.independent().iter().map(|&column| row[column]).chain(friction).chain([0.0]).collect();
            builder.push_row(&row).unwrap();
        }
    }
    let factor = builder.factor();
    assert_eq!((factor.parameters(), factor.undetermined_columns()), (132, vec![]));
}

#[test]
fn talos_upper_body_has_120_base_parameters() {
    let path = "../shared/data/robots/talos/talos_reduced.urdf";
    let file = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    let Ok(xml) = std::fs::read_to_string(&file) else { return println!("skipped: {path} is absent") };
    let upper_body = |joint: &str| {
        joint.starts_with("torso_")
            || joint.starts_with("head_")
            || ((joint.starts_with("arm_left_") || joint.starts_with("arm_right_"))
                && joint.ends_with("_joint"))
    };
    let all = phiw_dynamics::urdf::read_urdf(&xml, &UrdfOptions::default()).unwrap().tree;
    let held: Vec<&str> = all.joint_names().filter(|joint| !upper_body(joint)).collect();
    check_count(path, &held, 18, 120);
}

#[test]
fn puma_560_has_36_base_parameters() {
    check_count("models/puma560.urdf", &[], 6, 36);
}
