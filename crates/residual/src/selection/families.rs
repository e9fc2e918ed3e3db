//! Families of columns whose parameters are drawn to nothing, each family by a spread of its own.
//!
//! Each parameter is one of a normal distribution about nothing; what the members of a family have in common
//! is its deviation, which the rows choose (empirical Bayes: the deviation at which the rows are most
//! probable, the members' values being unknown; Efron & Morris 1973, MacKay 1992). Many small members that no
//! test would find one by one are told together, and each is taken only as far as its own rows say.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};
use phiw_regressor::factor::Factor;

/// Rounds of expectation and maximisation; the deviation of a family that is there settles in tens.
const ROUNDS: usize = 200;
/// Where a family's deviation starts, in units of its members' scales.
const FIRST_DEVIATION: f64 = 0.1;

/// Columns, and what a model that is fitted freely beside them leaves of them.
pub(crate) struct Families {
    /// The columns' own triangle behind the model's columns, in units of the noise.
    pub triangle: Mat<f64>,
    /// The same of the right-hand side.
    pub right: Vec<f64>,
    /// The family of each column.
    pub family: Vec<usize>,
    /// What one unit of a family's deviation is of each parameter.
    pub scales: Vec<f64>,
}

/// What the rows say of the parameters.
#[derive(Debug)]
pub(crate) struct Drawn {
    /// Deviation of each parameter about nothing, before the rows; 0 for one that is nothing.
    pub deviations: Vec<f64>,
    /// What is expected of each parameter.
    pub means: Vec<f64>,
}

impl Families {
    /// Takes the rows' triangle, of which the columns are the last.
    pub fn take_last(&mut self, factor: &Factor) {
        let size = self.family.len();
        let first = factor.parameters() - size;
        let entry = |row: usize, column: usize| factor.entry(first + row, first + column);
        self.triangle = Mat::from_fn(size, size, entry);
        self.right = (0..size).map(|row| entry(row, size)).collect();
    }

    /// Families of which the rows are more probable with some spread than with none, by `least_gain` in twice
    /// the logarithm, and the members of these that are expected to be positive: a friction that drives is
    /// none.
    pub fn drawn(&self, least_gain: f64) -> Drawn {
        let mut stays = vec![true; self.family.len()];
        loop {
            let drawn = self.settled(&stays);
            let whole = self.log_probability(&drawn.deviations);
            let mut families: Vec<usize> = self.members(&stays).map(|member| self.family[member]).collect();
            families.sort_unstable();
            families.dedup();
            let gain = |family: usize| {
                let without = drawn.deviations.iter().zip(&self.family);
                let without: Vec<f64> =
                    without.map(|(own, of)| if *of == family { 0.0 } else { *own }).collect();
                2.0 * (whole - self.log_probability(&without))
            };
            let least = families.into_iter().map(|family| (gain(family), family));
            let least = least.min_by(|a, b| a.0.total_cmp(&b.0));
            let leaves: Vec<usize> = match least {
                Some((gain, family)) if gain < least_gain => {
                    self.members(&stays).filter(|member| self.family[*member] == family).collect()
                }
                _ => self.members(&stays).filter(|member| drawn.means[*member] <= 0.0).collect(),
            };
            if leaves.is_empty() {
                return drawn;
            }
            leaves.into_iter().for_each(|member| stays[member] = false);
        }
    }

