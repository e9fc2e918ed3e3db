//! Any motion: the non-curriculum approach of section 5.1.

use super::{Choice, Question, Selection};
use rand::{Rng, RngExt};

/// Picks any allowed motion, all alike likely.
#[derive(Clone, Copy, Debug, Default)]
pub struct RandomMotion;

impl Selection for RandomMotion {
    fn name(&self) -> &'static str {
        "random"
    }

    fn choose(&self, question: &Question<'_>, rng: &mut dyn Rng) -> Choice {
        let place = rng.random_range(0..question.allowed.len().max(1));
        Choice {
            motion: question.allowed.get(place).copied().unwrap_or_default(),
            merit: None,
            runner_up: None,
        }
    }
}
