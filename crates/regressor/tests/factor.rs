//! The streamed factor against the matrix that it stands for.

use nalgebra::{DMatrix, DVector};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, FactorBuilder, leave_one_out};
use phiw_regressor::least_squares::{Group, GroupedFactor};
use proptest::prelude::*;

/// A row-major matrix of `columns` columns, at least as many rows.
fn matrices() -> impl Strategy<Value = (usize, Vec<f64>)> {
    (2..12_usize, 12..60_usize).prop_flat_map(|(columns, rows)| {
        proptest::collection::vec(-10.0..10.0_f64, columns * rows).prop_map(move |data| (columns, data))
    })
}

fn dense(columns: usize, rows: &[f64]) -> DMatrix<f64> {
    DMatrix::from_row_slice(rows.len() / columns, columns, rows)
}

fn assert_close(left: f64, right: f64, tolerance: f64, what: &str) {
    let scale = left.abs().max(right.abs()).max(1.0);
    assert!((left - right).abs() <= tolerance * scale, "{what}: {left} against {right}");
}

fn assert_same_factor(left: &Factor, right: &Factor) {
    assert_eq!((left.columns(), left.rows()), (right.columns(), right.rows()));
    for row in 0..left.columns() {
        for column in 0..left.columns() {
            assert_close(left.entry(row, column), right.entry(row, column), 1e-9, "entry of R");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn gram_matrix_is_that_of_the_rows((columns, rows) in matrices()) {
        let factor = Factor::of_rows(columns, &rows).unwrap();
        let matrix = dense(columns, &rows);
        let gram = matrix.transpose() * &matrix;
        for i in 0..columns {
            for j in 0..columns {
                let product: f64 = (0..columns).map(|k| factor.entry(k, i) * factor.entry(k, j)).sum();
                assert_close(product, gram[(i, j)], 1e-11 * rows.len() as f64, "RᵀR");
                if i > j {
                    prop_assert_eq!(factor.entry(i, j), 0.0);
                }
            }
        }
    }

    #[test]
    fn merging_in_any_order_is_the_factor_of_all_rows(
        (columns, rows) in matrices(), cuts in proptest::collection::vec(0.0..1.0_f64, 3), order in Just([0, 1, 2, 3]).prop_shuffle(),
    ) {
        let count = rows.len() / columns;
        let mut ends: Vec<usize> = cuts.iter().map(|cut| (cut * count as f64) as usize * columns).collect();
        ends.push(rows.len());
        ends.sort_unstable();
        let mut start = 0;
        let parts: Vec<Factor> = ends.iter().map(|&end| {
            let part = Factor::of_rows(columns, &rows[start..end]).unwrap();
            start = end;
            part
        }).collect();
        let whole = Factor::of_rows(columns, &rows).unwrap();
        let merged = Factor::merge_all(order.map(|index: usize| &parts[index])).unwrap();
        assert_same_factor(&whole, &merged);
        let tree = parts[3].merge(&parts[0]).unwrap().merge(&parts[1].merge(&parts[2]).unwrap()).unwrap();
        assert_same_factor(&whole, &tree);
    }

    #[test]
    fn least_squares_is_that_of_the_svd((columns, rows) in matrices()) {
        let factor = Factor::of_rows(columns, &rows).unwrap();
        let matrix = dense(columns, &rows);
        let phi = matrix.columns(0, columns - 1).into_owned();
        let right: DVector<f64> = matrix.column(columns - 1).into_owned();
        let svd = phi.clone().svd(true, true);
        let expected = svd.solve(&right, 1e-14).unwrap();
        let solution = factor.solve().unwrap();
        for (found, wanted) in solution.parameters.iter().zip(expected.iter()) {
            assert_close(*found, *wanted, 1e-7, "parameter");
        }
        let residual = (&phi * &expected - &right).norm_squared();
        assert_close(solution.residual_sum_of_squares, residual, 1e-9, "residual");
        let other: Vec<f64> = expected.iter().map(|value| value + 0.3).collect();
        let shifted = (&phi * DVector::from_vec(other.clone()) - &right).norm_squared();
        assert_close(factor.residual_sum_of_squares(&other).unwrap(), shifted, 1e-9, "residual of another w");

        let values = &svd.singular_values;
        let condition = values.max() / values.min();
        assert_close(factor.condition_number().unwrap() / condition, 1.0, 1e-8, "cond");
        let covariance = (phi.transpose() * &phi).try_inverse().unwrap();
        for (column, std) in factor.standard_deviations(2.0).unwrap().iter().enumerate() {
            assert_close(*std, 2.0 * covariance[(column, column)].sqrt(), 1e-6, "standard deviation");
        }
    }

    #[test]
    fn triangular_solves_undo_the_factor((columns, rows) in matrices()) {
        let factor = Factor::of_rows(columns, &rows).unwrap();
        prop_assume!(factor.undetermined_columns().is_empty());
        let size = factor.parameters();
        let r = DMatrix::from_fn(size, size, |row, column| factor.entry(row, column));
        prop_assume!(factor.condition_number().unwrap() < 1e6);
        let x = DVector::from_fn(size, |row, _| 1.0 + (row as f64).sin());
        let (mut by_upper, mut by_lower) = ((&r * &x).as_slice().to_vec(), (r.transpose() * &x).as_slice().to_vec());
        factor.solve_upper(&mut by_upper).unwrap();
        factor.solve_lower(&mut by_lower).unwrap();
        for row in 0..size {
            assert_close(by_upper[row], x[row], 1e-7, "R⁻¹·R·x");
            assert_close(by_lower[row], x[row], 1e-7, "R⁻ᵀ·Rᵀ·x");
        }
        prop_assert!(factor.solve_upper(&mut vec![0.0; size + 1]).is_err());
    }

    #[test]
    fn selecting_columns_is_the_factor_of_those_columns((columns, rows) in matrices(), seed in any::<u64>()) {
        let kept: Vec<usize> = (0..columns).rev().filter(|column| seed >> column & 1 == 1).collect();
        let chosen: Vec<f64> = rows.chunks(columns).flat_map(|row| kept.iter().map(|&column| row[column])).collect();
        let factor = Factor::of_rows(columns, &rows).unwrap().select(&kept).unwrap();
        let expected = Factor::of_rows(kept.len(), &chosen).unwrap();
        for row in 0..kept.len() {
            for column in 0..kept.len() {
                assert_close(factor.entry(row, column), expected.entry(row, column), 1e-9, "entry of R");
            }
        }
    }

    #[test]
    fn leaving_one_block_out_is_the_factor_of_the_others((columns, rows) in matrices(), blocks in 1..5_usize) {
        let size = (rows.len() / columns).div_ceil(blocks) * columns;
        let parts: Vec<&[f64]> = rows.chunks(size).collect();
        let factors: Vec<Factor> = parts.iter().map(|part| Factor::of_rows(columns, part).unwrap()).collect();
        for (left_out, factor) in leave_one_out(&factors).unwrap().iter().enumerate() {
            let others: Vec<f64> = parts.iter().enumerate()
                .filter(|(index, _)| *index != left_out).flat_map(|(_, part)| part.iter().copied()).collect();
            assert_same_factor(factor, &Factor::of_rows(columns, &others).unwrap());
        }
    }
}

#[test]
fn a_column_of_rounding_alone_is_undetermined() {
    // The torque of a vertical force about a vertical axis, beside that of a horizontal one.
    let row = |k: f64| [1e-16 * (13.0 * k * k).sin(), k.sin(), 0.3 * k.sin() + 1e-3 * k.cos()];
    let rows: Vec<f64> = (0..40).flat_map(|k| row(f64::from(k))).collect();
    let factor = Factor::of_rows(3, &rows).unwrap();
    assert_eq!(factor.undetermined_columns(), [0]);
    assert!(factor.solve().is_err());
}

#[test]
fn dependent_columns_are_named_whatever_comes_before_them() {
    // Columns: zero, x, 2x, y, x + y, right-hand side.
    let row = |x: f64, y: f64| [0.0, x, 2.0 * x, y, x + y, 3.0 * x - y];
    let rows: Vec<f64> = (0..40).flat_map(|k| row((k as f64).sin(), (k as f64 * 0.7).cos())).collect();
    let factor = Factor::of_rows(6, &rows).unwrap();
    assert_eq!(factor.undetermined_columns(), [0, 2, 4]);
    let error = factor.solve().unwrap_err();
    assert_eq!(error, RegressorError::RankDeficient { columns: 5, undetermined: vec![0, 2, 4] });
    let solution = factor.select(&[1, 3, 5]).unwrap().solve().unwrap();
    assert_close(solution.parameters[0], 3.0, 1e-12, "x");
    assert_close(solution.parameters[1], -1.0, 1e-12, "y");
    assert!(factor.condition_number().unwrap() > 1e12);
}

#[test]
fn rows_that_do_not_fit_are_refused() {
    let mut builder = FactorBuilder::new(3);
    assert!(matches!(builder.push_row(&[1.0, 2.0]), Err(RegressorError::Dimension(_))));
    assert!(matches!(builder.push_rows(&[1.0; 7]), Err(RegressorError::Dimension(_))));
    let error = builder.push_rows(&[1.0, 2.0, 3.0, 1.0, f64::NAN, 3.0]).unwrap_err();
    assert_eq!(error, RegressorError::NotFinite { row: 1 });
}

/// A column that is not there was reported as a slice of the wrong length: "column index has 9 elements, but
/// this robot needs 8".
#[test]
fn an_index_out_of_range_is_named_with_what_it_indexes_and_its_bound() {
    let check = |result: Result<(), RegressorError>, message: &str| {
        assert_eq!(result.unwrap_err().to_string(), message);
    };
    let factor = Factor::of_rows(3, &[1.0, 2.0, 3.0]).unwrap();
    let column = "column 3 does not exist: there are 3, counted from 0";
    check(factor.select(&[0, 3]).map(|_| ()), column);
    check(FactorBuilder::new(3).push_factor(&factor, &[0, 1, 3], 1.0), column);
    check(
        FactorBuilder::new(0).push_factor(&factor, &[0, 1, 2], 1.0),
        "column 0 does not exist: there are 0, counted from 0",
    );
    let parameter = "parameter 2 does not exist: there are 2, counted from 0";
    let group = |parameters: Vec<usize>| vec![Group { parameters, factor: factor.clone() }];
    check(GroupedFactor::new(2, group(vec![0, 2])).map(|_| ()), parameter);
    check(GroupedFactor::new(2, group(vec![0, 1])).unwrap().select(&[2]).map(|_| ()), parameter);
    assert_eq!(factor.select(&[]).unwrap().rows(), 1);
}
