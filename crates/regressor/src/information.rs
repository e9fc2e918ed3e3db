//! What rows tell of parameters beside what was believed of them: each one by itself, sums of several, or
//! nothing.
//!
//! Parameters are measured in their prior deviations, so that kg and kg·m² are judged alike. With rows A of
//! unit noise, the posterior covariance is (1 + AᵀA)⁻¹ where the prior's is 1: along the right singular
//! vector of a singular value s it is 1/(1 + s²). A rank has no part in it: a direction is told if its
//! deviation is smaller than its prior by a factor that is stated.

use crate::RegressorError;
use faer::prelude::Solve;
use faer::{Mat, MatRef};
use phiw_dynamics::check::check_size;

/// When something counts as told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InformationSettings {
    /// How many times narrower than its prior a posterior has to be, above one.
    pub narrower_by: f64,
}

impl Default for InformationSettings {
    fn default() -> Self {
        InformationSettings { narrower_by: 10.0 }
    }
}

/// A term is left out of a sum that stays narrower than asked by this factor, or whose deviation grows by no
/// more than this share.
const NEGLIGIBLE: f64 = 0.1;
/// How independent of the chosen ones a parameter has to be to lead a sum: first more, then less.
const INDEPENDENT: [f64; 4] = [0.3, 0.1, 0.01, 0.0];
/// Share of a direction that has to lie outside of what is known otherwise.
const OUTSIDE: f64 = 0.5;
/// Share of the largest below which a direction is rounding.
const RANK: f64 = 1e-7;

/// A sum of parameters with factors, by their indices.
pub type Sum = Vec<(usize, f64)>;

/// Rows and a prior.
#[derive(Clone, Debug)]
pub struct Information {
    settings: InformationSettings,
    prior: Vec<f64>,
    /// A, in units of the prior deviations; a column of zeros where the prior is no number.
    rows: Mat<f64>,
    /// Right singular vectors of A, a basis of all parameters.
    directions: Mat<f64>,
    /// Squares of the singular values, one for each direction.
    squares: Vec<f64>,
}

impl Information {
    /// Of rows with noise of unit variance, `rows` × parameters, and each parameter's deviation before
    /// anything was measured. Where that is infinite nothing is ever told: there is nothing to be narrower
    /// than.
    ///
    /// # Errors
    /// The sizes differ, or the singular values do not converge.
    pub fn new(
        prior: &[f64],
        rows: MatRef<'_, f64>,
        settings: InformationSettings,
    ) -> Result<Self, RegressorError> {
        check_size("prior deviations", prior.len(), rows.ncols())?;
        let scaled = scaled(prior, rows);
        Self::of_scaled(prior.to_vec(), scaled, settings)
    }

