//! What is written down of an iteration, and of a run: everything that is needed to go on.

use crate::constraint::Certainty;
use crate::end::EndReason;
use crate::experiment::KeptBalance;
use crate::growth::Rivalry;
use crate::selection::Choice;
use phiw_estimation::{Evidence, MotionLog, RobotModel, TorqueMisfit};
use serde::{Deserialize, Serialize};

/// One iteration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct IterationRecord {
    /// Name of the motion.
    pub motion: String,
    /// Why this one.
    pub choice: Choice,
    /// Number of motions that the constraint allowed.
    pub allowed: usize,
    /// The constraint allowed none, and the safest was taken.
    pub forced: bool,
    /// The reduction coefficient α.
    pub alpha: f64,
    /// Smallest distance of the reference's ZMP from the border of the support, under the belief of the time
    /// \[m\]; none without one.
    pub margin_m: Option<f64>,
    /// What was left of it with the uncertainty taken off, where the constraint counts that \[m\].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sure_margin_m: Option<f64>,
    /// How the motion that was run kept the balance; none where nobody measures that.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<KeptBalance>,
    /// When the robot fell, since the motion's start \[s\]. Its log then counts for nothing.
    pub fell_at_s: Option<f64>,
    /// Share of the log's rows in which the base stood still; only these count.
    pub still_share: f64,
    /// RMS of each joint's tracking error \[rad, m\].
    pub tracking_error: Vec<f64>,
    /// cond(Φ) of all that has been measured so far, this motion included; none before anything has been.
    pub condition_number: Option<f64>,
    /// How uncertain the torques of the dataset's motions are under this belief, as the estimator sees it:
    /// RMS of their standard deviations, weighted like the candidates; none where it does not know.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torque_uncertainty: Option<f64>,
    /// RMS over all motions of the dataset of how far the model's torques have moved in this iteration, over
    /// their RMS; none where the model has grown.
    pub torque_change: Option<f64>,
    /// The two beliefs that the motion was chosen to tell apart, in words; none if it was chosen for the
    /// parameters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub separates: Option<[String; 2]>,
    /// The belief after this iteration.
    pub model: RobotModel,
    /// Standard deviations of its parameter vector; `null` where the estimator does not know.
    pub standard_deviations: Vec<Option<f64>>,
    /// Whether what the model leaves of each torque is noise, as the estimator tests it; empty where it has
    /// no test, or the log did not count.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub misfit: Vec<TorqueMisfit>,
}

/// A run of a curriculum: all that is needed to go on with it, to the last bit.
///
/// It is a plain value. Whoever keeps it in a file after each iteration can be killed at any moment.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct CurriculumRun {
    /// Seed of all that is random in it.
    pub seed: u64,
    /// The first belief.
    pub initial: RobotModel,
    /// The present belief.
    pub model: RobotModel,
    /// α of the first iteration.
    pub first_alpha: Option<f64>,
    /// All that was measured; none before the first measurement, and once the run has ended.
    pub evidence: Option<Evidence>,
    /// How sure the present belief is; none before the first measurement, or from an estimator that does not
    /// know.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certainty: Option<Certainty>,
    /// The logs themselves, where the model may grow: new columns need them.
    pub logs: Vec<MotionLog>,
    /// Beliefs that the logs can not tell apart; the next motion is to separate them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub rivals: Vec<Rivalry>,
    /// Motions on which the robot fell, and which it is not asked for again.
    pub excluded: Vec<usize>,
    /// The iterations so far.
    pub history: Vec<IterationRecord>,
    /// Why it ended; none while it goes on.
    pub ended: Option<EndReason>,
}

impl CurriculumRun {
    /// A run that begins with a belief.
    pub fn new(seed: u64, initial: RobotModel) -> Self {
        CurriculumRun {
            seed,
            model: initial.clone(),
            initial,
            first_alpha: None,
            evidence: None,
            certainty: None,
            logs: Vec::new(),
            rivals: Vec::new(),
            excluded: Vec::new(),
            history: Vec::new(),
            ended: None,
        }
    }
}
