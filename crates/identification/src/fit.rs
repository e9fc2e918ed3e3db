//! The fit of a design to its training folds, and its error on those held out.

use crate::checks::InputError;
use crate::covariance::{Covariance, CovarianceSource};
use crate::{Design, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{GroupedFactor, weighted_least_squares};

/// A fitted design.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Value of each parameter; those that the logs do not determine are zero (see `undetermined`).
    pub parameters: Vec<f64>,
    /// Standard deviation of each parameter, from leaving out one fold after the other (correlated samples
    /// count as what they are); not a number where there are too few folds.
    pub standard_deviations: Vec<f64>,
    /// Parameters that the logs do not determine: their columns depend on others.
    pub undetermined: Vec<usize>,
    /// Standard deviation of the residual of each torque on the training folds \[N·m, N\].
    pub residual_std: Vec<f64>,
    /// The weighted factor of \[Φ f\] that gave the parameters, over `determined()` parameters.
    pub factor: Factor,
    /// Covariance of the `determined()` parameters; its diagonal holds the squares of
    /// `standard_deviations` where these are numbers.
    pub covariance: Covariance,
}

impl Fit {
    /// Parameters that the logs determine, ascending.
    pub fn determined(&self) -> Vec<usize> {
        (0..self.parameters.len()).filter(|parameter| !self.undetermined.contains(parameter)).collect()
    }
}

/// Error of a model on some folds, by torque.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueError {
    /// RMSE of each torque \[N·m, N\].
    pub rmse: Vec<f64>,
    /// RMS of each measured torque \[N·m, N\].
    pub rms_torque: Vec<f64>,
    /// RMS of the error over RMS of the torque, all joints and samples pooled.
    pub relative: f64,
    /// Rows of each torque.
    pub rows: u64,
}

/// Fits a design to the rows of all `folds`, each torque weighted by its own residual.
///
/// # Errors
/// There are fewer rows than parameters.
pub fn fit(design: &Design, folds: &[GroupedFactor]) -> Result<Fit, IdentificationError> {
    let all = merge(folds)?;
    check_length(design, &all)?;
    // Columns that are equal in theory differ by the logs' rounding; the difference must not determine
    // parameters.
    let undetermined = undetermined(&all)?;
    let determined: Vec<usize> =
        (0..design.parameter_count()).filter(|parameter| !undetermined.contains(parameter)).collect();
    let kept = all.select(&determined)?;
    let solution = weighted_least_squares(&kept)?;
    let weights: Vec<f64> = solution.group_std.iter().map(|std| 1.0 / std).collect();
    let factor = kept.combine(&weights)?;
    let deviations = jackknife(folds, &determined, &weights)?;
    let standard_deviations = match &deviations {
        Some(deviations) => (0..determined.len()).map(|parameter| spread_of(deviations, parameter)).collect(),
        None => vec![f64::NAN; determined.len()],
    };
    let covariance = match &deviations {
        Some(deviations) => Covariance::of_left_out_folds(&determined, deviations),
        None => {
            let unit = factor.unit_covariance()?;
            Covariance::of_entries(CovarianceSource::LeastSquares, &determined, |row, column| {
                unit[(row, column)]
            })
        }
    };
    let spread = |values: &[f64], absent: f64| {
        let mut all = vec![absent; design.parameter_count()];
        determined.iter().zip(values).for_each(|(&parameter, value)| all[parameter] = *value);
        all
    };
    Ok(Fit {
        parameters: spread(&solution.parameters, 0.0),
        standard_deviations: spread(&standard_deviations, f64::NAN),
        undetermined,
        residual_std: solution.group_std,
        factor,
        covariance,
    })
}

/// The rows of all folds.
///
/// # Errors
/// The folds are of different designs, or there are none.
pub fn merge(folds: &[GroupedFactor]) -> Result<GroupedFactor, RegressorError> {
    let Some((first, rest)) = folds.split_first() else { return GroupedFactor::new(0, Vec::new()) };
    rest.iter().try_fold(first.clone(), |merged, fold| merged.merge(fold))
}