    /// The same with more rows.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn with_rows(&self, more: MatRef<'_, f64>) -> Result<Self, RegressorError> {
        check_size("parameters of the rows", more.ncols(), self.prior.len())?;
        let (own, more) = (&self.rows, scaled(&self.prior, more));
        let first = own.nrows();
        let all = Mat::from_fn(first + more.nrows(), own.ncols(), |row, column| {
            if row < first { own[(row, column)] } else { more[(row - first, column)] }
        });
        Self::of_scaled(self.prior.clone(), all, self.settings)
    }

    fn of_scaled(
        prior: Vec<f64>,
        rows: Mat<f64>,
        settings: InformationSettings,
    ) -> Result<Self, RegressorError> {
        let count = prior.len();
        // As many rows as columns at least, so that the vectors are a basis; of more rows only R counts.
        let square = match rows.nrows() {
            0 => Mat::zeros(count, count),
            _ => {
                let qr = rows.qr();
                let r = qr.thin_R();
                Mat::from_fn(count, count, |row, column| if row < r.nrows() { r[(row, column)] } else { 0.0 })
            }
        };
        let svd = square.svd().map_err(|_| RegressorError::NoConvergence)?;
        let values = svd.S().column_vector();
        let squares = (0..count).map(|index| values[index] * values[index]).collect();
        Ok(Information { settings, prior, directions: svd.V().to_owned(), rows, squares })
    }

    /// What was asked for.
    pub fn settings(&self) -> InformationSettings {
        self.settings
    }

    /// Number of directions that are told.
    pub fn directions_told(&self) -> usize {
        self.squares.iter().filter(|square| self.is_narrower(1.0 / (1.0 + **square))).count()
    }

    /// Deviations of a sum before the rows and after.
    pub fn deviations(&self, sum: &[(usize, f64)]) -> [f64; 2] {
        let unknown = |&(parameter, factor): &(usize, f64)| {
            factor != 0.0 && !self.prior.get(parameter).is_some_and(|prior| prior.is_finite())
        };
        if sum.iter().any(unknown) {
            return [f64::INFINITY; 2];
        }
        let before: f64 =
            sum.iter().map(|(parameter, factor)| (factor * self.prior[*parameter]).powi(2)).sum();
        let along = |direction: usize| -> f64 {
            let part = |(parameter, factor): &(usize, f64)| {
                factor * self.prior[*parameter] * self.directions[(*parameter, direction)]
            };
            sum.iter().map(part).sum()
        };
        let after: f64 = self
            .squares
            .iter()
            .enumerate()
            .map(|(direction, square)| along(direction).powi(2) / (1.0 + square))
            .sum();
        [before.sqrt(), after.sqrt()]
    }

    /// Whether a sum is told.
    pub fn is_told(&self, sum: &[(usize, f64)]) -> bool {
        self.share(sum).is_some_and(|share| self.is_narrower(share * share))
    }

    /// Parameters that are told by themselves, ascending.
    pub fn alone(&self) -> Vec<usize> {
        (0..self.prior.len()).filter(|&parameter| self.is_told(&[(parameter, 1.0)])).collect()
    }

    /// The sums that are told of parameters that are not among those `known` by themselves: as many as there
    /// are directions beyond these, each with a leading parameter whose factor is one. Those that come first
    /// in `preference` lead where they can.
    ///
    /// `natural` are rows over all parameters whose combinations are tried first: what motion can tell apart
    /// at all. What is told beyond these comes from the directions that are told. Terms that a sum is told
    /// without are left out, so each sum is as short as it can be.
    pub fn sums(&self, known: &[usize], preference: &[usize], natural: MatRef<'_, f64>) -> Vec<Sum> {
        let is_other = |parameter: &usize| !known.contains(parameter) && self.prior[*parameter].is_finite();
        let others: Vec<usize> = preference.iter().copied().filter(is_other).collect();
        let told: Vec<usize> =
            (0..self.squares.len()).filter(|&k| self.is_narrower(1.0 / (1.0 + self.squares[k]))).collect();
        if told.is_empty() || others.is_empty() {
            return Vec::new();
        }
        let told = Mat::from_fn(told.len(), others.len(), |row, at| self.directions[(others[at], told[row])]);
        let Some(told) = orthonormal(&told, OUTSIDE) else { return Vec::new() };
        let natural = Mat::from_fn(natural.nrows(), others.len(), |row, at| {
            natural[(row, others[at])] * self.prior[others[at]]
        });
        let mut sums =
            orthonormal(&natural, RANK).map_or_else(Vec::new, |basis| self.echelon(&basis, &others));
        // What is told beyond these.
        let vector = |sum: &Sum, at: usize| -> f64 {
            let own = sum.iter().filter(|(parameter, _)| *parameter == others[at]);
            own.map(|(parameter, factor)| factor * self.prior[*parameter]).sum()
        };
        let found = Mat::from_fn(sums.len(), others.len(), |row, at| vector(&sums[row], at));
        let rest = match orthonormal(&found, RANK) {
            Some(found) => &told - &told * found.transpose() * &found,
            None => told,
        };
        sums.extend(orthonormal(&rest, OUTSIDE).map_or_else(Vec::new, |basis| self.echelon(&basis, &others)));
        sums
    }

    /// The sums that are told among the rows of a basis, each row solved for a parameter that leads it.
    fn echelon(&self, basis: &Mat<f64>, others: &[usize]) -> Vec<Sum> {
        let leading = leading(basis);
        let square = Mat::from_fn(leading.len(), leading.len(), |row, k| basis[(row, leading[k])]);
        let solved = square.full_piv_lu().solve(basis);
        let sum = |(row, &lead): (usize, &usize)| -> Option<Sum> {
            let own = self.prior[others[lead]];
            let term = |at: usize| (others[at], solved[(row, at)] * own / self.prior[others[at]]);
            let mut sum: Sum = vec![(others[lead], 1.0)];
            sum.extend((0..others.len()).filter(|at| !leading.contains(at)).map(term));
            let short = self.shortened(sum);
            (self.is_told(&short) && short.len() > 1).then_some(short)
        };
        leading.iter().enumerate().filter_map(sum).collect()
    }

    /// What more rows would tell of the directions that are not told, in nats: half the logarithm of how much
    /// smaller the volume of what is possible becomes, told directions taken as known.
    ///
    /// # Errors
    /// The rows are of other parameters.
    pub fn nats_of_untold(&self, more: MatRef<'_, f64>) -> Result<f64, RegressorError> {
        check_size("parameters of the rows", more.ncols(), self.prior.len())?;
        let scaled = scaled(&self.prior, more);
        let untold: Vec<usize> = (0..self.squares.len())
            .filter(|&direction| !self.is_narrower(1.0 / (1.0 + self.squares[direction])))
            .collect();
        let basis = Mat::from_fn(self.prior.len(), untold.len(), |parameter, k| {
            self.directions[(parameter, untold[k])] / (1.0 + self.squares[untold[k]]).sqrt()
        });
        let felt = scaled * basis;
        let values = felt.singular_values().map_err(|_| RegressorError::NoConvergence)?;
        Ok(values.iter().map(|value| 0.5 * (value * value).ln_1p()).sum())
    }

    /// The sum without the terms that do not matter, smallest first.
    fn shortened(&self, mut sum: Sum) -> Sum {
        let Some(whole) = self.share(&sum) else { return sum };
        let most = (whole * (1.0 + NEGLIGIBLE)).max(NEGLIGIBLE / self.settings.narrower_by);
        sum[1..].sort_by(|a, b| {
            let size = |(parameter, factor): &(usize, f64)| (factor * self.prior[*parameter]).abs();
            size(b).total_cmp(&size(a))
        });
        while sum.len() > 1 {
            let last = sum.pop();
            if self.share(&sum).is_none_or(|share| share > most) {
                sum.extend(last);
                break;
            }
        }
        sum
    }

    /// Posterior over prior deviation of a sum; none where the prior is no number.
    fn share(&self, sum: &[(usize, f64)]) -> Option<f64> {
        let [before, after] = self.deviations(sum);
        (before.is_finite() && before > 0.0).then(|| after / before)
    }

    /// Whether a variance over that before is as small as asked.
    fn is_narrower(&self, share: f64) -> bool {
        share.sqrt() * self.settings.narrower_by <= 1.0
    }
}

