//! Equation (11): the motion that makes cond of the stack smallest.

use super::{Choice, Question, Selection, Triangle, smallest};
use faer::{Mat, Side};
use phiw_dynamics::dense::dot;
use rand::Rng;

/// Right singular vectors of what has been measured that bound a candidate's cond from below.
const PROBES: usize = 16;

/// Equation (11): the motion with which cond of all measured rows and its own is smallest.
///
/// Exact, but most candidates are never merged. σ_min of the stack is at most what the stack does to any unit
/// vector, and at most the smallest Ritz value over a subspace; the few weakest directions of what has been
/// measured span one in which σ_min nearly lies. σ_max is at least what the stack does to the measured
/// strongest direction. So each candidate has a lower bound of its cond for the price of a few products;
/// candidates are merged in the order of their bounds, until the next bound is no better than the best cond
/// found.
#[derive(Clone, Copy, Debug, Default)]
pub struct SmallestCondition;

impl Selection for SmallestCondition {
    fn name(&self) -> &'static str {
        "smallest_condition"
    }

    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        let all = question.candidates.all();
        let Some(measured) = question.measured else {
            return smallest(question.allowed, |motion| all[motion].condition_number);
        };
        let Some(probes) = Probes::of(measured) else {
            return smallest(question.allowed, |motion| question.stack(motion).condition_number());
        };
        let mut bounds: Vec<(f64, usize)> =
            question.allowed.iter().map(|&motion| (probes.bound(&all[motion].triangle), motion)).collect();
        bounds.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut best: [Option<(f64, usize)>; 2] = [None, None];
        for (bound, motion) in bounds {
            // The runner-up is reported too, so it must be exact as well.
            if best[1].is_some_and(|(second, _)| bound > second) {
                break;
            }
            let found = (question.stack(motion).condition_number(), motion);
            let better = |than: Option<(f64, usize)>| than.is_none_or(|than| found < than);
            if better(best[0]) {
                best = [Some(found), best[0]];
            } else if better(best[1]) {
                best[1] = Some(found);
            }
        }
        Choice {
            motion: best[0].map_or(0, |best| best.1),
            merit: best[0].map(|best| best.0),
            runner_up: best[1].map(|next| (next.1, next.0)),
        }
    }
}

/// Directions in which what has been measured is weakest, and the one in which it is strongest.
struct Probes {
    weakest: Vec<Vec<f64>>,
    /// Squared singular values of `weakest`.
    squares: Vec<f64>,
    strongest: Vec<f64>,
    largest_square: f64,
}

impl Probes {
    /// From the singular value decomposition of R; none if it does not converge.
    fn of(measured: &Triangle) -> Option<Self> {
        let size = measured.size();
        let r =
            Mat::from_fn(size, size, |row, column| measured.column(column).get(row).copied().unwrap_or(0.0));
        let svd = r.svd().ok()?;
        let (v, values) = (svd.V(), svd.S().column_vector());
        let vector = |column: usize| -> Vec<f64> { (0..size).map(|row| v[(row, column)]).collect() };
        let from = size.saturating_sub(PROBES);
        Some(Probes {
            weakest: (from..size).map(vector).collect(),
            squares: (from..size).map(|column| values[column] * values[column]).collect(),
            strongest: vector(0),
            largest_square: values[0] * values[0],
        })
    }

    /// A lower bound of cond of the stack of what has been measured and `candidate`.
    fn bound(&self, candidate: &Triangle) -> f64 {
        let count = self.weakest.len();
        let image = |vector: &Vec<f64>| {
            let mut product = vec![0.0; candidate.size()];
            candidate.multiply(vector, &mut product);
            product
        };
        let images: Vec<Vec<f64>> = self.weakest.iter().map(image).collect();
        let gram = Mat::from_fn(count, count, |row, column| {
            let own = if row == column { self.squares[row] } else { 0.0 };
            own + dot(&images[row], &images[column])
        });
        let Ok(values) = gram.self_adjoint_eigenvalues(Side::Lower) else { return 0.0 };
        let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = self.largest_square + candidate.product_squared(&self.strongest);
        // Rounding must not rule out the best.
        const MARGIN: f64 = 1.0 - 1e-6;
        if smallest > 0.0 { MARGIN * (largest / smallest).sqrt() } else { 0.0 }
    }
}
