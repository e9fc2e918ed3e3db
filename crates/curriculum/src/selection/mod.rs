//! Which motion next: the optimisation (11), and what it is compared with.

mod optimal;
mod random;
mod smallest_condition;

pub use optimal::{AOptimal, DOptimal, TorqueOptimal};
pub use random::RandomMotion;
pub use smallest_condition::SmallestCondition;

use crate::Candidates;
use crate::triangle::Triangle;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// What a selection chooses from.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// All motions.
    pub candidates: &'a Candidates,
    /// Those that the constraint allows, as indices; never empty.
    pub allowed: &'a [usize],
    /// R of all that has been measured; none in the first iteration.
    pub measured: Option<&'a Triangle>,
}

/// What a selection chose, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Choice {
    /// Index of the motion.
    pub motion: usize,
    /// The number that decided, such as the predicted cond of the stack; none where nothing was compared.
    pub merit: Option<f64>,
    /// The next best motion, with its number.
    pub runner_up: Option<(usize, f64)>,
}

/// Chooses the next motion. Calls with the same question and the same random numbers give the same choice.
pub trait Selection: Send + Sync {
    /// Its name, for reports: `smallest_condition`.
    fn name(&self) -> &'static str;

    /// Chooses one of the allowed motions.
    fn choose(&self, question: &Question<'_>, random: &mut ChaCha8Rng) -> Choice;
}

impl Question<'_> {
    /// R of the stack of all that has been measured and one candidate.
    pub fn stack(&self, motion: usize) -> Triangle {
        let mut stack = self.candidates.all()[motion].triangle.clone();
        if let Some(measured) = self.measured {
            stack.absorb(&mut measured.clone());
        }
        stack
    }
}

/// The allowed motion with the smallest `cost`, the first of equals; costs that are not a number come last.
fn smallest(allowed: &[usize], cost: impl Fn(usize) -> f64) -> Choice {
    let mut costs: Vec<(f64, usize)> = allowed.iter().map(|&motion| (cost(motion), motion)).collect();
    costs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    Choice {
        motion: costs.first().map_or(0, |best| best.1),
        merit: costs.first().map(|best| best.0),
        runner_up: costs.get(1).map(|next| (next.1, next.0)),
    }
}
