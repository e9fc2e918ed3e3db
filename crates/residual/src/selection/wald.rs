//! Is it there at all? Wald's test over folds.

use super::distribution::fisher_tail;
use super::fit::{Fit, dot, solve_block};
use super::problem::{Member, Problem};

/// How sure a member of a model is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Certainty {
    /// Standard deviations that its fitted columns are from nothing.
    pub significance: f64,
    /// Probability of that, or more, if it were not there.
    pub tail: f64,
}

/// Wald's test of a member of the fitted model, by the larger of two tails.
///
/// One takes the spread of the folds' scores, whole folds as clusters (Liang & Zeger 1986), with Student's
/// distribution of as many degrees of freedom as there are folds but one; since several columns would need
/// more folds than there are, it tests the scale of the fitted combination. The other takes the residual's
/// variance with the effective rows that are in the weights, with Fisher's distribution of all columns.
pub(crate) fn certainty(problem: &Problem, fit: &Fit, member: Member) -> Certainty {
    let nothing = Certainty { significance: 0.0, tail: 1.0 };
    let (own, inverse, values) = block(problem, fit, member);
    if own.is_empty() {
        return nothing;
    }
    let Some(squares) = model_squares(&own, &inverse, &values) else { return nothing };
    let count = own.len() as f64;
    let model_tail = fisher_tail(squares / count, count, degrees_of_freedom(problem, fit));
    // The combination's influence: what each fold's scores say of the scale of the fitted values.
    let direction = weights_of_scale(&own, &inverse, &values);
    let influence: Vec<f64> = (0..fit.active.len())
        .map(|place| inverse.iter().zip(&direction).map(|(column, weight)| weight * column[place]).sum())
        .collect();
    let folds = fold_scores(problem, fit, &influence);
    let clusters = folds.iter().filter(|score| **score != 0.0).count() as f64;
    if clusters < 3.0 {
        return Certainty { significance: squares.sqrt(), tail: model_tail };
    }
    let variance = folds.iter().map(|score| score * score).sum::<f64>() * clusters / (clusters - 1.0);
    let ratio = if variance > 0.0 { 1.0 / variance } else { 0.0 };
    let cluster_tail = fisher_tail(ratio, 1.0, clusters - 1.0);
    Certainty { significance: ratio.min(squares).sqrt(), tail: model_tail.max(cluster_tail) }
}

/// The weighted squares that a member takes away, to first order.
pub(super) fn squares_of(problem: &Problem, fit: &Fit, member: Member) -> f64 {
    let (own, inverse, values) = block(problem, fit, member);
    if own.is_empty() { 0.0 } else { model_squares(&own, &inverse, &values).unwrap_or(0.0) }
}

/// The places of a member's columns that are determined, their columns of the system's inverse, and their
/// values less those that stand for absence.
fn block(problem: &Problem, fit: &Fit, member: Member) -> (Vec<usize>, Vec<Vec<f64>>, Vec<f64>) {
    let parameters = problem.variant(member).parameters.iter().copied();
    let own: Vec<usize> = parameters
        .filter_map(|parameter| fit.place[parameter])
        .filter(|&place| fit.determined[place])
        .collect();
    let value = |&place: &usize| fit.values[fit.active[place]] - problem.absent[fit.active[place]];
    let column = |&place: &usize| {
        let mut unit = vec![0.0; fit.active.len()];
        unit[place] = 1.0;
        fit.backward(fit.forward(&unit))
    };
    let (inverse, values) = (own.iter().map(column).collect(), own.iter().map(value).collect());
    (own, inverse, values)
}

/// vᵀ·(Z_oo)⁻¹·v.
fn model_squares(own: &[usize], inverse: &[Vec<f64>], values: &[f64]) -> Option<f64> {
    let solved = solve_block(own, inverse, values, 0.0)?;
    Some(dot(&solved, values).max(0.0))
}

/// The linear function of the member's values that is one at the fitted ones, and has the smallest variance:
/// (Z_oo)⁻¹·v over vᵀ·(Z_oo)⁻¹·v.
fn weights_of_scale(own: &[usize], inverse: &[Vec<f64>], values: &[f64]) -> Vec<f64> {
    let Some(solved) = solve_block(own, inverse, values, 0.0) else { return vec![0.0; values.len()] };
    let total = dot(&solved, values);
    solved.iter().map(|value| if total > 0.0 { value / total } else { 0.0 }).collect()
}

/// For each fold the weighted scores of all active columns times `influence`.
fn fold_scores(problem: &Problem, fit: &Fit, influence: &[f64]) -> Vec<f64> {
    let count = problem.torques.first().map_or(0, |torque| torque.folds.len());
    let mut scores = vec![0.0; count];
    for (torque, rows) in problem.torques.iter().enumerate() {
        let values = fit.columns(torque);
        let active: Vec<(usize, f64)> = fit.own[torque]
            .iter()
            .map(|&(column, place)| (column, influence[place]))
            .filter(|(_, influence)| *influence != 0.0)
            .collect();
        for (score, fold) in scores.iter_mut().zip(&rows.folds) {
            let of_fold: f64 =
                active.iter().map(|&(column, influence)| influence * fold.score(column, &values)).sum();
            *score += fit.weights[torque] * of_fold;
        }
    }
    scores
}

/// Effective rows less the parameters.
fn degrees_of_freedom(problem: &Problem, fit: &Fit) -> f64 {
    let rows: f64 = (0..problem.torques.len()).map(|torque| fit.weights[torque] * fit.rss[torque]).sum();
    (rows - fit.determined.iter().filter(|determined| **determined).count() as f64).max(1.0)
}
