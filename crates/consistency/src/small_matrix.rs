//! Symmetric matrices of a few rows: Cholesky's factor and eigenvalues, without a library's set-up costs.

/// A square matrix, row by row.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Square {
    pub size: usize,
    pub entries: Vec<f64>,
}

impl Square {
    pub fn zeros(size: usize) -> Self {
        Square { size, entries: vec![0.0; size * size] }
    }

    pub fn from_fn(size: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let entries = (0..size * size).map(|place| entry(place / size, place % size)).collect();
        Square { size, entries }
    }

    pub fn identity(size: usize) -> Self {
        Self::from_fn(size, |row, column| f64::from(u8::from(row == column)))
    }

    pub fn at(&self, row: usize, column: usize) -> f64 {
        self.entries[row * self.size + column]
    }

    pub fn set(&mut self, row: usize, column: usize, value: f64) {
        self.entries[row * self.size + column] = value;
    }

    pub fn times(&self, other: &Self) -> Self {
        let mut product = Square::zeros(self.size);
        for row in 0..self.size {
            for inner in 0..self.size {
                let factor = self.at(row, inner);
                for column in 0..self.size {
                    product.entries[row * self.size + column] += factor * other.at(inner, column);
                }
            }
        }
        product
    }

    pub fn transposed(&self) -> Self {
        Self::from_fn(self.size, |row, column| self.at(column, row))
    }

    /// `self` · `middle` · `self`ᵀ, of a symmetric `middle`.
    pub fn congruence(&self, middle: &Self) -> Self {
        let half = self.times(middle).times(&self.transposed());
        Self::from_fn(self.size, |row, column| 0.5 * (half.at(row, column) + half.at(column, row)))
    }

    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        let entries = self.entries.iter().zip(&other.entries).map(|(a, b)| a + factor * b).collect();
        Square { size: self.size, entries }
    }

    pub fn scaled(&self, factor: f64) -> Self {
        Square { size: self.size, entries: self.entries.iter().map(|value| factor * value).collect() }
    }

    /// The scalar product of two matrices: tr(AᵀB).
    pub fn dot(&self, other: &Self) -> f64 {
        self.entries.iter().zip(&other.entries).map(|(a, b)| a * b).sum()
    }

    /// The lower triangle L of L·Lᵀ; none if the matrix is not positive definite.
    pub fn cholesky(&self) -> Option<Self> {
        let mut lower = Square::zeros(self.size);
        for row in 0..self.size {
            for column in 0..=row {
                let known: f64 =
                    (0..column).map(|inner| lower.at(row, inner) * lower.at(column, inner)).sum();
                let rest = self.at(row, column) - known;
                let value = match row == column {
                    // Also false for what is not a number.
                    true if rest > 0.0 && rest.is_finite() => rest.sqrt(),
                    true => return None,
                    false => rest / lower.at(column, column),
                };
                lower.set(row, column, value);
            }
        }
        Some(lower)
    }

    /// The inverse of a lower triangle.
    pub fn inverse_of_lower(&self) -> Self {
        let mut inverse = Square::zeros(self.size);
        for column in 0..self.size {
            for row in column..self.size {
                let known: f64 =
                    (column..row).map(|inner| self.at(row, inner) * inverse.at(inner, column)).sum();
                let unit = f64::from(u8::from(row == column));
                inverse.set(row, column, (unit - known) / self.at(row, row));
            }
        }
        inverse
    }

    /// Eigenvalues of a symmetric matrix and the eigenvectors as columns, by Jacobi's rotations.
    pub fn eigen(&self) -> (Vec<f64>, Self) {
        let size = self.size;
        let (mut work, mut vectors) = (self.clone(), Square::identity(size));
        for _ in 0..JACOBI_SWEEPS {
            let off: f64 = (0..size)
                .flat_map(|row| (0..row).map(move |column| (row, column)))
                .map(|(row, column)| work.at(row, column).powi(2))
                .sum();
            if off <= f64::EPSILON * f64::EPSILON * work.dot(&work) {
                break;
            }
            for p in 0..size {
                for q in p + 1..size {
                    rotate(&mut work, &mut vectors, p, q);
                }
            }
        }
        ((0..size).map(|index| work.at(index, index)).collect(), vectors)
    }
}

/// Sweeps of rotations; convergence is quadratic, and six have always been enough for ten rows.
const JACOBI_SWEEPS: usize = 30;

fn rotate(work: &mut Square, vectors: &mut Square, p: usize, q: usize) {
    let off = work.at(p, q);
    if off == 0.0 {
        return;
    }
    let theta = (work.at(q, q) - work.at(p, p)) / (2.0 * off);
    let t = theta.signum() / (theta.abs() + theta.hypot(1.0));
    let cosine = 1.0 / t.hypot(1.0);
    let sine = t * cosine;
    for index in 0..work.size {
        let (a, b) = (work.at(index, p), work.at(index, q));
        work.set(index, p, cosine * a - sine * b);
        work.set(index, q, sine * a + cosine * b);
    }
    for index in 0..work.size {
        let (a, b) = (work.at(p, index), work.at(q, index));
        work.set(p, index, cosine * a - sine * b);
        work.set(q, index, sine * a + cosine * b);
        let (a, b) = (vectors.at(index, p), vectors.at(index, q));
        vectors.set(index, p, cosine * a - sine * b);
        vectors.set(index, q, sine * a + cosine * b);
    }
}

#[cfg(test)]
mod tests {
    use super::Square;

    #[test]
    fn eigenvectors_diagonalise_and_factors_multiply_to_the_matrix() {
        for (size, shift) in [(1, 0.5), (2, 1.0), (4, 3.0), (7, 9.0)] {
            let matrix = Square::from_fn(size, |row, column| {
                let away = row.abs_diff(column) as f64;
                if row == column { shift + row as f64 } else { (1.0 + away * (row + column) as f64).sin() }
            });
            let (values, vectors) = matrix.eigen();
            let diagonal = Square::from_fn(size, |row, column| if row == column { values[row] } else { 0.0 });
            let error = vectors.congruence(&diagonal).plus(-1.0, &matrix);
            assert!(error.dot(&error).sqrt() < 1e-12, "{size}: {error:?}");
            if values.iter().all(|value| *value > 0.0) {
                let lower = matrix.cholesky().unwrap();
                let error = lower.times(&lower.transposed()).plus(-1.0, &matrix);
                assert!(error.dot(&error).sqrt() < 1e-12, "{size}: {error:?}");
                let unit = lower.inverse_of_lower().times(&lower).plus(-1.0, &Square::identity(size));
                assert!(unit.dot(&unit).sqrt() < 1e-12, "{size}");
            } else {
                assert_eq!(matrix.cholesky(), None);
            }
        }
    }
}
