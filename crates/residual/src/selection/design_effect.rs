//! How many rows are worth one: the design effect (Kish 1965), robust.

use super::fit::Fit;
use super::problem::Problem;
use super::screening::Beside;
use rayon::prelude::*;

/// Folds below which nothing can be said of the residual's correlation.
const LEAST_FOLDS: usize = 4;
/// Effective rows of a torque that has as many, at least: a tenth of a second of each of twenty folds.
const LEAST_ROWS: f64 = 20.0;
/// Squared share of a column that must be left beside the model for it to be asked.
const DETERMINED: f64 = 1e-3;

/// Effective rows of each torque: its rows over the median, over the columns that could act on it, of what
/// the scores' spread from fold to fold is against that of independent rows.
///
/// A fold's score is the product of a column with the residual. Noise of any colour that is short against a
/// fold makes the scores of the folds independent, and their spread says how much of the noise a column sees.
pub(super) fn effective_rows(problem: &Problem, fit: &Fit) -> Vec<f64> {
    let of_torque = |torque: usize| {
        let rows = problem.torques[torque].whole.rows();
        let effect = design_effect(problem, fit, torque).max(problem.rows_per_independent).max(1.0);
        (rows / effect).max(rows.min(LEAST_ROWS)).max(2.0)
    };
    (0..problem.torques.len()).into_par_iter().map(of_torque).collect()
}

fn design_effect(problem: &Problem, fit: &Fit, torque: usize) -> f64 {
    let rows = &problem.torques[torque];
    let folds = rows.folds.iter().filter(|fold| fold.rows() > 0.0).count();
    if folds < LEAST_FOLDS {
        return 1.0;
    }
    let values = fit.columns(torque);
    let variance = fit.rss[torque] / rows.whole.rows().max(1.0);
    // The scores of the model's own columns, fold by fold: what a column beside them shares with them goes
    // out.
    let active: Vec<(usize, usize)> =
        fit.own[torque].iter().filter(|(_, place)| fit.determined[*place]).copied().collect();
    let of_model: Vec<Vec<f64>> = rows
        .folds
        .iter()
        .map(|fold| active.iter().map(|&(column, _)| fold.score(column, &values)).collect())
        .collect();
    let probes = problem.hypotheses.iter().filter(|hypothesis| hypothesis.torques == [torque]);
    let mut effects: Vec<f64> = Vec::new();
    for hypothesis in probes {
        let variant = &hypothesis.variants[hypothesis.variants.len() / 2];
        for &parameter in &variant.parameters {
            let Some(column) = rows.column(parameter) else { continue };
            if fit.place[parameter].is_some() {
                continue;
            }
            let beside = Beside::new(problem, fit, &[parameter], &[torque]);
            let norm = fit.weights[torque] * rows.whole.column(column)[column];
            let left = beside.left(0, 0);
            if left <= DETERMINED * norm || norm <= 0.0 {
                continue;
            }
            let shares = fit.backward(beside.into_part());
            let scores: Vec<f64> = rows
                .folds
                .iter()
                .zip(&of_model)
                .filter(|(fold, _)| fold.rows() > 0.0)
                .map(|(fold, of_model)| {
                    let shared: f64 =
                        active.iter().zip(of_model).map(|((_, place), score)| shares[*place] * score).sum();
                    fold.score(column, &values) - shared
                })
                .collect();
            let mean = scores.iter().sum::<f64>() / folds as f64;
            let spread: f64 = scores.iter().map(|score| (score - mean).powi(2)).sum();
            effects
                .push(spread * folds as f64 / (folds as f64 - 1.0) / (left / fit.weights[torque] * variance));
        }
    }
    median(effects).unwrap_or(1.0)
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied()
}
