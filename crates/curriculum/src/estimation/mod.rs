//! From what was measured to parameters: equation (4), and estimators that know where the noise comes from.

mod bayesian;
mod evidence;
mod foresight;
mod least_squares;
mod likelihood;
mod prior;
mod response;
mod score;
mod sensitivity;
mod settings;
mod stored;

pub use bayesian::{BayesianLeastSquares, LogNoise};
pub(crate) use evidence::grouped_factor;
pub use evidence::{Evidence, EvidenceSettings, Instant, RowsAt};
pub use least_squares::{LeastSquares, WeightedLeastSquares};
pub use likelihood::MotionLikelihood;
pub use prior::Prior;
pub use score::Gain;
pub use settings::{NewtonSettings, ScoreSettings};

use crate::triangle::Triangle;
use crate::{CurriculumError, RobotModel};
use faer::Mat;
use phiw_identification::Design;

/// Estimated parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// w: base parameters, then those of the effects.
    pub parameters: Vec<f64>,
    /// Standard deviation of each, as the estimator sees it; NaN where it does not know.
    pub standard_deviations: Vec<f64>,
    /// Their covariance; none from an estimator that does not know it.
    pub covariance: Option<Mat<f64>>,
}

impl Estimate {
    /// √(tr(R·C·Rᵀ)/rows): RMS of the standard deviation of Φ·w over the `rows` rows that the triangle R
    /// stands for. Directions of w that these rows do not feel do not count, however little is known of them.
    pub(crate) fn uncertainty_along(&self, triangle: &Triangle, rows: usize) -> Option<f64> {
        let covariance =
            self.covariance.as_ref().filter(|covariance| covariance.nrows() == triangle.size())?;
        let size = triangle.size();
        let r =
            Mat::from_fn(size, size, |row, column| triangle.column(column).get(row).copied().unwrap_or(0.0));
        let spread = &r * covariance;
        let trace: f64 =
            (0..size).map(|row| (row..size).map(|k| spread[(row, k)] * r[(row, k)]).sum::<f64>()).sum();
        Some((trace.max(0.0) / rows.max(1) as f64).sqrt()).filter(|uncertainty| uncertainty.is_finite())
    }
}

/// Estimates parameters from all that has been measured.
pub trait Estimator: Send + Sync {
    /// Its name, for reports: `least_squares`.
    fn name(&self) -> &'static str;

    /// The parameters of `design`.
    ///
    /// `present` is what was believed before, with the parameters of the design: what the evidence does not
    /// determine stays as it is there.
    ///
    /// # Errors
    /// The evidence is not of this design, or can not be solved.
    fn estimate(
        &self,
        design: &Design,
        evidence: &Evidence,
        present: &RobotModel,
        present_parameters: &[f64],
    ) -> Result<Estimate, CurriculumError>;

    /// Standard deviation of each torque's noise that it counts on \[N·m, N\]; none from an estimator that is
    /// not told.
    fn torque_noise(&self) -> Option<&[f64]> {
        None
    }

    /// −log L of parameters, but for a constant that is the same for all models of the same logs; none from
    /// an estimator that knows no likelihood. The smaller, the better the model: effects that were found are
    /// confirmed by it.
    ///
    /// # Errors
    /// The evidence is not of this design.
    fn misfit(
        &self,
        _design: &Design,
        _evidence: &Evidence,
        _parameters: &[f64],
    ) -> Result<Option<f64>, CurriculumError> {
        Ok(None)
    }
}
