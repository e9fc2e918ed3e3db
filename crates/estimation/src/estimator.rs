//! What an estimator is asked, and what it answers.

use crate::{EstimationError, Evidence, RobotModel, TorqueMisfit, TorqueNoise};
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
    /// The noise of each torque that moved the robot; none from an estimator that does not know it.
    pub noise: Option<Vec<TorqueNoise>>,
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
    ) -> Result<Estimate, EstimationError>;

    /// Whether it asks for rows with those before them ([`crate::EvidenceSettings::in_order`]).
    fn in_order(&self) -> bool {
        false
    }

    /// Standard deviation of each torque's noise that it counts on \[N·m, N\]; none from an estimator that
    /// assumes none.
    fn torque_noise(&self) -> Option<&[f64]> {
        None
    }

    /// Whether the estimator's story of the noise holds at an estimate of these logs, torque by torque; none
    /// from an estimator that has no test.
    ///
    /// # Errors
    /// The evidence is not of this design.
    fn misfit(
        &self,
        _design: &Design,
        _evidence: &Evidence,
        _estimate: &Estimate,
    ) -> Result<Option<Vec<TorqueMisfit>>, EstimationError> {
        Ok(None)
    }

    /// −log L of parameters, but for a constant that is the same for all models of the same logs; none from
    /// an estimator that knows no likelihood. The smaller, the better the model: effects that were found are
    /// confirmed by it.
    ///
    /// # Errors
    /// The evidence is not of this design.
    fn negative_log_likelihood(
        &self,
        _design: &Design,
        _evidence: &Evidence,
        _parameters: &[f64],
    ) -> Result<Option<f64>, EstimationError> {
        Ok(None)
    }
}
