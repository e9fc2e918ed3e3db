//! The linear map of the parameters, and what it says of uncertainty.

use crate::robots;

use phiw_dynamics::random_tree::RandomNumbers;
use phiw_zmp::{BalanceRows, ZmpModel, ZmpWorkspace, standard_deviation};
use proptest::prelude::*;
use robots::{Built, assert_close, robot, upper_body};

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn rows_times_parameters_are_the_balance(robot in robot()) {
        let Built { tree, state, parameters } = robot.build();
        let mut workspace = ZmpWorkspace::new(&tree);
        let expected = workspace.evaluate(&tree, &parameters, &state.q, &state.v, &state.a).unwrap();
        let mut rows = BalanceRows::new(&tree);
        rows.compute(&tree, &state.q, &state.v, &state.a, &mut workspace).unwrap();
        let found = rows.balance(&parameters).unwrap();
        prop_assert_eq!(rows.parameter_count(), parameters.len());
        assert_close(&found.wrench, &expected.wrench, 1e-11);
        assert_close(&found.center_of_mass.position, &expected.center_of_mass.position, 1e-12);
        assert_close(&found.center_of_mass.acceleration, &expected.center_of_mass.acceleration, 1e-11);
        for (row, component) in rows.wrench().chunks_exact(parameters.len()).zip(expected.wrench) {
            let sum: f64 = row.iter().zip(&parameters).map(|(y, w)| y * w).sum();
            prop_assert!((sum - component).abs() < 1e-10 * component.abs().max(100.0));
        }
        for (row, place) in rows.first_moment().chunks_exact(parameters.len()).zip(expected.center_of_mass.position) {
            let sum: f64 = row.iter().zip(&parameters).map(|(y, w)| y * w).sum();
            prop_assert!((sum - place * expected.center_of_mass.mass).abs() < 1e-10 * expected.center_of_mass.mass);
        }
    }

    #[test]
    fn gradient_is_the_central_difference(robot in robot(), point_mass in any::<bool>(), floor_height in -1.0..1.0) {
        let Built { tree, state, parameters } = robot.build();
        let model = if point_mass { ZmpModel::PointMass } else { ZmpModel::MultiBody };
        let mut workspace = ZmpWorkspace::new(&tree);
        let mut rows = BalanceRows::new(&tree);
        // Slow enough to press on the floor.
        let slow: Vec<f64> = state.v.iter().map(|v| 0.1 * v).collect();
        let gentle: Vec<f64> = state.a.iter().map(|a| 0.1 * a).collect();
        rows.compute(&tree, &state.q, &slow, &gentle, &mut workspace).unwrap();
        let balance = rows.balance(&parameters).unwrap();
        let mut gradient = vec![f64::NAN; 2 * parameters.len()];
        let zmp = rows.zmp_gradient(model, &balance, floor_height, &mut gradient).unwrap();
        prop_assert_eq!(zmp, balance.zmp(model, floor_height));
        prop_assume!(balance.wrench[2] > 0.2 * 9.81 * balance.center_of_mass.mass);
        let mut moved = parameters.clone();
        let mut expected = vec![0.0; gradient.len()];
        for index in 0..parameters.len() {
            let step = 1e-5;
            let mut at = |sign: f64| {
                moved[index] = parameters[index] + sign * step;
                workspace.evaluate(&tree, &moved, &state.q, &slow, &gentle).unwrap().zmp(model, floor_height).unwrap()
            };
            let (after, before) = (at(1.0), at(-1.0));
            moved[index] = parameters[index];
            for axis in 0..2 {
                expected[axis * parameters.len() + index] = (after[axis] - before[axis]) / (2.0 * step);
            }
        }
        assert_close(&gradient, &expected, 1e-7);
    }
}