fn scaled(prior: &[f64], rows: MatRef<'_, f64>) -> Mat<f64> {
    let scale = |column: usize| if prior[column].is_finite() { prior[column] } else { 0.0 };
    Mat::from_fn(rows.nrows(), rows.ncols(), |row, column| rows[(row, column)] * scale(column))
}

/// An orthonormal basis of what the rows span, directions left out that are shorter than `least`: of rows of
/// length one that is a share, of others one of the longest. None if nothing is left.
fn orthonormal(rows: &Mat<f64>, least: f64) -> Option<Mat<f64>> {
    let svd = rows.thin_svd().ok()?;
    let values = svd.S().column_vector();
    let longest = values.iter().copied().fold(1.0, f64::max);
    let kept: Vec<usize> = (0..values.nrows()).filter(|&k| values[k] > least * longest).collect();
    let basis = || Mat::from_fn(kept.len(), rows.ncols(), |row, at| svd.V()[(at, kept[row])]);
    (!kept.is_empty()).then(basis)
}

/// As many columns as there are rows, independent of each other, earlier ones first.
fn leading(basis: &Mat<f64>) -> Vec<usize> {
    let size = basis.nrows();
    let mut chosen: Vec<usize> = Vec::with_capacity(size);
    let mut frame: Vec<Vec<f64>> = Vec::with_capacity(size);
    for least in INDEPENDENT {
        for column in 0..basis.ncols() {
            if chosen.len() == size {
                return chosen;
            }
            if chosen.contains(&column) {
                continue;
            }
            let mut rest: Vec<f64> = (0..size).map(|row| basis[(row, column)]).collect();
            for axis in &frame {
                let along: f64 = axis.iter().zip(&rest).map(|(a, b)| a * b).sum();
                rest.iter_mut().zip(axis).for_each(|(value, axis)| *value -= along * axis);
            }
            let norm = rest.iter().map(|value| value * value).sum::<f64>().sqrt();
            if norm > least {
                frame.push(rest.iter().map(|value| value / norm).collect());
                chosen.push(column);
            }
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn information(prior: &[f64], rows: &[&[f64]]) -> Information {
        let rows = Mat::from_fn(rows.len(), prior.len(), |row, column| rows[row][column]);
        Information::new(prior, rows.as_ref(), InformationSettings::default()).unwrap()
    }

    fn sums_of(information: &Information, preference: &[usize]) -> Vec<Sum> {
        let nothing = Mat::zeros(0, preference.len());
        information.sums(&information.alone(), preference, nothing.as_ref())
    }

    /// What is told of natural sums is written as these; the rest as it comes.
    #[test]
    fn natural_sums_come_first() {
        let rows: &[&[f64]] = &[&[1e3, 1e3, 0.0, 0.0], &[0.0, 1.0, 1e3, 500.0], &[0.3, 0.0, 1e3, 500.0]];
        let found = information(&[1.0; 4], rows);
        let natural = Mat::from_fn(1, 4, |_, column| [0.0, 0.0, 2.0, 1.0][column]);
        let sums = found.sums(&[], &[0, 1, 2, 3], natural.as_ref());
        assert_eq!(sums.len(), 2, "{sums:?}");
        assert!(sums[0][0] == (2, 1.0) && sums[0][1].0 == 3 && (sums[0][1].1 - 0.5).abs() < 1e-12);
        let parameters: Vec<usize> = sums[1].iter().map(|term| term.0).collect();
        assert_eq!(parameters, [0, 1]);
    }

    /// Of one parameter the posterior is known: 1/σ² = 1/σ₀² + a².
    #[test]
    fn one_parameter_is_told_where_its_posterior_is_narrow() {
        for (row, told) in [(4.9, false), (5.1, true)] {
            let found = information(&[2.0], &[&[row]]);
            let [before, after] = found.deviations(&[(0, 1.0)]);
            assert_eq!(before, 2.0);
            let expected = 1.0 / (0.25 + row * row).sqrt();
            assert!((after - expected).abs() < 1e-14);
            assert_eq!(found.alone().len(), usize::from(told), "{row}");
            assert!(sums_of(&found, &[0]).is_empty());
        }
    }

    /// a + 3b is measured, c is not, and d has no prior.
    #[test]
    fn what_is_measured_together_is_told_as_a_sum() {
        let found = information(&[1.0, 0.5, 1.0, f64::INFINITY], &[&[1e4, 3e4, 0.0, 7.0]]);
        assert!(found.alone().is_empty());
        assert_eq!(found.directions_told(), 1);
        let sums = sums_of(&found, &[1, 0, 2, 3]);
        assert_eq!(sums.len(), 1);
        assert_eq!(sums[0][0], (1, 1.0), "the preferred one leads: {sums:?}");
        assert_eq!(sums[0].len(), 2);
        assert!((sums[0][1].1 - 1.0 / 3.0).abs() < 1e-9 && sums[0][1].0 == 0);
        assert!(!found.is_told(&[(2, 1.0)]) && !found.is_told(&[(3, 1.0)]));
        // Measured as well, b is told, and with it a.
        let more = Mat::from_fn(1, 4, |_, column| if column == 1 { 1e3 } else { 0.0 });
        assert_eq!(found.with_rows(more.as_ref()).unwrap().alone(), [0, 1]);
        assert!(found.nats_of_untold(more.as_ref()).unwrap() > 5.0);
        // What tells the sum once more tells nothing.
        let again = Mat::from_fn(1, 4, |_, column| [1.0, 3.0, 0.0, 0.0][column]);
        assert!(found.nats_of_untold(again.as_ref()).unwrap() < 1e-6);
    }

    #[test]
    fn a_term_that_does_not_matter_is_left_out_of_a_sum() {
        let found = information(&[1.0, 1.0, 1.0], &[&[1e3, 1e3, 0.5]]);
        let sums = sums_of(&found, &[0, 1, 2]);
        assert_eq!(sums[0].iter().map(|(parameter, _)| *parameter).collect::<Vec<_>>(), [0, 1]);
        let exact = information(&[1.0, 1.0, 1.0], &[&[1e3, 1e3, 200.0]]);
        assert_eq!(sums_of(&exact, &[0, 1, 2])[0].len(), 3);
    }

    #[test]
    fn without_rows_nothing_is_told() {
        let found = information(&[1.0, 2.0], &[]);
        assert_eq!((found.directions_told(), found.alone(), sums_of(&found, &[0, 1])), (0, vec![], vec![]));
        assert_eq!(found.deviations(&[(0, 3.0), (1, 2.0)]), [5.0, 5.0]);
    }
}
