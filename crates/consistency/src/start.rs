//! Where the search starts.

use crate::newton::dot;
use crate::problem::Problem;
use faer::Mat;

/// Bodies start at most these factors away from their priors. Small ones would have far to go back.
const FURTHEST_START: (f64, f64) = (0.1, 1e3);
/// The factor by which all bodies fit the data best, as far as it is one: robots without a mass have priors
/// that are far too light.
pub(crate) fn scale_start(problem: &Problem, x: &[f64]) -> f64 {
    let product = &problem.matrix * Mat::from_fn(x.len(), 1, |row, _| x[row]);
    let along: f64 = problem.target.iter().enumerate().map(|(row, target)| product[(row, 0)] * target).sum();
    let scale = along / product.squared_norm_l2();
    if scale.is_finite() { scale.clamp(FURTHEST_START.0, FURTHEST_START.1) } else { 1.0 }
}

/// Extras strictly within their bounds: far enough inside for their own column to matter.
pub(crate) fn extras_start(problem: &Problem) -> Vec<f64> {
    let first = problem.unknowns() - problem.extras;
    let size = dot(&problem.target, &problem.target).sqrt();
    let of_extra = |extra: usize| {
        let unknown = first + extra;
        let norm = problem.gram[(unknown, unknown)].sqrt();
        let reach = if norm > 0.0 && size > 0.0 { 0.1 * size / norm } else { 1.0 };
        let (mut lower, mut upper) = (f64::NEG_INFINITY, f64::INFINITY);
        for bound in problem.constraints.iter().filter(|known| known.is_bound && known.terms[0].0 == unknown)
        {
            match (bound.terms[0].1.at(0, 0), bound.offset.at(0, 0)) {
                (factor, offset) if factor > 0.0 => lower = lower.max(-offset),
                (_, offset) => upper = upper.min(offset),
            }
        }
        let is_on_diagonal = problem.constraints.iter().filter(|known| !known.is_bound).any(|known| {
            let matrix = known.terms.iter().find(|(own, _)| *own == unknown).map(|(_, matrix)| matrix);
            matrix.is_some_and(|matrix| (0..matrix.size).any(|row| matrix.at(row, row) > 0.0))
        });
        match (lower.is_finite(), upper.is_finite()) {
            (true, true) => 0.5 * (lower + upper),
            (true, false) => lower + reach,
            (false, true) => upper - reach,
            (false, false) if is_on_diagonal => reach,
            (false, false) => 0.0,
        }
    };
    (0..problem.extras).map(of_extra).collect()
}