    fn members<'a>(&self, stays: &'a [bool]) -> impl Iterator<Item = usize> + use<'a> {
        stays.iter().enumerate().filter(|(_, stays)| **stays).map(|(member, _)| member)
    }

    /// The deviations at which the rows are most probable, for the members that stay.
    fn settled(&self, stays: &[bool]) -> Drawn {
        let size = self.family.len();
        let families = self.family.iter().max().map_or(0, |last| last + 1);
        let mut variances = vec![FIRST_DEVIATION * FIRST_DEVIATION; families];
        let mut drawn = Drawn { deviations: vec![0.0; size], means: vec![0.0; size] };
        for _ in 0..ROUNDS {
            for member in self.members(stays) {
                drawn.deviations[member] = variances[self.family[member]].sqrt() * self.scales[member];
            }
            let Some((means, spreads)) = self.expected(&drawn.deviations) else { break };
            let (mut sums, mut counts) = (vec![0.0; families], vec![0.0; families]);
            for member in self.members(stays) {
                let square = (means[member].powi(2) + spreads[member]) / self.scales[member].powi(2);
                sums[self.family[member]] += square;
                counts[self.family[member]] += 1.0;
            }
            for (variance, (sum, count)) in variances.iter_mut().zip(sums.iter().zip(&counts)) {
                *variance = if *count > 0.0 { sum / count } else { 0.0 };
            }
            drawn.means = means;
        }
        drawn
    }

    /// The covariance of the right-hand side: noise of one, and the parameters' spread.
    fn covariance(&self, deviations: &[f64]) -> Mat<f64> {
        let spread = self.spread(deviations);
        Mat::<f64>::identity(deviations.len(), deviations.len()) + &spread * spread.transpose()
    }

    /// The triangle with each column times its parameter's deviation.
    fn spread(&self, deviations: &[f64]) -> Mat<f64> {
        let size = deviations.len();
        Mat::from_fn(size, size, |row, column| self.triangle[(row, column)] * deviations[column])
    }

    /// The parameters' means and variances given the rows.
    fn expected(&self, deviations: &[f64]) -> Option<(Vec<f64>, Vec<f64>)> {
        let size = deviations.len();
        let spread = self.spread(deviations);
        let solver = self.covariance(deviations).llt(Side::Lower).ok()?;
        let right = Mat::from_fn(size, 1, |row, _| self.right[row]);
        let mean = spread.transpose() * solver.solve(&right);
        let taken = spread.transpose() * solver.solve(&spread);
        let means = (0..size).map(|member| deviations[member] * mean[(member, 0)]).collect();
        let variance = |member: usize| deviations[member].powi(2) * (1.0 - taken[(member, member)]).max(0.0);
        Some((means, (0..size).map(variance).collect()))
    }

    /// The logarithm of the probability of the right-hand side, but for a constant.
    fn log_probability(&self, deviations: &[f64]) -> f64 {
        let size = deviations.len();
        let Ok(solver) = self.covariance(deviations).llt(Side::Lower) else { return f64::NEG_INFINITY };
        let right = Mat::from_fn(size, 1, |row, _| self.right[row]);
        let square = (right.transpose() * solver.solve(&right))[(0, 0)];
        let log_determinant: f64 = (0..size).map(|at| 2.0 * solver.L()[(at, at)].ln()).sum();
        -0.5 * (log_determinant + square)
    }
}

#[cfg(test)]
mod tests {
    use super::Families;
    use faer::Mat;

    /// Members of two families, each told by itself; the right-hand side is what is given.
    fn families(right: Vec<f64>) -> Families {
        let size = right.len();
        Families {
            triangle: Mat::identity(size, size),
            right,
            family: (0..size).map(|member| member % 2).collect(),
            scales: vec![1.0; size],
        }
    }

    #[test]
    fn a_family_of_small_members_is_told_together_and_drawn() {
        // None of the even members is three deviations from nothing; the odd ones are noise.
        let right: Vec<f64> = [2.4, 0.5, 1.9, -0.8, 2.6, 0.9, 2.2, -0.3, 1.7, 0.2, 2.5, -0.7].to_vec();
        let drawn = families(right.clone()).drawn(6.6);
        let mean_square = right.iter().step_by(2).map(|value| value * value).sum::<f64>() / 6.0;
        // Closed form: the variance is the mean square less that of the noise, the share kept one less its
        // inverse.
        for (member, value) in right.iter().enumerate() {
            let (variance, share) = match member % 2 {
                0 => (mean_square - 1.0, 1.0 - 1.0 / mean_square),
                _ => (0.0, 0.0),
            };
            assert!((drawn.deviations[member].powi(2) - variance).abs() < 1e-3, "{drawn:?}");
            assert!((drawn.means[member] - share * value).abs() < 1e-3, "{drawn:?}");
        }
    }

    #[test]
    fn what_is_expected_to_be_negative_is_nothing() {
        let drawn = families(vec![6.0, 0.0, 7.0, 0.0, -5.0, 0.0]).drawn(6.6);
        assert!(drawn.means[0] > 0.0 && drawn.means[2] > 0.0, "{drawn:?}");
        assert_eq!((drawn.deviations[4], drawn.means[4]), (0.0, 0.0));
    }

    #[test]
    fn noise_has_no_family() {
        let drawn = families(vec![0.5, -1.1, 0.7, 0.3, -1.4, 0.9, 1.0, -0.2]).drawn(6.6);
        assert!(drawn.deviations.iter().chain(&drawn.means).all(|value| *value == 0.0), "{drawn:?}");
    }
}
