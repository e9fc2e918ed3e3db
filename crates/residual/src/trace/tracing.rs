//! The result of a trace.

use super::probe::Dependence;
use super::scanned::ScannedConstant;
use phiw_identification::fitting::TorqueError;
use phiw_identification::{EffectSpec, Identified};

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The declared model leaves noise only.
    Sufficient,
    /// Effects were added and what remains is noise.
    Explained,
    /// Effects were added and structure remains.
    PartlyExplained,
    /// There is structure and no effect of the catalogue accounts for it.
    Unexplained,
}

/// An effect that the data could not tell from the one that was named.
#[derive(Clone, Debug, PartialEq)]
pub struct RivalEffect {
    /// Kind and joints.
    pub spec: EffectSpec,
    /// Its probability against the others.
    pub confidence: f64,
}

/// A candidate as it ranked.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranked {
    /// Kind, joints, constants.
    pub spec: EffectSpec,
    /// Parameters that it adds.
    pub parameters: usize,
    /// Held-out error with it, pooled: RMS of the error over RMS of the torque.
    pub held_out: f64,
}

/// An effect that was added.
#[derive(Clone, Debug)]
pub struct FoundEffect {
    /// Kind, joints and constants as finally refined.
    pub spec: EffectSpec,
    /// Held-out error once it and all before it are in: RMS of the error over RMS of the torque.
    pub relative: f64,
    /// The same without it.
    pub relative_before: f64,
    /// Share of the held-out residual variance above the noise floor that it took away.
    pub explains: f64,
    /// Its probability against its rivals.
    pub confidence: f64,
    /// Share of the stretches of training motion whose error is smaller with it; after bootstrap draws, the
    /// share of draws that name it.
    pub stability: f64,
    /// Standard deviations from nothing.
    pub significance: f64,
    /// What the data could not tell from it.
    pub rivals: Vec<RivalEffect>,
    /// The best candidates when it was chosen.
    pub ranking: Vec<Ranked>,
}

/// A residual that is larger than its noise floor and follows nothing that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Disturbance {
    /// The joint whose residual it is.
    pub joint: String,
    /// Which of the torques that is.
    pub row: usize,
    /// Its RMS on motion held out \[N·m, N\].
    pub rmse: f64,
    /// The joint's noise floor, that of white noise \[N·m, N\].
    pub noise_floor: f64,
    /// Correlation of samples a quarter to half a second apart.
    pub autocorrelation: f64,
}

/// What the final model leaves.
#[derive(Clone, Debug, Default)]
pub struct Remaining {
    /// Joints whose residual has structure.
    pub joints: Vec<String>,
    /// Signals that the residuals still follow, strongest first.
    pub depends_on: Vec<Dependence>,
    /// Those of `joints` of which a training log by itself tells otherwise than all of them together.
    pub by_log: Vec<String>,
    /// Residuals larger than noise that follow nothing measured: no structure.
    pub disturbances: Vec<Disturbance>,
    /// Of each torque the RMS of what no model can foretell \[N·m, N\]: white noise, or what the model leaves
    /// in training where that is more and follows nothing measured.
    pub noise_floor: Vec<f64>,
    /// The best candidates that were not good enough.
    pub ranking: Vec<Ranked>,
    /// What these logs cannot tell: candidates of which the motion leaves nothing beside the model's own
    /// columns.
    pub unidentifiable: Vec<EffectSpec>,
}

impl Remaining {
    /// Whether what is left is white noise: no structure, and nothing else that is larger.
    pub fn is_noise(&self) -> bool {
        self.joints.is_empty() && self.disturbances.is_empty()
    }
}

/// A declared effect that the logs refute: a constant of it is certain to be one that no such effect has.
#[derive(Clone, Debug, PartialEq)]
pub struct Withdrawn {
    /// Kind, joints and constants.
    pub spec: EffectSpec,
    /// The name of the constant.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// What the logs make of it, 95 %.
    pub interval_95: [f64; 2],
    /// What it may be.
    pub bounds: (f64, f64),
    /// Whether it is in the model nevertheless, since that is worse on motion held out without it.
    pub kept: bool,
}

/// The result of a trace.
pub struct Tracing {
    /// The verdict.
    pub verdict: Verdict,
    /// Declared effects that have not left, then those named, then the refinements, with their constants.
    pub specs: Vec<EffectSpec>,
    /// The final model; with a held model its parameters are those held, changed by what was found.
    pub model: Identified,
    /// The constants that were found by scanning, with their deviations; none against a held model, whose
    /// parameters stay as they are.
    pub constants: Vec<ScannedConstant>,
    /// Declared effects that the logs refute.
    pub withdrawn: Vec<Withdrawn>,
    /// Error of the declared (or held) model: training, held out.
    pub before: (TorqueError, TorqueError),
    /// The effects that were added and have a name, in order.
    pub effects: Vec<FoundEffect>,
    /// Effects that were added behind them: certain, but they only polish the form of others or are too small
    /// for a name.
    pub refinements: Vec<FoundEffect>,
    /// What is left.
    pub remaining: Remaining,
    /// Whether motion held out had a say: of what training motion alone would have chosen, something made the
    /// error there larger.
    pub held_out_had_a_say: bool,
    /// What was left out for that.
    pub left_out_by_held_out: Vec<EffectSpec>,
    /// Effects of which motion held out has told how they are from log to log, since there is one training
    /// log.
    pub told_by_held_out: Vec<EffectSpec>,
    /// Kinds and joints of which some constants could not be judged, since their columns are not finite on
    /// these logs.
    pub not_judged: Vec<(String, Vec<String>)>,
}

/// How far the errors of one model are apart that was fitted twice.
pub(super) const ROUNDING: f64 = 1e-9;
