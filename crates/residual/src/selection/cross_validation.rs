//! What a model foretells of motion that it was not fitted to.

use super::fit::Fit;
use super::problem::Problem;
use rayon::prelude::*;
use std::ops::Range;

/// Stretches of time that are foretold from the rest, one after the other: several folds long each, so that
/// slow disturbances of one stretch do not reach into the others.
const STRETCHES: usize = 5;

/// Σ n_e·log of the residual's variance where each stretch is foretold by a fit to the others: the likelihood
/// of the criterion, with the error of the parameters in it.
pub(super) fn cross_validated(problem: &Problem, fit: &Fit, rows: &[f64]) -> f64 {
    let of_stretch = |stretch: Range<usize>| -> Vec<f64> {
        let others = fit.without(problem, &stretch);
        let of_torque = |(torque, own): (usize, &super::problem::Torque)| -> f64 {
            let columns = others.columns(torque);
            own.folds[stretch.clone()]
                .iter()
                .filter(|fold| fold.rows() > 0.0)
                .map(|fold| fold.residual(&columns))
                .sum()
        };
        problem.torques.iter().enumerate().map(of_torque).collect()
    };
    let squares: Vec<Vec<f64>> = stretches(problem).into_par_iter().map(of_stretch).collect();
    (0..problem.torques.len())
        .map(|torque| {
            let own = &problem.torques[torque];
            let left: f64 = squares.iter().map(|of_stretch| of_stretch[torque]).sum();
            if own.whole.rows() > 0.0 { rows[torque] * own.variance(left).ln() } else { 0.0 }
        })
        .sum()
}

/// The folds of each stretch.
fn stretches(problem: &Problem) -> Vec<Range<usize>> {
    let folds = problem.torques.first().map_or(0, |torque| torque.folds.len());
    let count = STRETCHES.min(folds);
    (0..count).map(|stretch| stretch * folds / count..(stretch + 1) * folds / count).collect()
}
