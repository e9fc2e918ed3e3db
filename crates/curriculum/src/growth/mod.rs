//! The loop closed: who looks for what the model lacks, and what becomes of the answer.

mod rivalry;

pub use rivalry::{Rivalry, rivals_to_separate};

use crate::CurriculumError;
use phiw_estimation::{MotionLog, Robot, RobotModel};
use phiw_identification::EffectSpec;

/// What was found beside the declared model.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// What was found, in that order: each an effect, or one kind on several joints (a family).
    pub answers: Vec<Vec<EffectSpec>>,
    /// Pairs that the logs can not tell apart: one of the effects, and what might be there in its place.
    pub rivals: Vec<[EffectSpec; 2]>,
    /// A model with all of it that has been fitted to the logs: where another estimate may begin. How a
    /// friction turns depends on how large it is, and from nothing on another answer may be nearer.
    pub fitted: Option<RobotModel>,
}

impl Found {
    /// The effects of all answers.
    #[must_use]
    pub fn effects(&self) -> Vec<EffectSpec> {
        self.answers.concat()
    }
}

/// Looks for what the model lacks.
pub trait Growth: Send + Sync {
    /// Its name, for reports: `trace`.
    fn name(&self) -> &'static str;

    /// What all logs so far say that the declared model lacks. An earlier answer, which is in `model`, is not
    /// binding; where it is `doubted`, the last motion was chosen to tell it from a rival. What is `refuted`
    /// is no answer.
    ///
    /// # Errors
    /// The logs are not of this robot, or hold too little.
    fn look(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        doubted: bool,
        refuted: &[EffectSpec],
    ) -> Result<Found, CurriculumError>;

    /// −log L that an effect must save to be believed, where the estimator knows a likelihood.
    ///
    /// What looks for effects may judge by least squares. Noise that moves the robot and is not in the log
    /// bends these, and an effect that looks like the bend (a delay of some milliseconds: the command answers
    /// to noise that has already moved the robot) can be named for it. The likelihood knows better.
    fn least_gain(&self) -> f64;
}

/// What a family of one parameter for each of `members` joints saves of −log L as one hypothesis, where its
/// fit saves `gain`.
///
/// The members' values, each over its standard deviation, are taken for draws of one normal distribution,
/// whose spread is fitted to them (empirical Bayes, Efron & Morris 1973). Against noise alone that saves
/// ½n·(m − 1 − ln m), m = 2·gain/n being their mean square; m ≤ 1 is what noise makes. So eighteen frictions
/// of two standard deviations each are plain together, though none is by itself. One parameter alone saves
/// what it saves.
#[must_use]
pub fn saved_by_family(gain: f64, members: usize) -> f64 {
    if members <= 1 || !gain.is_finite() {
        return gain;
    }
    let half = 0.5 * members as f64;
    let mean_square = gain / half;
    if mean_square > 1.0 { half * (mean_square - 1.0 - mean_square.ln()) } else { 0.0 }
}

/// The answer to be left out of those that were found, if the likelihood does not confirm all of them: the
/// one that saves least, if that is less than `least_gain`.
///
/// `gains` are what −log L of the model grows by without each of them, of a family as [`saved_by_family`].
/// What is not a number confirms nothing. Of equals the first is left out.
pub fn unconfirmed(gains: &[f64], least_gain: f64) -> Option<usize> {
    let gain = |index: &usize| if gains[*index].is_nan() { f64::NEG_INFINITY } else { gains[*index] };
    let least = (0..gains.len()).min_by(|a, b| gain(a).total_cmp(&gain(b)))?;
    (gain(&least) < least_gain).then_some(least)
}
