//! What a model foretells of motion that it was not fitted to.

use super::fit::Fit;
use super::problem::{Member, Problem};
use rayon::prelude::*;

/// Parts of the motion that are foretold from the rest, one after the other.
const PARTS: usize = 5;

/// How the folds are shared out to the parts.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Parts {
    /// Each part is one stretch of time, several folds long: slow disturbances of one do not reach into the
    /// others.
    Stretches,
    /// Each part has folds of all the time: what is seen in a few folds only, such as a stop, is seen in
    /// several parts.
    Spread,
}

/// A fit to the other parts, with the same weights, for each part of the motion.
pub(crate) struct Foretelling<'a> {
    problem: &'a Problem,
    /// The folds of each part, and the fit to those of the others.
    parts: Vec<(Vec<usize>, Fit)>,
}

impl<'a> Foretelling<'a> {
    pub fn new(problem: &'a Problem, fit: &Fit, parts: Parts) -> Self {
        let of_part = |folds: Vec<usize>| {
            let others = fit.without(problem, &folds);
            (folds, others)
        };
        Foretelling { problem, parts: parts.of(problem).into_par_iter().map(of_part).collect() }
    }

    /// What is left of each torque.
    pub fn squares(&self) -> Vec<f64> {
        self.sum(|_, fit| fit.clone())
    }

    /// What is left of each torque without a member: the others are fitted again, with the same weights.
    pub fn squares_without(&self, member: Member) -> Vec<f64> {
        let own = &self.problem.variant(member).parameters;
        self.sum(|folds, fit| {
            let places: Vec<usize> = own.iter().filter_map(|&parameter| fit.place[parameter]).collect();
            let pinned = fit.pinned(self.problem, &places);
            pinned.unwrap_or_else(|| fit.without_parameters(self.problem, &places, folds))
        })
    }

    /// What fits to the other parts leave of each part, once they are `changed`, of its folds and the fit.
    fn sum(&self, changed: impl Fn(&[usize], &Fit) -> Fit + Sync) -> Vec<f64> {
        let of_part = |(folds, others): &(Vec<usize>, Fit)| -> Vec<f64> {
            let fit = changed(folds, others);
            let of_torque = |(torque, own): (usize, &super::problem::Torque)| -> f64 {
                let columns = fit.columns(torque);
                let folds = folds.iter().map(|&fold| &own.folds[fold]).filter(|fold| fold.rows() > 0.0);
                folds.map(|fold| fold.residual(&columns)).sum()
            };
            self.problem.torques.iter().enumerate().map(of_torque).collect()
        };
        let squares: Vec<Vec<f64>> = self.parts.par_iter().map(of_part).collect();
        let of_torque = |(torque, own): (usize, &super::problem::Torque)| match own.whole.rows() > 0.0 {
            true => squares.iter().map(|of_part| of_part[torque]).sum(),
            // It has no say, and a logarithm of nothing is none.
            false => 1.0,
        };
        self.problem.torques.iter().enumerate().map(of_torque).collect()
    }
}

/// Σ n_e·log of the residual's variance where each stretch is foretold by a fit to the others: the likelihood
/// of the criterion, with the error of the parameters in it.
pub(super) fn cross_validated(problem: &Problem, fit: &Fit, rows: &[f64]) -> f64 {
    let squares = Foretelling::new(problem, fit, Parts::Stretches).squares();
    let torques = problem.torques.iter().zip(rows).zip(&squares);
    torques
        .filter(|((own, _), _)| own.whole.rows() > 0.0)
        .map(|((own, rows), left)| rows * own.variance(*left).ln())
        .sum()
}

impl Parts {
    /// The folds of each part.
    fn of(self, problem: &Problem) -> Vec<Vec<usize>> {
        let folds = problem.torques.first().map_or(0, |torque| torque.folds.len());
        let count = PARTS.min(folds);
        let of_part = |part: usize| match self {
            Parts::Stretches => (part * folds / count..(part + 1) * folds / count).collect(),
            Parts::Spread => (part..folds).step_by(count).collect(),
        };
        (0..count).map(of_part).collect()
    }
}
