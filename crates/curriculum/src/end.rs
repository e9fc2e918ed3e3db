//! When the curriculum ends.

use crate::IterationRecord;
use serde::{Deserialize, Serialize};

/// Why a curriculum ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndReason {
    /// The number of iterations that was asked for.
    Count,
    /// Another motion would change little.
    Converged,
    /// No motion was allowed, and nothing was run.
    NothingAllowed,
}

/// Decides after each iteration whether it was the last.
pub trait EndCriterion: Send + Sync {
    /// Why the curriculum ends here; none if it goes on.
    fn reason(&self, history: &[IterationRecord]) -> Option<EndReason>;
}

/// The paper's: a fixed number of iterations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FixedCount(pub usize);

impl Default for FixedCount {
    /// Five.
    fn default() -> Self {
        FixedCount(5)
    }
}

impl EndCriterion for FixedCount {
    fn reason(&self, history: &[IterationRecord]) -> Option<EndReason> {
        (history.len() >= self.0).then_some(EndReason::Count)
    }
}

/// The curriculum has converged when its last motion neither made Φ much better nor moved the model's
/// torques.
///
/// Both are known on a real robot: cond(Φ) is the paper's own proposal for an end condition (its section 6);
/// the torques are those that the new and the old parameters predict for all motions of the dataset, which
/// unlike a measured torque error has no floor of noise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Converged {
    /// Largest change of the predicted torques, over their RMS, that counts as none.
    pub torque_change: f64,
    /// Largest share by which cond(Φ) may still fall.
    pub condition_change: f64,
    /// Iterations at least.
    pub least: usize,
    /// Iterations at most.
    pub most: usize,
}

impl Default for Converged {
    /// Torques within 2 %, cond within 10 %, two to ten iterations.
    fn default() -> Self {
        Converged { torque_change: 0.02, condition_change: 0.1, least: 2, most: 10 }
    }
}

impl EndCriterion for Converged {
    fn reason(&self, history: &[IterationRecord]) -> Option<EndReason> {
        if history.len() >= self.most {
            return Some(EndReason::Count);
        }
        let [.., before, last] = history else { return None };
        let (Some(before), Some(cond)) = (before.condition_number, last.condition_number) else {
            return None;
        };
        let settled = last.torque_change.is_some_and(|change| change <= self.torque_change)
            && cond >= (1.0 - self.condition_change) * before;
        (history.len() >= self.least && settled).then_some(EndReason::Converged)
    }
}

/// The curriculum ends when the torques are known as well as was asked for.
///
/// [`Converged`] asks what the last motion changed; a dull one changes nothing and ends it. This asks what
/// the estimate knows of itself ([`IterationRecord::torque_uncertainty`]), and so needs an estimator that
/// knows its covariance ([`phiw_estimation::MotionLikelihood`]).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certain {
    /// Largest RMS standard deviation of the torques that the model predicts for all motions of the dataset,
    /// weighted like the candidates: where their weights are 1/σ, a share of the noise σ of each torque.
    pub torque_uncertainty: f64,
    /// Iterations at most.
    pub most: usize,
}

impl Default for Certain {
    /// 0.3 of the noise of a torque, ten iterations.
    fn default() -> Self {
        Certain { torque_uncertainty: 0.3, most: 10 }
    }
}

impl EndCriterion for Certain {
    fn reason(&self, history: &[IterationRecord]) -> Option<EndReason> {
        let known = |record: &IterationRecord| {
            record.torque_uncertainty.is_some_and(|u| u <= self.torque_uncertainty)
        };
        match history.last().is_some_and(known) {
            true => Some(EndReason::Converged),
            false => (history.len() >= self.most).then_some(EndReason::Count),
        }
    }
}