#[test]
fn without_a_zmp_there_is_no_gradient() {
    let (tree, parameters) = upper_body();
    let still = [0.0; 18];
    let mut workspace = ZmpWorkspace::new(&tree);
    let mut rows = BalanceRows::new(&tree);
    rows.compute(&tree, &still, &still, &still, &mut workspace).unwrap();
    let nothing = rows.balance(&vec![0.0; parameters.len()]).unwrap();
    let mut gradient = vec![f64::NAN; 380];
    for model in [ZmpModel::PointMass, ZmpModel::MultiBody] {
        assert_eq!(rows.zmp_gradient(model, &nothing, 0.0, &mut gradient).unwrap(), None);
        assert_eq!(gradient, vec![0.0; 380]);
    }
    let error = rows.zmp_gradient(ZmpModel::PointMass, &nothing, 0.0, &mut gradient[1..]).unwrap_err();
    assert_eq!(error.to_string(), "the ZMP's gradient has 379 elements, but this robot needs 380");
}

/// What the covariance of the parameters makes of the ZMP, against 4000 draws of the parameters.
#[test]
fn standard_deviation_is_that_of_drawn_parameters() {
    let (tree, parameters) = upper_body();
    let count = parameters.len();
    let pose: Vec<f64> = (0..18).map(|joint| 0.3 * (1.7 * joint as f64).sin()).collect();
    let speed: Vec<f64> = (0..18).map(|joint| (2.3 * joint as f64).cos()).collect();
    let push: Vec<f64> = (0..18).map(|joint| 3.0 * (0.9 * joint as f64).sin()).collect();
    let mut workspace = ZmpWorkspace::new(&tree);
    let mut rows = BalanceRows::new(&tree);
    rows.compute(&tree, &pose, &speed, &push, &mut workspace).unwrap();
    let balance = rows.balance(&parameters).unwrap();
    // Each parameter by 3 % of its size, and all masses together by 2 % more.
    let own: Vec<f64> = parameters.iter().map(|w| 0.03 * w).collect();
    let shared: Vec<f64> =
        (0..count).map(|index| if index % 10 == 0 { 0.02 * parameters[index] } else { 0.0 }).collect();
    let mut covariance = vec![0.0; count * count];
    for row in 0..count {
        for column in 0..count {
            covariance[row * count + column] = shared[row] * shared[column];
        }
        covariance[row * count + row] += own[row] * own[row];
    }
    let mut random = RandomNumbers::new(7);
    // Twelve uniform numbers make a normal one.
    let mut normal = || (0..12).map(|_| random.uniform(-0.5, 0.5)).sum::<f64>();
    let draws = 4000;
    for model in [ZmpModel::PointMass, ZmpModel::MultiBody] {
        let mut gradient = vec![0.0; 2 * count];
        let zmp = rows.zmp_gradient(model, &balance, 0.0, &mut gradient).unwrap().unwrap();
        let predicted: Vec<f64> = gradient
            .chunks_exact(count)
            .map(|gradient| standard_deviation(gradient, &covariance).unwrap())
            .collect();
        let mut sums = [0.0; 2];
        for _ in 0..draws {
            let together = normal();
            let drawn: Vec<f64> = (0..count)
                .map(|index| parameters[index] + own[index] * normal() + shared[index] * together)
                .collect();
            let found = rows.balance(&drawn).unwrap().zmp(model, 0.0).unwrap();
            (0..2).for_each(|axis| sums[axis] += (found[axis] - zmp[axis]).powi(2));
        }
        for axis in 0..2 {
            let drawn = (sums[axis] / f64::from(draws)).sqrt();
            println!(
                "{model:?} axis {axis}: {:.3} mm predicted, {:.3} mm drawn",
                1e3 * predicted[axis],
                1e3 * drawn
            );
            assert!((drawn / predicted[axis] - 1.0).abs() < 0.05);
        }
    }
    let error = standard_deviation(&[0.0; 3], &[0.0; 6]).unwrap_err();
    assert_eq!(error.to_string(), "the covariance has 6 elements, but this robot needs 9");
}
