//! `report.json`, schema 1: what other programs read of an identification.

use indexmap::IndexMap;
use serde::{Deserialize, Deserializer, Serialize};

/// The number that `schema` carries: it grows when a reader of the old form would go wrong.
pub const SCHEMA: u32 = 1;

/// A map keyed by joint that keeps the robot's order.
pub type JointMap<T> = IndexMap<String, T>;

/// The whole of `report.json`.
///
/// A number that is not finite is written as `null` and read back as NaN.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ReportJson {
    /// Version of the form, [`SCHEMA`].
    pub schema: u32,
    /// The robot's name, from its URDF.
    pub robot: String,
    /// The moving joints, in the robot's order.
    pub joints: Vec<String>,
    /// What the model contained before anything was sought: `rigid_body` and declared effects.
    pub declared: Vec<String>,
    /// The answer in one word; `None` where the residual was not traced and may hold more than noise.
    pub verdict: Option<Verdict>,
    /// RMS of the part of each joint's torque that no model can explain (N·m or N).
    #[serde(deserialize_with = "numbers_or_nan")]
    pub noise_floor: JointMap<f64>,
    /// The declared model's errors.
    pub before: TorqueErrors,
    /// The effects in the order in which they were added.
    pub effects: Vec<EffectJson>,
    /// Effects that only polish the form of those before, or are small and told for all joints together;
    /// `after` counts them.
    #[serde(default)]
    pub refinements: Vec<EffectJson>,
    /// The errors once all effects are in.
    pub after: TorqueErrors,
    /// What is left.
    pub remaining: RemainingJson,
    /// Everything that a reader should know before trusting a number: the sentences of the terminal and the
    /// page.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// What only this program writes; a reader may ignore it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phiw: Option<ProgramJson>,
}

/// What became of the residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
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

/// One model's errors on the motion that it was fitted to and on motion that it was not.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TorqueErrors {
    /// On the motion that the model was fitted to.
    pub train: TorqueErrorJson,
    /// On held-out motion; empty where there is none.
    pub validate: TorqueErrorJson,
}

/// Torque errors over one set of logs.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TorqueErrorJson {
    /// RMS error of each joint (N·m or N).
    #[serde(default, deserialize_with = "numbers_or_nan", skip_serializing_if = "IndexMap::is_empty")]
    pub rmse: JointMap<f64>,
    /// RMS of the error over RMS of the torque, all joints and samples pooled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative: Option<f64>,
}

/// An effect that was added to the declared model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EffectJson {
    /// The effect's name in the catalogue.
    pub kind: String,
    /// The joints that it acts on.
    pub joints: Vec<String>,
    /// Fitted parameters: joint → name → value.
    pub parameters: JointMap<IndexMap<String, ParameterJson>>,
    /// Pooled held-out error once it and all before it are in.
    #[serde(deserialize_with = "number_or_nan")]
    pub validate_relative: f64,
    /// Share of the residual's variance above the noise floor that it took away, on data it was not fitted
    /// to.
    #[serde(deserialize_with = "number_or_nan")]
    pub explains: f64,
    /// Probability of this effect against its rivals, 0 to 1.
    #[serde(deserialize_with = "number_or_nan")]
    pub confidence: f64,
    /// Constants in which it is not linear and that were found by scanning, by joint (several joined by `+`)
    /// and name.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub constants: JointMap<IndexMap<String, ConstantJson>>,
    /// The effects that the data could not tell from it.
    pub rivals: Vec<RivalJson>,
}

/// A fitted parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ParameterJson {
    /// Its value.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// Its standard deviation.
    #[serde(deserialize_with = "number_or_nan")]
    pub std: f64,
    /// The unit of both.
    pub unit: String,
}

/// A constant that was found by scanning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ConstantJson {
    /// Its value (SI units).
    pub value: f64,
    /// Its standard deviation; none where the logs tell it too poorly.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub std: Option<f64>,
    /// Its 95 % interval.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub interval_95: Option<[f64; 2]>,
}

/// An effect that the data could not tell from the chosen one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RivalJson {
    /// The effect's name in the catalogue.
    pub kind: String,
    /// The joints that it would act on.
    pub joints: Vec<String>,
    /// Its probability, 0 to 1.
    #[serde(deserialize_with = "number_or_nan")]
    pub confidence: f64,
}

/// What the final model does not explain.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct RemainingJson {
    /// Whether the residual is more than noise.
    pub structured: bool,
    /// The joints on which it is.
    pub joints: Vec<String>,
    /// The signals that it follows: `q`, `qd`, `qdd`, `tau`, `t`, or another joint's.
    pub depends_on: Vec<String>,
}

