//! From what was measured to parameters: equation (4), and estimators that know where the noise comes from.

mod evidence;
mod foresight;
mod least_squares;
mod likelihood;
mod response;
mod score;
mod sensitivity;
mod stored;

pub use evidence::{Evidence, Instant, RowsAt};
pub use least_squares::{LeastSquares, WeightedLeastSquares};
pub use likelihood::MotionLikelihood;
pub use score::Gain;

use crate::{CurriculumError, RobotModel};
use phiw_identification::Design;

/// Estimated parameters.
#[derive(Clone, Debug, PartialEq)]
pub struct Estimate {
    /// w: base parameters, then those of the effects.
    pub parameters: Vec<f64>,
    /// Standard deviation of each, as the estimator sees it; NaN where it does not know.
    pub standard_deviations: Vec<f64>,
}

/// Estimates parameters from all that has been measured.
pub trait Estimator: Send + Sync {
    /// Its name, for reports: `least_squares`.
    fn name(&self) -> &'static str;

    /// The parameters of `design`.
    ///
    /// `present` is what was believed before, with the parameters of the design: what the evidence does not determine stays as it is there.
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

    /// −log L of parameters, but for a constant that is the same for all models of the same logs; none from an estimator that knows no
    /// likelihood. The smaller, the better the model: effects that were found are confirmed by it.
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
