//! What the likelihood that is told no noise decides.

use super::settings::NewtonSettings;

/// What [`crate::ConcentratedLikelihood`] decides.
#[derive(Clone, Debug, PartialEq)]
pub struct ConcentratedSettings {
    /// Weight of the prior: nats of −log L a unit of divergence. Default: 1.
    pub prior_weight: f64,
    /// How round the bodies are that are believed at first: least second moment about the centre of mass
    /// along any axis, over the mean of all axes. Default: 0.4.
    pub roundness: f64,
    /// Rounds at first in which the prior weighs more, each a step nearer to its own weight, and the noise
    /// counts as white: the path leads from what was believed to the estimate through possible bodies.
    /// Default: 6.
    pub tempered_rounds: usize,
    /// How many times more it weighs in one of these than in the next. Default: 4.
    pub tempering: f64,
    /// Rounds after these that take the torques' median correlation for all: under a bad belief the residual
    /// of a single torque is no noise yet, and may keep the estimate from ever leaving it. Default: 4.
    pub rounds_in_common: usize,
    /// Rounds after these at most, each torque with its own correlation. Default: 6.
    pub rounds: usize,
    /// Newton steps of a round at most, but of the last: what is found anew a moment later need not be
    /// found exactly. Default: 8.
    pub steps_a_round: usize,
    /// Change of a correlation from which on another round is worth it. Default: 0.005.
    pub settled: f64,
    /// Largest correlation of the noise. Default: 0.98: rows of a noise that is nearly a constant say nothing
    /// of weights.
    pub largest_correlation: f64,
    /// Least standard deviation of a torque's noise over the RMS of its command. Default: 3·10⁻³. No drive
    /// delivers its command better than to some thousandths, and without a floor a log without noise would
    /// leave no digits for the bodies.
    pub least_noise: f64,
    /// Times at most that the motion of encoders is found anew under the estimate, and the estimate after it
    /// (`smoothing.rs`, `smoothing_path.rs`). Default: 60.
    pub smoothings: usize,
    /// RMS change of the parameters and of the noise, in their standard deviations, from which on another
    /// time is worth it. Default: 0.02; no command calibrates it.
    pub smoothing_settled: f64,
    /// What is left of how an acceleration decays within a period, as a torque over the noise's: the belief's
    /// friction and inertia are not exact. Default: 0.1.
    pub decay_error: f64,
    /// Standard deviation of a reading of an encoder, over that of rounding to its step. Default: 1.
    pub reading_error: f64,
    /// Time between instants at which a smoothing looks at inertias anew \[s\]. Default: 0.1.
    pub smoothing_instant_s: f64,
    /// How minima are found.
    pub newton: NewtonSettings,
}

impl Default for ConcentratedSettings {
    fn default() -> Self {
        ConcentratedSettings {
            prior_weight: 1.0,
            roundness: 0.4,
            tempered_rounds: 6,
            tempering: 4.0,
            rounds_in_common: 4,
            rounds: 6,
            steps_a_round: 8,
            settled: 0.005,
            largest_correlation: 0.98,
            least_noise: 3e-3,
            smoothings: 60,
            smoothing_settled: 0.02,
            decay_error: 0.1,
            reading_error: 1.0,
            smoothing_instant_s: 0.1,
            newton: NewtonSettings::default(),
        }
    }
}