/// Additions of this program to the fixed form.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ProgramJson {
    /// Version of the program that wrote the file.
    pub version: String,
    /// The report's `warnings` again, where they were before it had them.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// How the logs were conditioned: cut-off, decimation, segments, samples skipped.
    #[serde(default)]
    pub conditioning: IndexMap<String, serde_json::Value>,
    /// What other cut-offs of the filter over columns and torque would do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bandwidth: Option<BandwidthJson>,
    /// The final model's pooled error with rests included: samples at which a joint stands still, where
    /// static friction may carry any torque, are left out of the errors above.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_with_rests: Option<RelativeErrors>,
    /// How sure the effects are, in their order.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub evidence: Vec<EvidenceJson>,
    /// What these logs do not identify, and which motion would. The key is that of reports already written.
    #[serde(rename = "cannot_be_told", default, skip_serializing_if = "Vec::is_empty")]
    pub unidentifiable: Vec<UnidentifiableJson>,
    /// What bootstrap draws of the training motion named, if they were asked for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub draws: Option<DrawsJson>,
    /// How far the model goes with the motion held out, moved by its torques; of `phiw explain`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reproduction: Option<ReproductionJson>,
    /// What it costs that the bodies can exist.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub consistency: Option<ConsistencyJson>,
    /// What the logs tell of each parameter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub information: Option<InformationJson>,
}

/// What the logs tell: what their posterior makes narrower than the prior by a stated factor.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct InformationJson {
    /// That factor.
    pub narrower_by: f64,
    /// Parameters in all: ten of each body, and those of the effects.
    pub parameters: usize,
    /// Directions among them that are told.
    pub directions: usize,
    /// Parameters that are told by themselves.
    pub told: Vec<ToldJson>,
    /// Sums that are told of parameters that are not told by themselves.
    pub sums: Vec<ToldJson>,
    /// Parameters that are in neither.
    pub not_told: Vec<String>,
    /// Of the motions of a folder, if one was given, those that would tell most of what is not told, best
    /// first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub motions: Vec<TellingMotionJson>,
}

/// A parameter, or a sum of several, that the logs tell.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ToldJson {
    /// In words: `mass of forearm`, `Izz of upper_arm + 0.250 · mass of forearm`.
    pub name: String,
    /// Its value, of bodies that can exist.
    #[serde(deserialize_with = "number_or_nan")]
    pub value: f64,
    /// Its posterior standard deviation.
    #[serde(deserialize_with = "number_or_nan")]
    pub std: f64,
    /// The unit of both.
    pub unit: String,
}

/// A motion that would tell more.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct TellingMotionJson {
    /// Its file.
    pub file: String,
    /// What it would tell of what is not told (nats).
    #[serde(deserialize_with = "number_or_nan")]
    pub nats: f64,
    /// Directions that would be told beside those that are.
    pub directions: usize,
    /// Parameters that would then be told by themselves.
    pub tells: Vec<String>,
}

/// Motion held out, reproduced in open loop by the model and by the URDF.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ReproductionJson {
    /// Stretches that were reproduced.
    pub windows: usize,
    /// Their length (s).
    pub window_s: f64,
    /// Times since the stretch's beginning that errors are told of (s).
    pub horizon_s: Vec<f64>,
    /// The model's errors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub identified: Option<GrowthJson>,
    /// The URDF's, where it can be simulated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal: Option<GrowthJson>,
    /// Kinds of effects that have no place in a simulation.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub not_simulated: Vec<String>,
    /// Why the URDF by itself cannot be simulated, if it cannot.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nominal_refused: Option<String>,
}

/// Errors of one model, one for each horizon.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct GrowthJson {
    /// RMS of the position's error over each joint's travel.
    pub share_of_travel: Vec<f64>,
    /// Stretches in which some joint was further off than its travel.
    pub lost: Vec<usize>,
}

/// Fits at several cut-offs of the filter over columns and torque, compared in one band.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct BandwidthJson {
    /// Cut-off of the band that all are compared in: the one that the logs are conditioned with (Hz).
    pub reference_hz: f64,
    /// Cut-off whose fit is better there by more than scatter explains (Hz).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub better_hz: Option<f64>,
    /// The cut-offs, ascending.
    pub curve: Vec<CutoffJson>,
    /// Parameters that depend on the cut-off, those that move most first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub moved: Vec<MovedParameterJson>,
}

