//! How much of each effect no mix of all the others can absorb: what is below that has to be named by nobody.

use super::visibility::Absorber;

/// Root mean square of what is left of each column when the absorber and all other columns have taken what
/// they can, in units of the noise.
pub fn visible_beside_others(absorber: &Absorber, columns: Vec<Vec<f64>>, samples: usize) -> Vec<f64> {
    let left: Vec<Vec<f64>> = columns.into_iter().map(|column| absorber.residual(column)).collect();
    let count = left.len();
    let scales: Vec<f64> = left.iter().map(|column| dot(column, column).sqrt()).collect();
    let mut gram = vec![0.0; count * count];
    for row in 0..count {
        for column in 0..count {
            let scale = (scales[row] * scales[column]).max(f64::MIN_POSITIVE);
            gram[row * count + column] = dot(&left[row], &left[column]) / scale;
        }
    }
    let share = unexplained_shares(gram, count);
    let visible = |index: usize| (share[index] / samples as f64).sqrt() * scales[index];
    (0..count).map(visible).collect()
}

/// 1 − R² of each variable on all others, from their correlation matrix: one over the diagonal of its
/// inverse. Nought for those that depend on others.
fn unexplained_shares(matrix: Vec<f64>, count: usize) -> Vec<f64> {
    /// Added to the diagonal: columns that are alike to a part in a million are the same.
    const RIDGE: f64 = 1e-6;
    let mut work = vec![0.0; count * 2 * count];
    for row in 0..count {
        work[row * 2 * count..][..count].copy_from_slice(&matrix[row * count..][..count]);
        work[row * 2 * count + row] += RIDGE;
        work[row * 2 * count + count + row] = 1.0;
    }
    for pivot in 0..count {
        // Positive definite: the diagonal will do.
        let inverse = 1.0 / work[pivot * 2 * count + pivot].max(f64::MIN_POSITIVE);
        let pivot_row: Vec<f64> =
            work[pivot * 2 * count..][..2 * count].iter().map(|value| value * inverse).collect();
        for row in 0..count {
            let factor = work[row * 2 * count + pivot];
            let target = &mut work[row * 2 * count..][..2 * count];
            if row == pivot {
                target.copy_from_slice(&pivot_row);
            } else {
                target.iter_mut().zip(&pivot_row).for_each(|(value, pivot)| *value -= factor * pivot);
            }
        }
    }
    (0..count).map(|index| (1.0 / work[index * 2 * count + count + index] - RIDGE).max(0.0)).collect()
}

fn dot(left: &[f64], right: &[f64]) -> f64 {
    left.iter().zip(right).map(|(left, right)| left * right).sum()
}

#[cfg(test)]
mod tests {
    use super::unexplained_shares;

    /// Two variables of correlation r leave 1 − r² of each other; a third that has nothing to do with them
    /// stays whole.
    #[test]
    fn shares_are_those_of_regression() {
        for r in [0.0, 0.5, 0.9] {
            let shares = unexplained_shares(vec![1.0, r, 0.0, r, 1.0, 0.0, 0.0, 0.0, 1.0], 3);
            for (share, expected) in shares.iter().zip([1.0 - r * r, 1.0 - r * r, 1.0]) {
                assert!((share - expected).abs() < 1e-5, "{r}: {shares:?}");
            }
        }
        assert!(unexplained_shares(vec![1.0, 1.0, 1.0, 1.0], 2).iter().all(|share| *share < 1e-5));
    }
}
