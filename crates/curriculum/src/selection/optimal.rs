//! Optimal experiments in the classical sense, for comparison with cond.

use super::{Choice, Question, Selection, smallest};
use rand_chacha::ChaCha8Rng;

/// The largest determinant of ΦᵀΦ: the smallest volume of the parameters' uncertainty.
#[derive(Clone, Copy, Debug, Default)]
pub struct DOptimal;

impl Selection for DOptimal {
    fn name(&self) -> &'static str {
        "d_optimal"
    }

    /// The merit is −log det(ΦᵀΦ).
    fn choose(&self, question: &Question<'_>, _: &mut ChaCha8Rng) -> Choice {
        smallest(question.allowed, |motion| -question.stack(motion).log_determinant())
    }
}

/// The smallest trace of (ΦᵀΦ)⁻¹: the smallest mean variance of the parameters, which is what RMSE_w (17) measures.
#[derive(Clone, Copy, Debug, Default)]
pub struct AOptimal;

impl Selection for AOptimal {
    fn name(&self) -> &'static str {
        "a_optimal"
    }

    fn choose(&self, question: &Question<'_>, _: &mut ChaCha8Rng) -> Choice {
        smallest(question.allowed, |motion| question.stack(motion).inverse_trace())
    }
}
