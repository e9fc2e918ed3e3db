//! A = L·D·Lᵀ of a symmetric positive definite matrix: Cholesky without square roots, so that it runs on any
//! scalar.

use crate::scalar::Scalar;

/// Solves `A·x = b`: `x` replaces `b`; the factor replaces the lower triangle of `A` (size × size, row by
/// row).
///
/// A singular matrix gives infinities or NaN.
#[inline(always)]
pub(crate) fn solve_in_place<T: Scalar>(matrix: &mut [T], vector: &mut [T], size: usize) {
    let at = |row: usize, column: usize| row * size + column;
    for row in 0..size {
        for column in 0..row {
            // The row holds L·D up to here; D is on the diagonal.
            let mut sum = matrix[at(row, column)];
            for k in 0..column {
                sum -= matrix[at(row, k)] * matrix[at(column, k)];
            }
            matrix[at(row, column)] = sum;
        }
        let mut pivot = matrix[at(row, row)];
        for column in 0..row {
            let scaled = matrix[at(row, column)];
            let factor = scaled / matrix[at(column, column)];
            pivot -= scaled * factor;
            matrix[at(row, column)] = factor;
        }
        matrix[at(row, row)] = pivot;
    }
    for row in 0..size {
        for column in 0..row {
            let known = matrix[at(row, column)] * vector[column];
            vector[row] -= known;
        }
    }
    for row in 0..size {
        vector[row] = vector[row] / matrix[at(row, row)];
    }
    for row in (0..size).rev() {
        for lower in row + 1..size {
            let known = matrix[at(lower, row)] * vector[lower];
            vector[row] -= known;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::solve_in_place;
    use crate::random_tree::RandomNumbers;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn agrees_with_cholesky() {
        let mut random = RandomNumbers::new(1);
        for size in 1..12 {
            let root = DMatrix::from_fn(size, size, |_, _| random.uniform(-1.0, 1.0));
            let matrix = &root * root.transpose() + DMatrix::identity(size, size);
            let vector = DVector::from_fn(size, |_, _| random.uniform(-1.0, 1.0));
            let expected = matrix.clone().cholesky().unwrap().solve(&vector);
            let (mut a, mut x) = (matrix.as_slice().to_vec(), vector.as_slice().to_vec());
            solve_in_place(&mut a, &mut x, size);
            let error = (DVector::from_vec(x) - &expected).norm();
            assert!(error < 1e-12 * expected.norm(), "size {size}: {error}");
        }
    }
}