/// The fit at one cut-off.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct CutoffJson {
    /// The cut-off (Hz).
    pub cutoff_hz: f64,
    /// Pooled error on training motion left out, in the reference's band: RMS of the error over RMS of the
    /// torque.
    #[serde(deserialize_with = "number_or_nan")]
    pub left_out_relative: f64,
    /// Share of the error's variance that it saves there beside the reference, mean over the joints.
    #[serde(deserialize_with = "number_or_nan")]
    pub saving: f64,
    /// Standard error of that.
    #[serde(deserialize_with = "number_or_nan")]
    pub saving_std: f64,
    /// Whether the logs are conditioned with it.
    pub chosen: bool,
}

/// A parameter that depends on the cut-off.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MovedParameterJson {
    /// `joint_1.Izz` of the rigid body, `joint_1.fv` of an effect.
    pub parameter: String,
    /// The neighbouring cut-off at which it differs most (Hz).
    pub cutoff_hz: f64,
    /// How far it moves, in its standard deviations.
    #[serde(deserialize_with = "number_or_nan")]
    pub deviations: f64,
}

/// The fit over bodies that can exist beside least squares.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct ConsistencyJson {
    /// Weight of the URDF's bodies, in nats of independent samples; chosen by training motion that was left
    /// out.
    #[serde(deserialize_with = "number_or_nan")]
    pub prior_weight: f64,
    /// How far the objective can be above its optimum, in the same unit.
    #[serde(deserialize_with = "number_or_nan")]
    pub gap: f64,
    /// Whether that is next to nothing.
    pub certified: bool,
    /// Whether the model is this fit: it foretells left-out training motion better than least squares.
    #[serde(default)]
    pub is_model: bool,
    /// Bodies, by their joints, that least squares has made impossible.
    pub impossible: Vec<String>,
    /// RMS error of each joint on held-out motion (N·m or N).
    pub validate: JointMap<OfBothFits>,
    /// Pooled error on held-out motion, RMS of the error over RMS of the torque.
    pub validate_relative: OfBothFits,
}

/// A number of both fits.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct OfBothFits {
    /// By least squares.
    #[serde(deserialize_with = "number_or_nan")]
    pub least_squares: f64,
    /// Over bodies that can exist.
    #[serde(deserialize_with = "number_or_nan")]
    pub consistent: f64,
}

/// What bootstrap draws of the training motion named.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct DrawsJson {
    /// How many draws there were.
    pub count: usize,
    /// Every effect that was named on any, the most frequent first.
    pub named: Vec<NamedInDrawsJson>,
}

/// How often an effect was named.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct NamedInDrawsJson {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints that it acts on.
    pub joints: Vec<String>,
    /// Number of draws on which it was named.
    pub draws: usize,
}

/// How sure an effect is.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct EvidenceJson {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints that it acts on.
    pub joints: Vec<String>,
    /// Standard deviations from nothing, correlated samples counted once.
    pub significance: f64,
    /// Share of bootstrap draws of the training motion in which it, or one of its rivals, is chosen.
    pub stability: f64,
}

/// An effect of which the motion leaves nothing beside the model's own columns.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct UnidentifiableJson {
    /// Its name in the catalogue.
    pub kind: String,
    /// The joints, or groups of joints, on which it is unidentifiable.
    pub joints: Vec<Vec<String>>,
    /// The motion, or the signal, that would tell.
    pub telling_motion: String,
}

/// Pooled errors, RMS of the error over RMS of the torque.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct RelativeErrors {
    /// On the motion that the model was fitted to.
    #[serde(deserialize_with = "number_or_nan")]
    pub train: f64,
    /// On held-out motion.
    #[serde(deserialize_with = "number_or_nan")]
    pub validate: f64,
}

impl ReportJson {
    /// The file's text: indented, with a newline at its end.
    ///
    /// # Errors
    /// None is known; serde's signature allows one.
    pub fn to_json(&self) -> Result<String, serde_json::Error> {
        serde_json::to_string_pretty(self).map(|text| text + "\n")
    }

    /// Reads the file's text.
    ///
    /// # Errors
    /// Text that is not JSON, or lacks a field, with its line and column.
    pub fn from_json(text: &str) -> Result<Self, serde_json::Error> {
        serde_json::from_str(text)
    }
}

fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN))
}

fn numbers_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<JointMap<f64>, D::Error> {
    let numbers = JointMap::<Option<f64>>::deserialize(deserializer)?;
    Ok(numbers.into_iter().map(|(joint, number)| (joint, number.unwrap_or(f64::NAN))).collect())
}
