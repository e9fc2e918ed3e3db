//! Which of two models the motion prefers, where neither is a part of the other.

use super::criterion::criterion;
use super::distribution::students_tail;
use super::fit::Fit;
use super::problem::{Member, Problem};

/// A model fitted to the rows, and what the criterion makes of it.
pub(crate) struct Judged {
    problem: Problem,
    fit: Fit,
    value: f64,
}

impl Judged {
    /// A model whose torques have these effective rows, with what is linearised as it is in force, and no
    /// step beyond that.
    pub fn new(mut problem: Problem, members: &[Member], rows: &[f64]) -> Self {
        problem.absent.fill(0.0);
        let (fit, value) = as_in_force(&problem, members, rows);
        Judged { problem, fit, value }
    }

    /// What the criterion is.
    pub fn value(&self) -> f64 {
        self.value
    }

    /// Probability that this model would be as much better than the other, or more, if on motion of this kind
    /// the two were as good: the test of Vuong (1989) for models of which neither is a part of the other,
    /// with the folds as what is independent. `rows` are the effective rows that both were judged with.
    ///
    /// A form that is not there may make the criterion smaller by what it does in a few moments, where what
    /// is there has a form that nobody knows; what is better for what the robot is, is so throughout.
    pub fn tail_of_being_better(&self, other: &Self, rows: &[f64]) -> f64 {
        let folds: Vec<f64> = (self.log_likelihoods(rows).iter())
            .zip(other.log_likelihoods(rows))
            .filter_map(|(own, other)| Some((*own)? - other?))
            .collect();
        tail_of_mean(&folds, 0.5 * (other.value - self.value))
    }

    /// The log-likelihood of each fold but for what both models have in common; `None` of a fold without
    /// rows.
    fn log_likelihoods(&self, rows: &[f64]) -> Vec<Option<f64>> {
        let count = self.problem.torques.first().map_or(0, |torque| torque.folds.len());
        let mut folds = vec![None; count];
        for (torque, rows) in rows.iter().enumerate() {
            let own = &self.problem.torques[torque];
            let variance = own.variance(self.fit.rss[torque]);
            let columns = self.fit.columns(torque);
            for (sum, fold) in folds.iter_mut().zip(&own.folds).filter(|(_, fold)| fold.rows() > 0.0) {
                let of_rows = fold.rows() * variance.ln() + fold.residual(&columns) / variance;
                *sum.get_or_insert(0.0) -= 0.5 * rows / own.whole.rows() * of_rows;
            }
        }
        folds
    }
}

/// The same criterion, and the problem as it was.
pub(crate) fn value_in_force(problem: &mut Problem, members: &[Member], rows: &[f64]) -> f64 {
    let nothing = vec![0.0; problem.absent.len()];
    let absent = std::mem::replace(&mut problem.absent, nothing);
    let (_, value) = as_in_force(problem, members, rows);
    problem.absent = absent;
    value
}

fn as_in_force(problem: &Problem, members: &[Member], rows: &[f64]) -> (Fit, f64) {
    let free = members.iter().filter(|member| !problem.hypotheses[member.hypothesis].linearised);
    let free: Vec<Member> = free.copied().collect();
    let fit = Fit::new(problem, problem.active(&free), rows, None);
    let value = criterion(problem, members, &fit, rows);
    (fit, value)
}

/// P(t > `total` over its standard deviation), with the spread of the folds' parts of it.
fn tail_of_mean(folds: &[f64], total: f64) -> f64 {
    let count = folds.len() as f64;
    if folds.len() < 2 {
        return 1.0;
    }
    let mean = folds.iter().sum::<f64>() / count;
    let spread = folds.iter().map(|part| (part - mean).powi(2)).sum::<f64>() * count / (count - 1.0);
    if spread > 0.0 { students_tail(total / spread.sqrt(), count - 1.0) } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::tail_of_mean;

    /// With two degrees of freedom Student's tail is ½·(1 − t/√(2 + t²)).
    #[test]
    fn the_tail_is_that_of_students_distribution_over_the_folds() {
        for (folds, total) in [([1.0, 2.0, 3.0], 6.0), ([1.0, 2.0, 3.0], -6.0), ([0.0, 0.0, 9.0], 9.0)] {
            let mean = folds.iter().sum::<f64>() / 3.0;
            let spread = folds.iter().map(|part| (part - mean).powi(2)).sum::<f64>() * 1.5;
            let ratio = total / spread.sqrt();
            let exact = 0.5 * (1.0 - ratio / (2.0 + ratio * ratio).sqrt());
            assert!((tail_of_mean(&folds, total) - exact).abs() < 1e-9, "{folds:?} {total}");
        }
    }

    /// A coupling that was not there made the criterion smaller by 52, in the moments in which joints took
    /// turns: what is won in one fold of twenty is no better throughout, however much it is.
    #[test]
    fn what_is_won_in_one_fold_is_not_won_throughout() {
        let mut once = vec![0.0; 20];
        once[7] = 52.0;
        assert!(tail_of_mean(&once, 52.0) > 0.1);
        let throughout: Vec<f64> = (0..20).map(|fold| 2.6 + 0.5 * f64::from(fold % 3)).collect();
        assert!(tail_of_mean(&throughout, throughout.iter().sum()) < 1e-9);
    }

    #[test]
    fn one_fold_tells_nothing() {
        assert_eq!(tail_of_mean(&[], 1.0), 1.0);
        assert_eq!(tail_of_mean(&[5.0], 5.0), 1.0);
        assert_eq!(tail_of_mean(&[2.0, 2.0], 0.0), 1.0);
    }
}
