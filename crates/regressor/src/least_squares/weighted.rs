//! Ordinary and per-joint weighted least squares.

use super::GroupedFactor;
use crate::{RegressorError, factor::Solution};

/// Parameters, and each group's noise as the fit found it.
#[derive(Clone, Debug, PartialEq)]
pub struct WeightedSolution {
    /// The parameters w.
    pub parameters: Vec<f64>,
    /// Standard deviations of the parameters for independent rows.
    pub standard_deviations: Vec<f64>,
    /// Standard deviation of the residual of each group, in the unit of its torque.
    pub group_std: Vec<f64>,
    /// Number of times that the weights were renewed.
    pub iterations: usize,
}

/// Weights are taken as settled when none changes by more than this share.
const SETTLED: f64 = 1e-6;
const MOST_ITERATIONS: usize = 50;

/// Least squares with all rows alike (paper, equation 4).
///
/// # Errors
/// The rows do not determine all parameters.
pub fn ordinary_least_squares(factor: &GroupedFactor) -> Result<Solution, RegressorError> {
    factor.combine(&vec![1.0; factor.groups().len()])?.solve()
}

/// Least squares with each group weighted by the inverse of its own residual, iterated until the weights
/// settle.
///
/// Groups that the model fits exactly get the weight of a residual of 1e-9 of their right-hand side.
///
/// # Errors
/// The rows do not determine all parameters.
pub fn weighted_least_squares(factor: &GroupedFactor) -> Result<WeightedSolution, RegressorError> {
    let group_rms: Vec<f64> = factor
        .groups()
        .iter()
        .map(|group| {
            (group.factor.right_hand_side_sum_of_squares() / group.factor.rows().max(1) as f64).sqrt()
        })
        .collect();
    let smallest: Vec<f64> = group_rms.iter().map(|rms| (1e-9 * rms).max(f64::MIN_POSITIVE.sqrt())).collect();
    // The first weights make every group count alike.
    let mut std: Vec<f64> = group_rms.iter().zip(&smallest).map(|(rms, least)| rms.max(*least)).collect();
    let mut iterations = 0;
    loop {
        let weights: Vec<f64> = std.iter().map(|value| 1.0 / value).collect();
        let combined = factor.combine(&weights)?;
        let solution = combined.solve()?;
        let sums = factor.residual_sums_of_squares(&solution.parameters)?;
        let freedom = degrees_of_freedom(factor);
        let renewed: Vec<f64> =
            (0..sums.len()).map(|group| (sums[group] / freedom[group]).sqrt().max(smallest[group])).collect();
        let change = std.iter().zip(&renewed).map(|(old, new)| (new / old - 1.0).abs()).fold(0.0, f64::max);
        iterations += 1;
        std = renewed;
        if change < SETTLED || iterations == MOST_ITERATIONS {
            let weights: Vec<f64> = std.iter().map(|value| 1.0 / value).collect();
            let combined = factor.combine(&weights)?;
            let parameters = combined.solve()?.parameters;
            let standard_deviations = combined.standard_deviations(1.0)?;
            return Ok(WeightedSolution { parameters, standard_deviations, group_std: std, iterations });
        }
    }
}

/// Rows of each group less its share of the parameters (shared in proportion to the groups that determine
/// them).
fn degrees_of_freedom(factor: &GroupedFactor) -> Vec<f64> {
    let mut users = vec![0.0_f64; factor.parameter_count()];
    for group in factor.groups() {
        group.parameters.iter().for_each(|&parameter| users[parameter] += 1.0);
    }
    let used = |parameters: &[usize]| {
        parameters.iter().map(|&parameter| 1.0 / users[parameter].max(1.0)).sum::<f64>()
    };
    factor
        .groups()
        .iter()
        .map(|group| (group.factor.rows() as f64 - used(&group.parameters)).max(1.0))
        .collect()
}
