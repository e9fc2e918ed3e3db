//! Is it there at all? Wald's test over folds.

use super::distribution::fisher_tail;
use super::fit::{Fit, dot, solve_block};
use super::problem::{Member, Problem, Torque};
use super::products::Products;
use rayon::prelude::*;

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
    certainty_by(&FoldScores::new(problem, fit), problem, fit, member)
}

/// [`certainty`], with the fit's scores.
pub(super) fn certainty_by(scores: &FoldScores, problem: &Problem, fit: &Fit, member: Member) -> Certainty {
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
    let folds = scores.along(fit, &influence);
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

/// What each fold says of each active column of each torque: Φᵀ(f − Φw). The same for all members of a fit.
pub(super) struct FoldScores {
    /// For each torque and fold, in the order of [`Fit::own`].
    of_torques: Vec<Vec<Vec<f64>>>,
}

impl FoldScores {
    pub fn new(problem: &Problem, fit: &Fit) -> Self {
        let of_torque = |(torque, rows): (usize, &Torque)| {
            let values = fit.columns(torque);
            let score = |fold: &Products| {
                fit.own[torque].iter().map(|&(column, _)| fold.score(column, &values)).collect()
            };
            rows.folds.iter().map(score).collect()
        };
        FoldScores { of_torques: problem.torques.par_iter().enumerate().map(of_torque).collect() }
    }

    /// For each fold the weighted scores of all active columns times `influence`.
    fn along(&self, fit: &Fit, influence: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; self.of_torques.first().map_or(0, Vec::len)];
        for ((folds, own), weight) in self.of_torques.iter().zip(&fit.own).zip(&fit.weights) {
            for (sum, scores) in sums.iter_mut().zip(folds) {
                let along = own.iter().zip(scores).map(|(&(_, place), score)| influence[place] * score);
                *sum += weight * along.sum::<f64>();
            }
        }
        sums
    }
}

/// Effective rows less the parameters.
fn degrees_of_freedom(problem: &Problem, fit: &Fit) -> f64 {
    let rows: f64 = (0..problem.torques.len()).map(|torque| fit.weights[torque] * fit.rss[torque]).sum();
    (rows - fit.determined.iter().filter(|determined| **determined).count() as f64).max(1.0)
}