/// Error of `parameters` on the rows of `folds`.
///
/// # Errors
/// `parameters` has the wrong length.
pub fn torque_error(folds: &[GroupedFactor], parameters: &[f64]) -> Result<TorqueError, RegressorError> {
    let all = merge(folds)?;
    let squares = all.residual_sums_of_squares(parameters)?;
    let torques: Vec<f64> =
        all.groups().iter().map(|group| group.factor.right_hand_side_sum_of_squares()).collect();
    let rms = |squares: &[f64]| -> Vec<f64> {
        squares
            .iter()
            .zip(all.groups())
            .map(|(sum, group)| (sum / group.factor.rows().max(1) as f64).sqrt())
            .collect()
    };
    let relative = (squares.iter().sum::<f64>() / torques.iter().sum::<f64>()).sqrt();
    let rows = all.groups().first().map_or(0, |group| group.factor.rows());
    Ok(TorqueError { rmse: rms(&squares), rms_torque: rms(&torques), relative, rows })
}

/// Rows of a torque from which on its error counts as measured; fewer come from a joint that only twitches.
const LEAST_ROWS: u64 = 8;

/// For each torque whether `folds` hold enough motion of its joint to say anything of its error.
///
/// # Errors
/// The folds are of different designs.
pub fn torques_with_enough_rows(folds: &[GroupedFactor]) -> Result<Vec<bool>, RegressorError> {
    let all = merge(folds)?;
    Ok(all.groups().iter().map(|group| group.factor.rows() >= LEAST_ROWS).collect())
}

fn check_length(design: &Design, all: &GroupedFactor) -> Result<(), IdentificationError> {
    let rows = all.rows();
    let parameters = design.parameter_count();
    if rows >= 2 * parameters as u64 {
        return Ok(());
    }
    // Rows come at some tens of Hz for each torque.
    let seconds_missing = (2 * parameters as u64 - rows) as f64 / (20.0 * all.groups().len().max(1) as f64);
    Err(InputError::TooShort { rows, parameters, seconds_missing }.into())
}

pub(crate) fn undetermined(all: &GroupedFactor) -> Result<Vec<usize>, RegressorError> {
    let weights: Vec<f64> = all
        .groups()
        .iter()
        .map(|group| {
            let square = group.factor.right_hand_side_sum_of_squares() / group.factor.rows().max(1) as f64;
            if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 }
        })
        .collect();
    Ok(all.combine(&weights)?.undetermined_columns())
}

/// By how much the solutions that leave out one fold each deviate from their mean, for the delete-one-fold
/// jackknife (Efron & Stein 1981): folds are long against the residual's correlation, so correlated samples
/// are not counted as independent ones. `None` where there are too few folds.
fn jackknife(
    folds: &[GroupedFactor],
    determined: &[usize],
    weights: &[f64],
) -> Result<Option<Vec<Vec<f64>>>, RegressorError> {
    let Some(mut solutions) = left_out(folds, determined, weights)? else { return Ok(None) };
    let count = solutions.len() as f64;
    let means: Vec<f64> = (0..determined.len())
        .map(|parameter| solutions.iter().map(|solution| solution[parameter]).sum::<f64>() / count)
        .collect();
    for solution in &mut solutions {
        solution.iter_mut().zip(&means).for_each(|(value, mean)| *value -= mean);
    }
    Ok(Some(solutions))
}

/// The solutions that leave out one fold each; `None` where there are too few folds.
pub(crate) fn left_out(
    folds: &[GroupedFactor],
    determined: &[usize],
    weights: &[f64],
) -> Result<Option<Vec<Vec<f64>>>, RegressorError> {
    if folds.len() < 4 {
        return Ok(None);
    }
    let weighted: Result<Vec<Factor>, RegressorError> =
        folds.iter().map(|fold| fold.select(determined)?.combine(weights)).collect();
    let mut solutions = Vec::with_capacity(folds.len());
    for factor in phiw_regressor::factor::leave_one_out(&weighted?)? {
        match factor.solve() {
            Ok(solution) => solutions.push(solution.parameters),
            // Without this fold some parameter is not determined, so the folds say nothing about its standard
            // deviation.
            Err(RegressorError::RankDeficient { .. }) => return Ok(None),
            Err(error) => return Err(error),
        }
    }
    Ok(Some(solutions))
}

/// One parameter's standard deviation, from the deviations of the solutions that leave out a fold each.
fn spread_of(deviations: &[Vec<f64>], parameter: usize) -> f64 {
    let square: f64 = deviations.iter().map(|deviation| deviation[parameter].powi(2)).sum();
    let count = deviations.len() as f64;
    (square * (count - 1.0) / count).sqrt()
}
