//! The covariance of a fit's parameters.

use crate::prediction_errors::BAND_95;
use phiw_dynamics::DimensionError;
use phiw_dynamics::check::check_size;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Where a covariance comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CovarianceSource {
    /// The spread of the solutions that leave out one fold of the training motion after the other: correlated
    /// samples count as what they are.
    LeftOutFolds,
    /// σ²(ΦᵀΦ)⁻¹, each torque weighted by its residual; where there are too few folds. Correlated samples
    /// count as independent ones, so it is too small.
    LeastSquares,
}

/// The covariance of the parameters that the logs determine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Covariance {
    /// Where it comes from.
    pub source: CovarianceSource,
    /// The parameters that its rows stand for, ascending: base parameters first, then those of the effects.
    pub parameters: Vec<usize>,
    /// Folds that were left out one after the other; none in a covariance of another source, or of an earlier
    /// phiw.
    #[serde(default)]
    pub folds: usize,
    /// Its lower triangle, row by row, diagonal included; in the parameters' units.
    pub entries: Vec<f64>,
}

/// Share of a parameter's variance below which what is left of it is rounding.
const LEFT: f64 = 1e-12;

impl Covariance {
    /// (n−1)/n·Σ d·dᵀ, where the n `deviations` are those of the solutions that leave out a fold each from
    /// their mean, with a number for every one of `parameters`; and s·sᵀ of a shift of them all.
    pub(crate) fn of_left_out_folds(
        parameters: &[usize],
        deviations: &[Vec<f64>],
        shift: Option<&[f64]>,
    ) -> Self {
        let count = deviations.len() as f64;
        let entry = |row: usize, column: usize| {
            let sum: f64 = deviations.iter().map(|deviation| deviation[row] * deviation[column]).sum();
            sum * (count - 1.0) / count.max(1.0) + shift.map_or(0.0, |shift| shift[row] * shift[column])
        };
        let covariance = Self::of_entries(CovarianceSource::LeftOutFolds, parameters, entry);
        Covariance { folds: deviations.len(), ..covariance }
    }

    /// Standard deviation of the parameter of a row.
    pub(crate) fn standard_deviation(&self, row: usize) -> f64 {
        self.entry(row, row).max(0.0).sqrt()
    }

    /// Standard deviations to each side that a 95 % interval has: Student's quantile for the folds that the
    /// covariance is of.
    pub fn quantile_95(&self) -> f64 {
        match self.folds {
            0..2 => BAND_95,
            folds => student_quantile_95((folds - 1) as f64),
        }
    }

    /// From its entries by row and column.
    pub(crate) fn of_entries(
        source: CovarianceSource,
        parameters: &[usize],
        entry: impl Fn(usize, usize) -> f64,
    ) -> Self {
        let triangle = (0..parameters.len()).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let entries = triangle.map(|(row, column)| entry(row, column)).collect();
        Covariance { source, parameters: parameters.to_vec(), folds: 0, entries }
    }

    /// The entry of two of its rows.
    fn entry(&self, one: usize, other: usize) -> f64 {
        let (row, column) = (one.max(other), one.min(other));
        self.entries[row * (row + 1) / 2 + column]
    }

