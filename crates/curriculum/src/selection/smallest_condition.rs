//! Equation (11): the motion that makes cond of the stack smallest.

use super::condition_bound::ConditionBound;
use super::{Choice, Question, Selection, smallest};
use rand::Rng;
use rayon::prelude::*;
use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// Equation (11): the motion with which cond of all measured rows and its own is smallest.
///
/// Exact, but most candidates are never merged. Each has a lower bound of its cond for the price of two
/// products with what has been measured, a closer one for the price of twenty, and its own cond for that of
/// a merge. Whichever candidate has the lowest number is looked at more closely, until two numbers that are
/// exact are no higher than any bound.
#[derive(Clone, Copy, Debug, Default)]
pub struct SmallestCondition;

/// How well cond of a stack is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Known {
    Roughly,
    Closely,
    Exactly,
}

/// Candidates that are looked at side by side, where their cond is known roughly. Close bounds are cheap.
const AT_ONCE_ROUGH: usize = 16;

/// The same where it is known closely: two conds are asked for in any case.
const AT_ONCE_CLOSE: usize = 2;

/// A candidate whose cond is no lower than `cond`.
#[derive(Clone, Copy, Debug)]
struct Candidate {
    cond: f64,
    motion: usize,
    known: Known,
}

impl Selection for SmallestCondition {
    fn name(&self) -> &'static str {
        "smallest_condition"
    }

    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        let all = question.candidates.all();
        let Some(measured) = question.measured else {
            return smallest(question.allowed, |motion| all[motion].condition_number);
        };
        let exact = |motion: usize| question.stack(motion).condition_number();
        let Some(bounds) = ConditionBound::of(measured) else { return smallest(question.allowed, exact) };
        let rough = |&motion: &usize| {
            let cond = bounds.first(&all[motion].triangle);
            Candidate { cond, motion, known: Known::Roughly }
        };
        let mut waiting: BinaryHeap<Candidate> =
            question.allowed.par_iter().map(rough).collect::<Vec<_>>().into();
        let mut best: Vec<Candidate> = Vec::new();
        while best.len() < 2 {
            let Some(next) = waiting.pop() else { break };
            let at_once = match next.known {
                Known::Roughly => AT_ONCE_ROUGH,
                Known::Closely => AT_ONCE_CLOSE,
                Known::Exactly => {
                    best.push(next);
                    continue;
                }
            };
            let mut together = vec![next];
            while together.len() < at_once
                && let Some(more) = waiting.peek()
                && more.known == next.known
            {
                together.push(*more);
                waiting.pop();
            }
            let closer = |candidate: &Candidate| match candidate.known {
                Known::Roughly => Candidate {
                    cond: bounds.close(&all[candidate.motion].triangle).max(candidate.cond),
                    known: Known::Closely,
                    ..*candidate
                },
                _ => Candidate { cond: exact(candidate.motion), known: Known::Exactly, ..*candidate },
            };
            waiting.extend(together.par_iter().map(closer).collect::<Vec<_>>());
        }
        Choice {
            motion: best.first().map_or(0, |best| best.motion),
            merit: best.first().map(|best| best.cond),
            runner_up: best.get(1).map(|next| (next.motion, next.cond)),
        }
    }
}

/// The heap gives the greatest first: the lowest cond, the lower index of equals.
impl Ord for Candidate {
    fn cmp(&self, other: &Self) -> Ordering {
        other.cond.total_cmp(&self.cond).then(other.motion.cmp(&self.motion))
    }
}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Candidate {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Candidate {}
