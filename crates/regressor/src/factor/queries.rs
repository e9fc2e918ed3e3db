//! What a factor answers: least squares, condition, standard deviations, residuals.

use super::{Factor, solve_lower, solve_upper};
use crate::RegressorError;
use faer::Mat;
use phiw_dynamics::check::check_size;
use phiw_dynamics::dense::dot;

/// A column whose part orthogonal to the columns before it is smaller than this share of its norm is
/// undetermined.
const RANK_TOLERANCE: f64 = 1e-7;
/// A column smaller than this share of the largest is nothing but rounding: the torque of a force along an
/// axis about which its joint does not turn.
pub const ROUNDING: f64 = 1e-13;

/// A least-squares solution (paper, equation 4).
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The parameters w.
    pub parameters: Vec<f64>,
    /// ‖Φw − f‖².
    pub residual_sum_of_squares: f64,
    /// Number of rows.
    pub rows: u64,
}

impl Solution {
    /// Root mean square of the residual over the rows.
    pub fn rmse(&self) -> f64 {
        (self.residual_sum_of_squares / self.rows.max(1) as f64).sqrt()
    }

    /// Estimated standard deviation of one row's error: the residual's, with the fitted parameters counted.
    pub fn residual_std(&self) -> f64 {
        let freedom = (self.rows as f64 - self.parameters.len() as f64).max(1.0);
        (self.residual_sum_of_squares / freedom).sqrt()
    }
}

impl Factor {
    /// The columns of Φ that the rows do not determine: those that depend on the columns before them, and
    /// those that are rounding beside the largest ([`ROUNDING`]).
    pub fn undetermined_columns(&self) -> Vec<usize> {
        let size = self.parameters();
        let norms: Vec<f64> = (0..size).map(|column| self.column_norm(column)).collect();
        let least = ROUNDING * norms.iter().copied().fold(0.0, f64::max);
        let is_new =
            |column: usize, left: f64| left > RANK_TOLERANCE * norms[column] && norms[column] >= least;
        if (0..size).all(|column| is_new(column, self.entry(column, column).abs())) {
            return Vec::new();
        }
        // A dependent column shifts the diagonal of those after it: orthogonalise the columns one by one.
        let mut basis: Vec<Vec<f64>> = Vec::new();
        let mut undetermined = Vec::new();
        for column in 0..size {
            let mut rest: Vec<f64> = self.column(column)[..size].to_vec();
            for _ in 0..2 {
                for direction in &basis {
                    let along = dot(direction, &rest);
                    rest.iter_mut().zip(direction).for_each(|(value, unit)| *value -= along * unit);
                }
            }
            let norm = dot(&rest, &rest).sqrt();
            if is_new(column, norm) {
                rest.iter_mut().for_each(|value| *value /= norm);
                basis.push(rest);
            } else {
                undetermined.push(column);
            }
        }
        undetermined
    }

    /// The least-squares solution of Φw = f by back substitution.
    ///
    /// # Errors
    /// [`RegressorError::RankDeficient`] if the rows do not determine all columns.
    pub fn solve(&self) -> Result<Solution, RegressorError> {
        let size = self.parameters();
        let undetermined = self.undetermined_columns();
        if !undetermined.is_empty() {
            return Err(RegressorError::RankDeficient { columns: size, undetermined });
        }
        let mut parameters = vec![0.0; size];
        if size < self.columns() {
            parameters.copy_from_slice(&self.column(size)[..size]);
        }
        self.solve_upper(&mut parameters)?;
        let corner = if size < self.columns() { self.entry(size, size) } else { 0.0 };
        Ok(Solution { parameters, residual_sum_of_squares: corner * corner, rows: self.rows() })
    }

    /// `x` ← R⁻¹·x, R that of Φ alone; not finite where the rows do not determine a column.
    ///
    /// # Errors
    /// `x` has the wrong length.
    pub fn solve_upper(&self, x: &mut [f64]) -> Result<(), RegressorError> {
        check_size("right-hand side", x.len(), self.parameters())?;
        solve_upper(|column| self.column(column), x);
        Ok(())
    }

    /// `x` ← R⁻ᵀ·x, R that of Φ alone; not finite where the rows do not determine a column.
    ///
    /// # Errors
    /// `x` has the wrong length.
    pub fn solve_lower(&self, x: &mut [f64]) -> Result<(), RegressorError> {
        check_size("right-hand side", x.len(), self.parameters())?;
        solve_lower(|column| self.column(column), x);
        Ok(())
    }

