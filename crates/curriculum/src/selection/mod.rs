//! Which motion next: the optimisation (11), and what it is compared with.

mod candidates;
mod condition_bound;
mod lanczos;
mod optimal;
mod random;
mod smallest_condition;
mod triangle;

pub use candidates::{MotionCandidate, MotionCandidates};
pub use optimal::{AOptimal, DOptimal, TorqueOptimal, TorqueOptimalPerSecond};
pub use random::RandomMotion;
pub use smallest_condition::SmallestCondition;
pub use triangle::Triangle;

use crate::IterationRecord;
use crate::motion::MotionDataset;
use rand::Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What a selection chooses from.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// All motions: their names, tasks and durations.
    pub dataset: &'a MotionDataset,
    /// The factor of each, in the same order.
    pub candidates: &'a MotionCandidates,
    /// Those that the constraint allows, as indices; never empty.
    pub allowed: &'a [usize],
    /// R of all that has been measured; none in the first iteration.
    pub measured: Option<&'a Triangle>,
    /// The iterations so far; empty if nothing has been done, or if who asks keeps no record.
    pub history: &'a [IterationRecord],
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
    fn choose(&self, question: &Question<'_>, rng: &mut dyn Rng) -> Choice;
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

/// A motion and the number by which it is compared with others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scored {
    /// Index of the motion.
    pub motion: usize,
    /// The number; not finite where it can not be computed.
    pub score: f64,
}

/// Which end of the scores is the best.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Best {
    /// The smallest score.
    Smallest,
    /// The largest score.
    Largest,
}

/// The motion with the best score, and the next best. Of equals the one with the lower index comes first;
/// scores that are not a number come last. None of no motions.
pub fn decide(motions: &[Scored], best: Best) -> Option<Choice> {
    let mut order = motions.to_vec();
    order.sort_by(|a, b| {
        let by_score = match best {
            Best::Smallest => a.score.total_cmp(&b.score),
            Best::Largest => b.score.total_cmp(&a.score),
        };
        a.score.is_nan().cmp(&b.score.is_nan()).then(by_score).then(a.motion.cmp(&b.motion))
    });
    Some(Choice {
        motion: order.first()?.motion,
        merit: order.first().map(|best| best.score),
        runner_up: order.get(1).map(|next| (next.motion, next.score)),
    })
}

/// The allowed motion with the smallest `cost`.
fn smallest(allowed: &[usize], cost: impl Fn(usize) -> f64 + Sync) -> Choice {
    let scored: Vec<Scored> =
        allowed.par_iter().map(|&motion| Scored { motion, score: cost(motion) }).collect();
    decide(&scored, Best::Smallest).unwrap_or(Choice { motion: 0, merit: None, runner_up: None })
}
