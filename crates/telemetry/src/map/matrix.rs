//! The inverse of a small matrix.

/// Entries below this share of the largest are taken for zero as pivots: the rounding of a few additions.
const SINGULAR: f64 = 1e-12;

/// The transpose of the inverse of a square matrix; `None` where there is none.
pub(crate) fn inverse_transposed(matrix: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let n = matrix.len();
    let largest = matrix.iter().flatten().fold(0.0_f64, |largest, x| largest.max(x.abs()));
    let mut left: Vec<Vec<f64>> = matrix.to_vec();
    let mut right: Vec<Vec<f64>> =
        (0..n).map(|i| (0..n).map(|j| if i == j { 1.0 } else { 0.0 }).collect()).collect();
    for column in 0..n {
        let pivot = (column..n).max_by(|&a, &b| left[a][column].abs().total_cmp(&left[b][column].abs()))?;
        if left[pivot][column].abs() <= SINGULAR * largest {
            return None;
        }
        left.swap(column, pivot);
        right.swap(column, pivot);
        let factor = 1.0 / left[column][column];
        for side in [&mut left, &mut right] {
            side[column].iter_mut().for_each(|x| *x *= factor);
        }
        for row in (0..n).filter(|&row| row != column) {
            let factor = left[row][column];
            for side in [&mut left, &mut right] {
                for k in 0..n {
                    side[row][k] -= factor * side[column][k];
                }
            }
        }
    }
    Some((0..n).map(|i| (0..n).map(|j| right[j][i]).collect()).collect())
}

#[cfg(test)]
mod tests {
    use super::inverse_transposed;

    #[test]
    fn power_is_the_same_on_both_sides() {
        let matrix = vec![vec![0.5, 0.5, 0.0], vec![0.0, -0.25, 2.0], vec![1.0, 0.0, 0.0]];
        let torques = inverse_transposed(&matrix).unwrap();
        let (speed, torque) = ([1.0, -2.0, 3.0], [0.3, 4.0, -1.0]);
        let times = |m: &[Vec<f64>], x: [f64; 3]| -> Vec<f64> {
            m.iter().map(|row| row.iter().zip(x).map(|(a, b)| a * b).sum()).collect()
        };
        let of_joints: f64 =
            times(&matrix, speed).iter().zip(times(&torques, torque)).map(|(a, b)| a * b).sum();
        let of_motors: f64 = speed.iter().zip(torque).map(|(a, b)| a * b).sum();
        assert!((of_joints - of_motors).abs() < 1e-12, "{of_joints} {of_motors}");
    }

    #[test]
    fn a_matrix_that_loses_a_direction_has_no_inverse() {
        assert_eq!(inverse_transposed(&[vec![1.0, 2.0], vec![2.0, 4.0]]), None);
        assert_eq!(inverse_transposed(&[vec![0.0]]), None);
    }
}
