//! Optimal experiments in the classical sense, for comparison with cond.

use super::{Choice, Question, Selection, smallest};
use rand::Rng;

/// The largest determinant of ΦᵀΦ: the smallest volume of the parameters' uncertainty.
#[derive(Clone, Copy, Debug, Default)]
pub struct DOptimal;

impl Selection for DOptimal {
    fn name(&self) -> &'static str {
        "d_optimal"
    }

    /// The merit is −log det(ΦᵀΦ).
    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        smallest(question.allowed, |motion| -question.stack(motion).log_determinant())
    }
}

/// The smallest trace of (ΦᵀΦ)⁻¹: the smallest mean variance of the parameters, which is what RMSE_w (17)
/// measures.
#[derive(Clone, Copy, Debug, Default)]
pub struct AOptimal;

impl Selection for AOptimal {
    fn name(&self) -> &'static str {
        "a_optimal"
    }

    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        smallest(question.allowed, |motion| question.stack(motion).inverse_trace())
    }
}

/// The smallest variance of the torques that the model will predict, on average over all motions of the
/// dataset: what the torque error (19) measures.
///
/// The paper's cond does not change when Φ is done again, so that where one motion keeps it small it is
/// chosen again and again, though another sample of it adds little. The variance of the predictions counts
/// both: each direction of w as much as the motions feel it, and how often it was seen. It is the I- or
/// V-optimality of the design of experiments (Atkinson, Donev and Tobias, Optimum Experimental Designs, 2007,
/// §10.6), over a finite set of motions.
#[derive(Clone, Copy, Debug, Default)]
pub struct TorqueOptimal;

impl Selection for TorqueOptimal {
    fn name(&self) -> &'static str {
        "torque_optimal"
    }

    /// The merit is trace(Φ_all·(ΦᵀΦ)⁻¹·Φ_allᵀ), with the rows weighted like the candidates.
    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        let everything = question.candidates.everything();
        smallest(question.allowed, |motion| question.stack(motion).variance_along(everything))
    }
}

/// The largest fall of [`TorqueOptimal`]'s variance for each second of motion, in logarithms: what a second
/// of the robot's time is worth.
///
/// Where nothing has been measured the variance is infinite, and that motion is chosen whose variance is
/// smallest after as many seconds of it as of any other.
#[derive(Clone, Copy, Debug, Default)]
pub struct TorqueOptimalPerSecond;

impl Selection for TorqueOptimalPerSecond {
    fn name(&self) -> &'static str {
        "torque_optimal_per_second"
    }

    /// The merit is ln(variance with the motion / variance without it) over its duration \[1/s\]; before
    /// anything has been measured, ln(variance with the motion · its duration).
    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        let everything = question.candidates.everything();
        let before = question.measured.map_or(f64::INFINITY, |measured| measured.variance_along(everything));
        smallest(question.allowed, |motion| {
            let duration_s = question.dataset.motions()[motion].duration_s();
            per_second(before, question.stack(motion).variance_along(everything), duration_s)
        })
    }
}

fn per_second(before: f64, after: f64, duration_s: f64) -> f64 {
    match before.is_finite() {
        true => (after / before).ln() / duration_s,
        false => (after * duration_s).ln(),
    }
}
