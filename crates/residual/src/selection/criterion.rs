//! The one formula that is made smallest.

use super::fit::Fit;
use super::problem::{Member, Problem};

/// What a column costs that the fit does not determine: of two effects that do the same to the last digit, a
/// balancer of the first joint and a force on its link, the one with fewer parameters is the better.
const UNDETERMINED: f64 = 0.01;

/// Σ n_e·log(rss/n) + Σ log n_e over columns and scanned constants + 2·log K for each choice, the smaller the
/// better; twice a negative log-likelihood.
///
/// A residual that is as good as none counts as that, however small it is. n_e are the effective rows of each
/// torque. K hypotheses are chosen from. A kind on all joints but some is one choice and as many as there are
/// exceptions, if that is less than one for each of its joints.
pub(super) fn criterion(problem: &Problem, members: &[Member], fit: &Fit, rows: &[f64]) -> f64 {
    let likelihood: f64 = (0..problem.torques.len())
        .map(|torque| {
            let own = &problem.torques[torque];
            if own.whole.rows() > 0.0 { rows[torque] * own.variance(fit.rss[torque]).ln() } else { 0.0 }
        })
        .sum();
    let columns: f64 = members.iter().map(|&member| price(problem, member, Some(fit), rows)).sum();
    likelihood + fit.prior_squares(problem) + columns + choices(problem, members)
}

/// What the columns and constants of a member cost; columns that `fit` does not determine cost next to
/// nothing.
pub(super) fn price(problem: &Problem, member: Member, fit: Option<&Fit>, rows: &[f64]) -> f64 {
    let hypothesis = &problem.hypotheses[member.hypothesis];
    let variant = problem.variant(member);
    let determined = |parameter: &&usize| {
        fit.is_none_or(|fit| fit.place[**parameter].is_none_or(|place| fit.determined[place]))
    };
    let columns = variant.parameters.iter().filter(determined).count();
    let constants = if hypothesis.declared || columns == 0 { 0 } else { variant.constants };
    let undetermined = UNDETERMINED * (variant.parameters.len() - columns) as f64;
    let columns = if hypothesis.declared { 0 } else { columns };
    price_of(hypothesis.torques.iter().map(|&torque| rows[torque]).sum(), columns + constants) + undetermined
}

/// What `count` numbers cost that were fitted to `rows` effective rows.
pub(super) fn price_of(rows: f64, count: usize) -> f64 {
    rows.max(2.0).ln() * count as f64
}

/// What it costs to have chosen these among all hypotheses.
pub(super) fn choices(problem: &Problem, members: &[Member]) -> f64 {
    let kinds = problem.hypotheses.iter().map(|hypothesis| hypothesis.kind).max().map_or(0, |kind| kind + 1);
    let (mut sites, mut chosen, mut familiar) =
        (vec![0_usize; kinds], vec![0_usize; kinds], vec![false; kinds]);
    for hypothesis in problem.hypotheses.iter().filter(|hypothesis| !hypothesis.declared) {
        sites[hypothesis.kind] += 1;
        familiar[hypothesis.kind] |= hypothesis.familiar;
    }
    for member in members.iter().filter(|member| !problem.hypotheses[member.hypothesis].declared) {
        chosen[problem.hypotheses[member.hypothesis].kind] += 1;
    }
    let count = |kind: usize| match familiar[kind] && chosen[kind] > 0 {
        true => chosen[kind].min(1 + sites[kind] - chosen[kind]),
        false => chosen[kind],
    };
    choice(problem) * (0..kinds).map(count).sum::<usize>() as f64
}

/// The price of one choice.
pub(super) fn choice(problem: &Problem) -> f64 {
    2.0 * (problem.hypotheses.len().max(2) as f64).ln()
}