    /// The fewest vectors d with Σ d·dᵀ equal to this covariance, each over all `count` parameters of a
    /// design: the variance of a sum xᵀw is Σ (xᵀd)². By Cholesky's decomposition with pivoting, which stops
    /// where nothing is left but rounding.
    ///
    /// # Errors
    /// The triangle has not its rows' size, or a row stands for no parameter.
    pub fn deviations(&self, count: usize) -> Result<Vec<Vec<f64>>, DimensionError> {
        let size = self.parameters.len();
        check_size("covariance", self.entries.len(), size * (size + 1) / 2)?;
        let last = self.parameters.iter().copied().max().map_or(0, |last| last + 1);
        check_size("parameters of the covariance", last.max(count), count)?;
        // In units of each parameter's own deviation, so that small parameters are not taken for rounding.
        let scale: Vec<f64> = (0..size).map(|row| self.entry(row, row).max(0.0).sqrt()).collect();
        let scaled = |one: usize, other: usize| match scale[one] * scale[other] {
            0.0 => 0.0,
            product => self.entry(one, other) / product,
        };
        let mut left: Vec<f64> = (0..size).map(|row| scaled(row, row)).collect();
        let mut vectors: Vec<Vec<f64>> = Vec::new();
        while vectors.len() < size {
            let Some(pivot) = (0..size).max_by(|&one, &other| left[one].total_cmp(&left[other])) else {
                break;
            };
            if left[pivot].is_nan() || left[pivot] <= LEFT {
                break;
            }
            let root = left[pivot].sqrt();
            let vector: Vec<f64> = (0..size)
                .map(|row| {
                    let told: f64 = vectors.iter().map(|vector| vector[row] * vector[pivot]).sum();
                    (scaled(row, pivot) - told) / root
                })
                .collect();
            left.iter_mut().zip(&vector).for_each(|(left, value)| *left -= value * value);
            left[pivot] = 0.0;
            vectors.push(vector);
        }
        let spread = |vector: Vec<f64>| {
            let mut all = vec![0.0; count];
            self.parameters.iter().zip(vector.iter().zip(&scale)).for_each(|(&parameter, (value, scale))| {
                all[parameter] = value * scale;
            });
            all
        };
        Ok(vectors.into_iter().map(spread).collect())
    }
}

/// The 97.5 % quantile of Student's distribution.
fn student_quantile_95(freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(BAND_95, |student| student.inverse_cdf(0.975))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tables of Student's distribution.
    #[test]
    fn few_folds_have_students_quantile() {
        let table = [
            (1.0, 12.706),
            (2.0, 4.303),
            (3.0, 3.182),
            (4.0, 2.776),
            (9.0, 2.262),
            (30.0, 2.042),
            (400.0, 1.966),
            (1e6, 1.960),
        ];
        for (freedom, expected) in table {
            let found = student_quantile_95(freedom);
            assert!((found - expected).abs() < 6e-4, "{freedom}: {found}");
        }
    }

    fn of_rank(parameters: &[usize], deviations: &[Vec<f64>]) -> Covariance {
        let entry = |row: usize, column: usize| deviations.iter().map(|d| d[row] * d[column]).sum();
        Covariance::of_entries(CovarianceSource::LeastSquares, parameters, entry)
    }

    #[test]
    fn deviations_give_back_a_covariance_of_any_rank() {
        let parameters = [1, 2, 4, 5, 7];
        for rank in 0..=5 {
            // The last parameter is a million times the others.
            let value = |k: usize, p: usize| (1.3 * k as f64 + 2.1 * p as f64 + 0.4).sin();
            let scale = |p: usize| if p == 4 { 1e6 } else { 1.0 };
            let given: Vec<Vec<f64>> = (0..rank)
                .map(|k| (0..5).map(|p| scale(p) * (value(k, p) + f64::from(k == p))).collect())
                .collect();
            let covariance = of_rank(&parameters, &given);
            let deviations = covariance.deviations(8).unwrap();
            assert_eq!(deviations.len(), rank);
            for (one, &at) in parameters.iter().enumerate() {
                for (other, &beside) in parameters.iter().enumerate() {
                    let sum: f64 = deviations.iter().map(|d| d[at] * d[beside]).sum();
                    let entry = covariance.entry(one, other);
                    assert!((sum - entry).abs() < 1e-9 * scale(one) * scale(other), "{sum} {entry}");
                }
            }
            assert!(deviations.iter().all(|deviation| deviation[0] == 0.0 && deviation[6] == 0.0));
        }
    }

    #[test]
    fn a_covariance_of_the_wrong_size_is_refused() {
        let good = of_rank(&[0, 3], &[vec![1.0, 2.0]]);
        assert!(good.deviations(4).is_ok());
        assert!(good.deviations(3).is_err());
        let cut = Covariance { entries: vec![1.0], ..good };
        assert!(cut.deviations(4).is_err());
    }
}
