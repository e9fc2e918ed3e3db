//! Equation (18): which parameters are well estimated.

use super::arm::{Arm, Footing};
use super::report::Results;

/// Relative standard deviation up to which a parameter is well estimated \[%\].
const WELL_PERCENT: f64 = 10.0;
/// Mean below which it is small, and well estimated in any case.
const SMALL: f64 = 0.02;

/// One parameter after one iteration, over all seeds.
#[derive(Clone, Copy, Debug)]
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

    /// d_w of (18) \[%\].
    pub fn percent(&self) -> f64 {
        100.0 * self.deviation / self.mean.abs()
    }

    /// Whether it is well estimated by (18).
    pub fn well(&self) -> bool {
        self.mean.abs() < SMALL || self.percent() <= WELL_PERCENT
    }

    /// The same with the error's root mean square for its standard deviation: an estimate that is always wrong by the same is not good.
    pub fn well_with_bias(&self) -> bool {
        self.mean.abs() < SMALL || 100.0 * self.rms_error / self.mean.abs() <= WELL_PERCENT
    }
}

/// All parameters of an arm after an iteration (0: the initial models).
pub fn of_arm(results: &Results, footing: Footing, arm: Arm, iteration: usize) -> Vec<Reliability> {
    let of_parameter = |(index, facts): (usize, &super::setup::ParameterFacts)| {
        let runs = results.of(footing, arm).filter_map(|run| run.scores.get(iteration));
        let estimates: Vec<f64> = runs.map(|score| score.parameters[index]).collect();
        Reliability::of(&estimates, facts.value)
    };
    results.settings.parameters.iter().enumerate().map(of_parameter).collect()
}

#[cfg(test)]
mod tests {
    use super::Reliability;

    #[test]
    fn small_or_sharp_is_well_estimated() {
        for (estimates, truth, well, with_bias) in [
            (&[1.0, 1.05, 0.95][..], 1.0, true, true),
            (&[1.0, 2.0, 0.5], 1.0, false, false),
            // Sharp, but wrong.
            (&[1.5, 1.51, 1.49], 1.0, true, false),
            (&[0.01, -0.02, 0.03], 0.005, true, true),
        ] {
            let reliability = Reliability::of(estimates, truth);
            assert_eq!(
                (reliability.well(), reliability.well_with_bias()),
                (well, with_bias),
                "{estimates:?}"
            );
        }
    }
}