    /// ‖Φw − f‖² for any `w`, without the rows.
    ///
    /// # Errors
    /// `w` has the wrong length.
    pub fn residual_sum_of_squares(&self, w: &[f64]) -> Result<f64, RegressorError> {
        let size = self.parameters();
        check_size("parameters", w.len(), size)?;
        // Column by column, as R is stored; parameters that are zero cost nothing.
        let mut residual: Vec<f64> = (0..self.columns()).map(|row| -self.entry(row, size)).collect();
        for (column, &value) in w.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            let entries = self.column(column);
            residual.iter_mut().zip(&entries[..=column]).for_each(|(sum, entry)| *sum += value * entry);
        }
        Ok(dot(&residual, &residual))
    }

    /// ‖Φw‖² for any `w`, without the rows.
    ///
    /// # Errors
    /// `w` has the wrong length.
    pub fn product_sum_of_squares(&self, w: &[f64]) -> Result<f64, RegressorError> {
        check_size("parameters", w.len(), self.parameters())?;
        let mut product = vec![0.0; self.columns()];
        for (column, &value) in w.iter().enumerate().filter(|(_, value)| **value != 0.0) {
            let entries = self.column(column);
            product.iter_mut().zip(&entries[..=column]).for_each(|(sum, entry)| *sum += value * entry);
        }
        Ok(dot(&product, &product))
    }

    /// Sum of squares of the right-hand side, ‖f‖².
    pub fn right_hand_side_sum_of_squares(&self) -> f64 {
        self.columns().checked_sub(1).map_or(0.0, |last| self.column_norm(last).powi(2))
    }

    /// Singular values of Φ, descending.
    ///
    /// # Errors
    /// [`RegressorError::NoConvergence`], which finite numbers never give.
    pub fn singular_values(&self) -> Result<Vec<f64>, RegressorError> {
        let size = self.parameters();
        let r = self.as_mat().get(..size, ..size);
        r.singular_values().map_err(|_| RegressorError::NoConvergence)
    }

    /// cond(Φ) = σ_max / σ_min (paper, equation 5); infinite for a rank-deficient Φ.
    ///
    /// # Errors
    /// [`RegressorError::NoConvergence`], which finite numbers never give.
    pub fn condition_number(&self) -> Result<f64, RegressorError> {
        let values = self.singular_values()?;
        Ok(match (values.first(), values.last()) {
            (Some(&largest), Some(&smallest)) if smallest > 0.0 => largest / smallest,
            (None, _) | (_, None) => 1.0,
            _ => f64::INFINITY,
        })
    }

    /// (RᵀR)⁻¹, column-major: the covariance of the parameters for rows of unit variance.
    ///
    /// # Errors
    /// [`RegressorError::RankDeficient`] if the rows do not determine all columns.
    pub fn unit_covariance(&self) -> Result<Mat<f64>, RegressorError> {
        let inverse = self.inverse_triangle()?;
        Ok(&inverse * inverse.transpose())
    }

    /// Standard deviations of the parameters for independent rows of standard deviation `row_std`.
    ///
    /// # Errors
    /// [`RegressorError::RankDeficient`] if the rows do not determine all columns.
    pub fn standard_deviations(&self, row_std: f64) -> Result<Vec<f64>, RegressorError> {
        let inverse = self.inverse_triangle()?;
        let size = self.parameters();
        let norm = |row: usize| (row..size).map(|column| inverse[(row, column)].powi(2)).sum::<f64>().sqrt();
        Ok((0..size).map(|row| row_std * norm(row)).collect())
    }

    fn inverse_triangle(&self) -> Result<Mat<f64>, RegressorError> {
        let size = self.parameters();
        let undetermined = self.undetermined_columns();
        if !undetermined.is_empty() {
            return Err(RegressorError::RankDeficient { columns: size, undetermined });
        }
        let mut inverse = Mat::identity(size, size);
        faer::linalg::triangular_solve::solve_upper_triangular_in_place(
            self.as_mat().get(..size, ..size),
            inverse.as_mut(),
            faer::Par::Seq,
        );
        Ok(inverse)
    }
}
