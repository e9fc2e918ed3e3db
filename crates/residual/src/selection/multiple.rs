//! Torques that are logged as another multiple of what they are than the others.

use super::cross_validation::{Foretelling, Parts};
use super::fit::Fit;
use super::problem::{Member, Problem, Torque};
use rayon::prelude::*;

/// Factor between two multiples that are looked at first, and how many there are of it upwards and
/// downwards. What lies beyond is another unit or says nothing of the torque: no factor.
const STEP: f64 = 1.25;
const STEPS: i32 = 8;
/// Times that the step is halved about the best multiple.
const HALVINGS: usize = 6;

/// A torque, and what all columns of the model have to be multiplied by to say what the log does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Multiple {
    pub torque: usize,
    pub factor: f64,
}

/// The torques, of those `open`, whose multiples make all agree better: the best, then the best beside it,
/// while the likelihood of what the model foretells of other motion than it is fitted to grows, and a torque
/// loses there `least_share` of the squares that are left of it. `rows` are the effective rows of each.
///
/// A torque by itself says nothing of its factor. What tells is that all torques are of the same bodies: a
/// factor multiplies one triangle, so that no pass over the rows is needed. Factors within one step are left
/// out, since they are told to first order like any effect; of n torques n − 1 can have one, since the masses
/// take up what they have in common. Of two, a factor on the one is one over it on the other. The torque of
/// which a larger share is left with a factor in force has it, since the other tells the bodies better.
pub(crate) fn multiples(
    mut problem: Problem,
    members: &[Member],
    rows: &[f64],
    least_share: f64,
    mut open: Vec<usize>,
) -> Vec<Multiple> {
    let active = problem.active(members);
    let mut found: Vec<Multiple> = Vec::new();
    let mut fit = Fit::new(&problem, active.clone(), rows, None);
    let mut left = foretold(&problem, &fit);
    let moving = problem.torques.iter().filter(|torque| torque.whole.rows() > 0.0).count();
    while found.len() + 1 < moving {
        let best = open.par_iter().map(|&torque| best_factor(&problem, torque, &active, rows));
        let mut best: Vec<Best> = best.collect();
        best.sort_by(|a, b| a.value.total_cmp(&b.value));
        let Some(likeliest) = best.first() else { break };
        let share_left = |of: usize| likeliest.rss[of] / problem.torques[of].whole.right_hand_side();
        let told_worst = best.iter().max_by(|a, b| share_left(a.torque).total_cmp(&share_left(b.torque)));
        let &Best { torque, log_factor, .. } =
            if moving == 2 { told_worst.unwrap_or(likeliest) } else { likeliest };
        if log_factor.abs() < STEP.ln() || log_factor.abs() >= f64::from(STEPS) * STEP.ln() {
            break;
        }
        let factor = log_factor.exp();
        problem.torques[torque] = problem.torques[torque].times(factor);
        fit = Fit::new(&problem, active.clone(), rows, Some(&fit));
        let left_with_it = foretold(&problem, &fit);
        let is_better = likelihood(&problem, &left_with_it, rows) < likelihood(&problem, &left, rows);
        let is_seen =
            left_with_it.iter().zip(&left).any(|(with, without)| *with <= (1.0 - least_share) * without);
        if !is_better || !is_seen {
            break;
        }
        left = left_with_it;
        open.retain(|other| *other != torque);
        found.push(Multiple { torque, factor });
    }
    found
}

/// A factor of a torque, and what the fit with it leaves.
struct Best {
    torque: usize,
    log_factor: f64,
    /// −2·log of the likelihood.
    value: f64,
    /// What is left of each torque.
    rss: Vec<f64>,
}

/// The factor of a torque at which the likelihood is largest.
fn best_factor(problem: &Problem, torque: usize, active: &[usize], rows: &[f64]) -> Best {
    let mut torques: Vec<Torque> = problem.torques.iter().map(Torque::without_folds).collect();
    let own = torques[torque].without_folds();
    let mut scaled = Problem {
        torques: Vec::new(),
        hypotheses: Vec::new(),
        model: problem.model.clone(),
        absent: problem.absent.clone(),
        prior: None,
        ..*problem
    };
    let mut value = |log_factor: f64| {
        torques[torque] = own.times(log_factor.exp());
        scaled.torques = std::mem::take(&mut torques);
        let fit = Fit::new(&scaled, active.to_vec(), rows, None);
        let value = likelihood(&scaled, &fit.rss, rows);
        torques = std::mem::take(&mut scaled.torques);
        Best { torque, log_factor, value, rss: fit.rss }
    };
    let mut step = STEP.ln();
    let mut best = Best { torque, log_factor: 0.0, value: f64::INFINITY, rss: Vec::new() };
    let mut look = |log_factors: Vec<f64>, best: &mut Best| {
        for log_factor in log_factors {
            let other = value(log_factor);
            if other.value < best.value {
                *best = other;
            }
        }
    };
    look((-STEPS..=STEPS).map(|power| f64::from(power) * step).collect(), &mut best);
    for _ in 0..HALVINGS {
        step *= 0.5;
        look(vec![best.log_factor - step, best.log_factor + step], &mut best);
    }
    best
}

/// What is left of each torque where each stretch of time is foretold from the others.
fn foretold(problem: &Problem, fit: &Fit) -> Vec<f64> {
    Foretelling::new(problem, fit, Parts::Stretches).squares()
}

/// −2·log of the likelihood of what is left of each torque: Σ n_e·log of its variance.
fn likelihood(problem: &Problem, left: &[f64], rows: &[f64]) -> f64 {
    let torques = problem.torques.iter().zip(rows).zip(left);
    let moving = torques.filter(|((own, _), _)| own.whole.rows() > 0.0);
    moving.map(|((own, rows), left)| rows * own.variance(*left).ln()).sum()
}
