//! Small triangles against the full factor and the full singular value decomposition.

use faer::linalg::solvers::DenseSolveCore;
use phiw_curriculum::selection::Triangle;
use phiw_regressor::factor::Factor;
use proptest::prelude::*;

/// A factor of random rows, column k scaled by 10^(−spread·k/size), and its right-hand side.
fn factor(size: usize, rows: usize, seed: u64, spread: f64) -> Factor {
    let mut rng = phiw_dynamics::random_tree::RandomNumbers::new(seed);
    let scale = |column: usize| 10f64.powf(-spread * column as f64 / size as f64);
    let entries: Vec<f64> =
        (0..rows * (size + 1)).map(|index| rng.uniform(-1.0, 1.0) * scale(index % (size + 1))).collect();
    Factor::of_rows(size + 1, &entries).unwrap()
}

fn close(found: f64, expected: f64, tolerance: f64) -> bool {
    (found - expected).abs() <= tolerance * expected.abs()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn extreme_singular_values_are_those_of_the_full_decomposition(
        size in 1..40_usize, extra in 0..30_usize, seed in 0..1000_u64, spread in 0.0..5.0_f64,
    ) {
        let factor = factor(size, size + extra, seed, spread);
        let all = factor.singular_values().unwrap();
        let [largest, smallest] = Triangle::of_factor(&factor).extreme_singular_values();
        prop_assert!(close(largest, all[0], 1e-10), "{largest} is not {}", all[0]);
        // The decomposition itself knows the smallest to rounding of the largest.
        let rounding = 1e-13 * all[0] / all[size - 1];
        prop_assert!(close(smallest, all[size - 1], 1e-9 + rounding), "{smallest} is not {}", all[size - 1]);
    }

    #[test]
    fn absorbing_is_merging(size in 1..30_usize, seed in 0..1000_u64, spread in 0.0..4.0_f64) {
        let (one, other) = (factor(size, 2 * size, seed, spread), factor(size, 3 * size, seed + 5000, 0.0));
        let mut stack = Triangle::of_factor(&one);
        stack.absorb(&mut Triangle::of_factor(&other));
        let merged = Triangle::of_factor(&one.merge(&other).unwrap());
        for column in 0..size {
            for (row, (found, expected)) in stack.column(column).iter().zip(merged.column(column)).enumerate() {
                // Rows of R may differ by their sign.
                let sign = (stack.column(row)[row] * merged.column(row)[row]).signum();
                prop_assert!((sign * found - expected).abs() < 1e-10 * size as f64, "({row}, {column})");
            }
        }
    }

    #[test]
    fn determinant_and_trace_are_those_of_the_singular_values(size in 1..20_usize, seed in 0..1000_u64) {
        let factor = factor(size, 3 * size, seed, 1.0);
        let triangle = Triangle::of_factor(&factor);
        let all = factor.singular_values().unwrap();
        let determinant: f64 = all.iter().map(|value| 2.0 * value.ln()).sum();
        let trace: f64 = all.iter().map(|value| value.powi(-2)).sum();
        prop_assert!((triangle.log_determinant() - determinant).abs() < 1e-8 * size as f64);
        prop_assert!(close(triangle.inverse_trace(), trace, 1e-7));
    }

    /// trace(X·(ΦᵀΦ)⁻¹·Xᵀ) by the inverse's columns, row by row of X.
    #[test]
    fn the_variance_of_predictions_is_that_of_the_inverse(size in 1..12_usize, seed in 0..1000_u64) {
        let (factor, other) = (factor(size, 3 * size, seed, 1.0), factor(size, 2 * size, seed + 5000, 1.0));
        let [r, x] = [&factor, &other].map(|factor| factor.as_mat().get(..size, ..size).to_owned());
        let inverse = r.partial_piv_lu().inverse();
        let expected = (&x * inverse).squared_norm_l2();
        let [measured, of] = [&factor, &other].map(Triangle::of_factor);
        prop_assert!(close(measured.variance_along(&of), expected, 1e-7));
    }
}

#[test]
fn a_column_of_zeros_has_no_finite_condition_number() {
    let triangle = Triangle::of_factor(&Factor::of_rows(3, &[1.0, 0.0, 1.0, 2.0, 0.0, 3.0]).unwrap());
    assert_eq!(triangle.condition_number(), f64::INFINITY);
    assert_eq!(triangle.inverse_trace(), f64::INFINITY);
    assert_eq!(triangle.variance_along(&triangle), f64::INFINITY);
    assert_eq!(Triangle::empty(0).condition_number(), 1.0);
}
