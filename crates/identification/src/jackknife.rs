//! Solutions that leave out one fold of the training motion after the other.

use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, leave_one_out};
use phiw_regressor::least_squares::GroupedFactor;
use rayon::prelude::*;

/// The solutions of all folds but one.
pub(crate) struct Jackknife {
    /// A solution for each fold that is left out.
    solutions: Vec<Vec<f64>>,
}

impl Jackknife {
    /// Fewer folds say nothing of a spread.
    pub(crate) const LEAST_FOLDS: usize = 4;

    /// Leaves out one fold after the other; `None` where there are too few, or where a fold alone tells some
    /// parameter.
    ///
    /// # Errors
    /// The folds are of different designs.
    pub(crate) fn of(folds: &[GroupedFactor], weights: &[f64]) -> Result<Option<Self>, RegressorError> {
        if folds.len() < Self::LEAST_FOLDS {
            return Ok(None);
        }
        let weighted: Result<Vec<Factor>, RegressorError> =
            folds.par_iter().map(|fold| fold.combine(weights)).collect();
        let mut solutions = Vec::with_capacity(folds.len());
        for solution in leave_one_out(&weighted?)?.par_iter().map(Factor::solve).collect::<Vec<_>>() {
            match solution {
                Ok(solution) => solutions.push(solution.parameters),
                Err(RegressorError::RankDeficient { .. }) => return Ok(None),
                Err(error) => return Err(error),
            }
        }
        Ok(Some(Jackknife { solutions }))
    }

    /// A solution for each fold that is left out.
    pub(crate) fn into_solutions(self) -> Vec<Vec<f64>> {
        self.solutions
    }

    /// The same with each solution changed.
    pub(crate) fn map(self, change: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Jackknife { solutions: self.solutions.iter().map(|solution| change(solution)).collect() }
    }

    /// By how much the solutions deviate from their mean, for the delete-one-fold jackknife (Efron & Stein
    /// 1981): folds are long against the residual's correlation, so correlated samples are not counted as
    /// independent ones.
    pub(crate) fn deviations(&self) -> Vec<Vec<f64>> {
        let count = self.solutions.len() as f64;
        let size = self.solutions.first().map_or(0, Vec::len);
        let means: Vec<f64> = (0..size)
            .map(|at| self.solutions.iter().map(|solution| solution[at]).sum::<f64>() / count)
            .collect();
        let deviation =
            |solution: &Vec<f64>| solution.iter().zip(&means).map(|(value, mean)| value - mean).collect();
        self.solutions.iter().map(deviation).collect()
    }

    /// For each torque what is left of it on folds that are left out \[N²·m², N²\].
    ///
    /// # Errors
    /// The folds are of another design.
    pub(crate) fn left_out_squares(&self, folds: &[GroupedFactor]) -> Result<Vec<f64>, RegressorError> {
        let mut squares = vec![0.0; folds.first().map_or(0, |fold| fold.groups().len())];
        for (fold, solution) in folds.iter().zip(&self.solutions) {
            let own = fold.residual_sums_of_squares(solution)?;
            squares.iter_mut().zip(own).for_each(|(sum, square)| *sum += square);
        }
        Ok(squares)
    }

    /// For each torque the RMS of its error on folds that are left out, less the part that the parameters'
    /// uncertainty has in it \[N·m, N\].
    ///
    /// # Errors
    /// The folds are of another design.
    pub(crate) fn left_out_std(&self, folds: &[GroupedFactor]) -> Result<Vec<f64>, RegressorError> {
        let squares = self.left_out_squares(folds)?;
        let torques = squares.len();
        let count = folds.len() as f64;
        let deviations = self.deviations();
        let of_torque = |torque: usize| {
            let rows: u64 = folds.iter().map(|fold| fold.groups()[torque].factor.rows()).sum();
            // ‖Φ d‖² over the rows of the torque, of every deviation.
            let uncertain: f64 = folds
                .iter()
                .map(|fold| {
                    let group = &fold.groups()[torque];
                    deviations.iter().map(|deviation| square_of(group, deviation)).sum::<f64>()
                })
                .sum();
            let parameters = uncertain * (count - 1.0) / count;
            ((squares[torque] - parameters).max(0.0) / rows.max(1) as f64).sqrt()
        };
        Ok((0..torques).into_par_iter().map(of_torque).collect())
    }
}

/// ‖Φw‖² over the rows of a torque.
fn square_of(group: &phiw_regressor::least_squares::Group, parameters: &[f64]) -> f64 {
    let size = group.parameters.len();
    let row = |row: usize| -> f64 {
        (row..size).map(|column| group.factor.entry(row, column) * parameters[group.parameters[column]]).sum()
    };
    (0..size).map(|at| row(at).powi(2)).sum()
}
