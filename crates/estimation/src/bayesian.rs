//! Least squares with a prior: what logs of a real robot and its URDF say together.

use super::least_squares::Determined;
use super::prior::with_prior;
use super::{Estimate, Estimator, Evidence, ParameterPrior};
use crate::{EstimationError, RobotModel};
use faer::Mat;
use phiw_dynamics::check::check_size;
use phiw_identification::Design;
use phiw_identification::fitting::Fit;
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// How uncertain the rows of logs are.
#[derive(Clone, Debug, PartialEq)]
pub struct LogNoise {
    /// Standard deviation of each torque's residual \[N·m, N\], one for each group of the evidence.
    pub std: Vec<f64>,
    /// How many times wider standard deviations are than those of independent rows: samples of a log are
    /// correlated. At least 1.
    pub correlation: f64,
}

impl LogNoise {
    /// Independent rows of unit variance in `groups` groups: of rows that have been weighted, or where there
    /// are none.
    pub fn unit(groups: usize) -> Self {
        LogNoise { std: vec![1.0; groups], correlation: 1.0 }
    }

    /// The noise that a fit has found. Its standard deviations come from leaving out folds, so that
    /// correlated samples count as what they are.
    pub fn of_fit(fit: &Fit) -> Self {
        let correlation = correlation(&fit.factor, &fit.determined(), &fit.standard_deviations);
        LogNoise { std: fit.residual_std.clone(), correlation }
    }

    /// The noise behind a factor of weighted rows over the `parameters`, of all of which the standard
    /// deviations are known.
    pub fn of_weighted_rows(factor: &Factor, parameters: &[usize], standard_deviations: &[f64]) -> Self {
        LogNoise { std: vec![1.0], correlation: correlation(factor, parameters, standard_deviations) }
    }
}

/// The median over the parameters of their standard deviation over that of independent rows; 1 where none is
/// known.
fn correlation(factor: &Factor, parameters: &[usize], deviations: &[f64]) -> f64 {
    let Ok(independent) = factor.standard_deviations(1.0) else { return 1.0 };
    let ratios = parameters
        .iter()
        .zip(independent)
        .filter_map(|(&parameter, own)| Some(deviations.get(parameter)? / own));
    let mut ratios: Vec<f64> = ratios.filter(|ratio| ratio.is_finite()).collect();
    ratios.sort_by(f64::total_cmp);
    ratios.get(ratios.len() / 2).copied().unwrap_or(1.0).max(1.0)
}

/// The mean and the covariance of the parameters given logs with Gaussian noise and a Gaussian prior.
///
/// With the URDF as the prior, each standard parameter within a share of its body's magnitude: without it,
/// one short log would leave the parameters of an arm that rests to the noise. For logs of a real robot,
/// whose noise is in the logged torques; where noise moves the robot, [`super::MotionLikelihood`] is right.
#[derive(Clone, Debug, PartialEq)]
pub struct BayesianLeastSquares {
    /// How uncertain the measured rows are.
    pub noise: LogNoise,
    /// What was believed before.
    pub prior: ParameterPrior,
}

impl Estimator for BayesianLeastSquares {
    fn name(&self) -> &'static str {
        "bayesian_least_squares"
    }

    /// Parameters of which neither the logs nor the prior say anything stay as they are in `present`; their
    /// deviations and covariances are NaN.
    fn estimate(
        &self,
        design: &Design,
        evidence: &Evidence,
        _: &RobotModel,
        present: &[f64],
    ) -> Result<Estimate, EstimationError> {
        let count = design.parameter_count();
        let groups = evidence.factor().groups().len();
        check_size("standard deviations of the logs' noise", self.noise.std.len(), groups)?;
        check_size("present parameters", present.len(), count)?;
        let mut weights: Vec<f64> =
            self.noise.std.iter().map(|std| 1.0 / (std * self.noise.correlation)).collect();
        weights.push(1.0);
        let rows = with_prior(evidence.factor(), self.prior.group(design)?)?;
        let known = Group { parameters: (0..count).collect(), factor: rows.combine(&weights)? };
        let Determined { kept, factor } = Determined::of(&GroupedFactor::new(count, vec![known])?, present)?;
        let factor = factor.combine(&[1.0])?;
        let found = factor.solve()?.parameters;
        let own = factor.unit_covariance()?;
        let mut estimate = Estimate {
            parameters: present.to_vec(),
            standard_deviations: vec![f64::NAN; count],
            covariance: None,
            noise: None,
        };
        let mut covariance = Mat::from_fn(count, count, |_, _| f64::NAN);
        for (row, &parameter) in kept.iter().enumerate() {
            estimate.parameters[parameter] = found[row];
            estimate.standard_deviations[parameter] = own[(row, row)].sqrt();
            for (column, &other) in kept.iter().enumerate() {
                covariance[(parameter, other)] = own[(row, column)];
            }
        }
        estimate.covariance = Some(covariance);
        Ok(estimate)
    }
}

impl Evidence {
    /// Rows that somebody else has weighted and taken together, over these `parameters` of `count`: what a
    /// `model.json` keeps.
    ///
    /// # Errors
    /// The factor has not one column for each of the parameters.
    pub fn of_weighted_rows(
        count: usize,
        parameters: Vec<usize>,
        factor: Factor,
    ) -> Result<Self, RegressorError> {
        Ok(Self::of_factor(GroupedFactor::new(count, vec![Group { parameters, factor }])?, None))
    }
}
