//! How near estimates are to a truth that is known, as it is of a simulated robot: the three measures of the
//! paper's section 5.
//!
//! They need the true parameters, or motion without noise, which no robot gives. For a real one
//! [`torque_error`](crate::fitting::torque_error) on folds held out is the measure instead.

use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;

/// Root mean square error of parameters, equation (17): √(‖ŵ − w‖²/D), over the D parameters of `truth`.
/// Those that an estimate has beyond them do not count.
///
/// Each parameter counts in its own SI unit \[kg, kg·m, kg·m², …\], as in the paper. No parameters have no
/// error: 0.
pub fn parameter_rmse(estimate: &[f64], truth: &[f64]) -> f64 {
    let sum: f64 = estimate.iter().zip(truth).map(|(estimate, truth)| (estimate - truth).powi(2)).sum();
    (sum / truth.len().max(1) as f64).sqrt()
}

/// Root mean square error of the predicted torques, equation (19): √(‖f − Φŵ‖²/T) \[N·m, N\], all torques of
/// a sample taken together.
///
/// `factor` is R of \[Φ f\] of the motion that is judged, and `samples` the number T of its samples in time.
///
/// # Errors
/// `parameters` has the wrong length.
pub fn torque_rmse(factor: &Factor, parameters: &[f64], samples: f64) -> Result<f64, RegressorError> {
    Ok((factor.residual_sum_of_squares(parameters)? / samples).sqrt())
}

/// When a parameter is well estimated, equation (18).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReliabilityCriterion {
    /// Relative standard deviation up to which it is \[%\]. The paper's is 10 %.
    pub relative_deviation_percent: f64,
    /// Mean, in the parameter's SI unit, below which it is too small to matter and counts as well estimated.
    /// The paper's is 0.02.
    pub small: f64,
}

impl Default for ReliabilityCriterion {
    fn default() -> Self {
        ReliabilityCriterion { relative_deviation_percent: 10.0, small: 0.02 }
    }
}

/// One parameter estimated several times, with other noise each time. All in the parameter's SI unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reliability {
    /// Mean of the estimates.
    pub mean: f64,
    /// Standard deviation of their error.
    pub deviation: f64,
    /// Root mean square of their error, bias included.
    pub rms_error: f64,
}

impl Reliability {
    /// Of estimates of one true value.
    pub fn of(estimates: &[f64], truth: f64) -> Self {
        let count = estimates.len().max(1) as f64;
        let mean = estimates.iter().sum::<f64>() / count;
        let square = |about: f64| estimates.iter().map(|estimate| (estimate - about).powi(2)).sum::<f64>();
        let freedom = (count - 1.0).max(1.0);
        Reliability {
            mean,
            deviation: (square(mean) / freedom).sqrt(),
            rms_error: (square(truth) / count).sqrt(),
        }
    }

    /// Relative standard deviation d_w of (18) \[%\].
    pub fn percent(&self) -> f64 {
        100.0 * self.deviation / self.mean.abs()
    }

    /// Whether it is well estimated by (18).
    pub fn well(&self, criterion: &ReliabilityCriterion) -> bool {
        self.mean.abs() < criterion.small || self.percent() <= criterion.relative_deviation_percent
    }

    /// The same with the error's root mean square for its standard deviation: an estimate that is always
    /// wrong by the same is not good.
    pub fn well_with_bias(&self, criterion: &ReliabilityCriterion) -> bool {
        self.mean.abs() < criterion.small
            || 100.0 * self.rms_error / self.mean.abs() <= criterion.relative_deviation_percent
    }
}

#[cfg(test)]
mod tests {
    use super::{Reliability, ReliabilityCriterion, parameter_rmse, torque_rmse};
    use phiw_regressor::factor::Factor;

    #[test]
    fn small_or_sharp_is_well_estimated() {
        let criterion = ReliabilityCriterion::default();
        for (estimates, truth, well, with_bias) in [
            (&[1.0, 1.05, 0.95][..], 1.0, true, true),
            (&[1.0, 2.0, 0.5], 1.0, false, false),
            // A small standard deviation, but a large error.
            (&[1.5, 1.51, 1.49], 1.0, true, false),
            (&[0.01, -0.02, 0.03], 0.005, true, true),
        ] {
            let reliability = Reliability::of(estimates, truth);
            assert_eq!(
                (reliability.well(&criterion), reliability.well_with_bias(&criterion)),
                (well, with_bias),
                "{estimates:?}"
            );
        }
    }

    #[test]
    fn parameters_beyond_the_true_ones_do_not_count() {
        for (estimate, truth, expected) in [
            (&[1.0, 2.0][..], &[1.0, 2.0][..], 0.0),
            (&[4.0, -4.0], &[1.0, 0.0], 12.5_f64.sqrt()),
            (&[4.0, -4.0, 100.0], &[1.0, 0.0], 12.5_f64.sqrt()),
            (&[3.0], &[], 0.0),
        ] {
            let error = parameter_rmse(estimate, truth);
            assert!((error - expected).abs() < 1e-12, "{estimate:?} of {truth:?}: {error}");
        }
    }

    #[test]
    fn the_torque_error_is_by_sample_and_not_by_row() -> Result<(), phiw_regressor::RegressorError> {
        // Rows of [Φ f] of two torques at two samples: with w = (1, 2) two of them are wrong, by 1 and by −3.
        let rows = [1.0, 0.0, 2.0, 0.0, 1.0, 2.0, 1.0, 1.0, 0.0, 2.0, 1.0, 4.0];
        let factor = Factor::of_rows(3, &rows)?;
        assert!((torque_rmse(&factor, &[1.0, 2.0], 2.0)? - 5.0_f64.sqrt()).abs() < 1e-12);
        assert!(torque_rmse(&factor, &[1.0], 2.0).is_err());
        Ok(())
    }
}
