//! A = L·Lᵀ of a symmetric positive definite matrix.

/// Cholesky's factor L.
#[derive(Clone, Debug, PartialEq)]
pub struct Cholesky {
    size: usize,
    /// The lower triangle, row by row.
    lower: Vec<f64>,
}

/// Place of an element of a lower triangle that is stored row by row.
fn place(row: usize, column: usize) -> usize {
    row * (row + 1) / 2 + column
}

impl Cholesky {
    /// Of the matrix whose elements on and below the diagonal are `entry(row, column)`; none if it is not
    /// positive definite.
    pub fn of(size: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut lower = vec![0.0; size * (size + 1) / 2];
        for row in 0..size {
            for column in 0..=row {
                let mut sum = entry(row, column);
                for k in 0..column {
                    sum -= lower[place(row, k)] * lower[place(column, k)];
                }
                lower[place(row, column)] = if row != column {
                    sum / lower[place(column, column)]
                } else if sum > 0.0 {
                    sum.sqrt()
                } else {
                    return None;
                };
            }
        }
        Some(Cholesky { size, lower })
    }

    /// Number of rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// An element of L; `column` is at most `row`.
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        self.lower[place(row, column)]
    }

    /// log det A.
    pub fn log_determinant(&self) -> f64 {
        (0..self.size).map(|row| 2.0 * self.entry(row, row).ln()).sum()
    }

    /// `x` ← L⁻¹·x. `x` has [`Self::size`] elements.
    pub fn solve_lower(&self, x: &mut [f64]) {
        for row in 0..self.size {
            for column in 0..row {
                x[row] -= self.entry(row, column) * x[column];
            }
            x[row] /= self.entry(row, row);
        }
    }

    /// `x` ← L⁻ᵀ·x. `x` has [`Self::size`] elements.
    pub fn solve_upper(&self, x: &mut [f64]) {
        for row in (0..self.size).rev() {
            for below in row + 1..self.size {
                x[row] -= self.entry(below, row) * x[below];
            }
            x[row] /= self.entry(row, row);
        }
    }

    /// A⁻¹, row by row.
    pub fn inverse(&self) -> Vec<f64> {
        let mut inverse = vec![0.0; self.size * self.size];
        let mut unit = vec![0.0; self.size];
        for column in 0..self.size {
            unit.fill(0.0);
            unit[column] = 1.0;
            self.solve_lower(&mut unit);
            self.solve_upper(&mut unit);
            unit.iter().enumerate().for_each(|(row, value)| inverse[row * self.size + column] = *value);
        }
        inverse
    }
}

#[cfg(test)]
mod tests {
    use super::Cholesky;
    use crate::random_tree::RandomNumbers;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn agrees_with_nalgebra() {
        let mut random = RandomNumbers::new(5);
        for size in [0, 1, 2, 7, 24] {
            let root = DMatrix::from_fn(size, size, |_, _| random.uniform(-1.0, 1.0));
            let matrix: DMatrix<f64> =
                &root * root.transpose() + DMatrix::from_diagonal_element(size, size, 0.1);
            let ours = Cholesky::of(size, |row, column| matrix[(row, column)]).unwrap();
            let theirs = matrix.clone().cholesky().unwrap();
            let near = |what: &str, found: f64, expected: f64| {
                assert!(
                    (found - expected).abs() < 1e-9 * (1.0 + expected.abs()),
                    "{what}: {found}, not {expected}"
                );
            };
            near("log det", ours.log_determinant(), theirs.ln_determinant());
            let inverse = theirs.inverse();
            let found = ours.inverse();
            for row in 0..size {
                for column in 0..size {
                    near("inverse", found[row * size + column], inverse[(row, column)]);
                }
            }
            let vector = DVector::from_fn(size, |_, _| random.uniform(-1.0, 1.0));
            let (mut by_lower, mut by_upper) = (vector.as_slice().to_vec(), vector.as_slice().to_vec());
            ours.solve_lower(&mut by_lower);
            ours.solve_upper(&mut by_upper);
            let lower = theirs.l();
            let expected = [
                lower.solve_lower_triangular(&vector).unwrap(),
                lower.transpose().solve_upper_triangular(&vector).unwrap(),
            ];
            for row in 0..size {
                near("L⁻¹x", by_lower[row], expected[0][row]);
                near("L⁻ᵀx", by_upper[row], expected[1][row]);
            }
        }
    }

    #[test]
    fn a_matrix_that_is_not_positive_definite_has_no_factor() {
        for matrix in
            [[1.0, 2.0, 1.0], [0.0, 0.0, 1.0], [1.0, 1.0, 1.0], [f64::NAN, 0.0, 1.0], [1.0, 0.0, f64::NAN]]
        {
            let [xx, xy, yy] = matrix;
            let entry = |row: usize, column: usize| [xx, xy, yy][row + column];
            assert_eq!(Cholesky::of(2, entry), None, "{matrix:?}");
        }
    }
}
