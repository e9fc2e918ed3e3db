//! Ordinary, weighted and robust least squares over groups of rows.

use phiw_dynamics::random_tree::RandomNumbers;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{
    Group, GroupedFactor, RobustOptions, ordinary_least_squares, robust_least_squares, weighted_least_squares,
};

/// A standard normal number (sum of twelve uniform ones).
fn normal(random: &mut RandomNumbers) -> f64 {
    (0..12).map(|_| random.uniform(0.0, 1.0)).sum::<f64>() - 6.0
}

const TRUTH: [f64; 3] = [2.0, -1.0, 0.5];

/// Two groups over three parameters, the middle one shared; noise of the second is ten times that of the
/// first.
fn rows(seed: u64, count: usize, outliers: bool) -> Vec<(usize, Vec<f64>)> {
    let mut random = RandomNumbers::new(seed);
    let mut rows = Vec::new();
    for index in 0..count {
        for (group, columns, noise) in [(0, [0, 1], 0.1), (1, [1, 2], 1.0)] {
            let x: [f64; 2] = [random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)];
            let mut right = x[0] * TRUTH[columns[0]] + x[1] * TRUTH[columns[1]] + noise * normal(&mut random);
            if outliers && index % 20 == 0 {
                // Outliers lean to one side, so that they bend an ordinary fit.
                right += 40.0 * noise * x[0].abs();
            }
            rows.push((group, vec![x[0], x[1], right]));
        }
    }
    rows
}

fn grouped(rows: &[(usize, Vec<f64>)]) -> GroupedFactor {
    let group = |index: usize, parameters: Vec<usize>| {
        let own: Vec<f64> = rows.iter().filter(|row| row.0 == index).flat_map(|row| row.1.clone()).collect();
        Group { parameters, factor: Factor::of_rows(3, &own).unwrap() }
    };
    GroupedFactor::new(3, vec![group(0, vec![0, 1]), group(1, vec![1, 2])]).unwrap()
}

fn error(found: &[f64]) -> f64 {
    found.iter().zip(TRUTH).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn weights_find_the_noise_of_each_group_and_beat_equal_weights() {
    let (mut ordinary, mut weighted) = (0.0, 0.0);
    for seed in 0..20 {
        let factor = grouped(&rows(seed, 400, false));
        let solution = weighted_least_squares(&factor).unwrap();
        assert!((solution.group_std[0] / 0.1 - 1.0).abs() < 0.15, "{:?}", solution.group_std);
        assert!((solution.group_std[1] - 1.0).abs() < 0.15, "{:?}", solution.group_std);
        let shared = |parameters: &[f64]| (parameters[1] - TRUTH[1]).powi(2);
        ordinary += shared(&ordinary_least_squares(&factor).unwrap().parameters);
        weighted += shared(&solution.parameters);
        for (found, std) in solution.parameters.iter().zip(&solution.standard_deviations) {
            assert!(std.is_finite() && *std > 0.0 && *std < 0.2, "{found} ± {std}");
        }
    }
    assert!(weighted < 0.5 * ordinary, "weighted {weighted}, ordinary {ordinary}");
}

#[test]
fn outliers_bend_the_ordinary_fit_but_hardly_the_robust_one() {
    let rows = rows(3, 2000, true);
    let ordinary = weighted_least_squares(&grouped(&rows)).unwrap();
    let robust = robust_least_squares::<RegressorError>(
        3,
        &[vec![0, 1], vec![1, 2]],
        RobustOptions::default(),
        |visit| rows.iter().try_for_each(|(group, row)| visit(*group, row)),
    )
    .unwrap();
    assert!(error(&robust.solution.parameters) < 0.5 * error(&ordinary.parameters));
    assert!(robust.downweighted.iter().all(|share| (0.05..0.5).contains(share)), "{:?}", robust.downweighted);
}

#[test]
fn selecting_parameters_is_fitting_only_those() {
    let rows = rows(5, 300, false);
    let all = grouped(&rows);
    let selected = all.select(&[2, 1]).unwrap();
    let found = ordinary_least_squares(&selected).unwrap();
    // By hand: the first group keeps only its second column, the second both, in the new order.
    let by_hand: Vec<f64> = rows
        .iter()
        .flat_map(|(group, row)| if *group == 0 { [0.0, row[1], row[2]] } else { [row[1], row[0], row[2]] })
        .collect();
    let expected = Factor::of_rows(3, &by_hand).unwrap().solve().unwrap();
    for (found, expected) in found.parameters.iter().zip(&expected.parameters) {
        assert!((found - expected).abs() < 1e-10);
    }
    let merged = all.merge(&all).unwrap();
    assert_eq!(merged.rows(), 2 * all.rows());
    assert!(all.combine(&[1.0]).is_err());
}
