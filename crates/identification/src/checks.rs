//! Whether logs and a robot fit each other, before anything is computed.

pub use crate::conventions::{
    Convention, ConventionKind, ConventionSettings, UnknownConventionSetting, conventions,
};
pub use crate::robot_findings::robot_findings;

use crate::{Design, Effect};
use phiw_dynamics::{JointType, Tree};
use phiw_limits::Limits;
use phiw_regressor::{JointTorqueRegressor, fewest_base_parameters};
use phiw_telemetry::Survey;
use phiw_telemetry::segments::{GapCount, GapReason};
use std::path::PathBuf;

/// A log that a model cannot be fitted to.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InputError {
    /// Angles in degrees.
    #[error(
        "{}: q.{joint} runs from {min:.1} to {max:.1}, far beyond the joint's limits {lower:.2} to {upper:.2} rad: \
         the angles look like degrees; multiply them by pi/180", path.display()
    )]
    Degrees {
        /// The log.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// Lowest position in the log.
        min: f64,
        /// Highest position in the log.
        max: f64,
        /// Lower limit \[rad\].
        lower: f64,
        /// Upper limit \[rad\].
        upper: f64,
    },
    /// Joints that no log moves.
    #[error("{}; move {them}, or hold {them} with --hold {}", not_excited(.joints), held(.joints),
        them = if .joints.len() == 1 { "it" } else { "them" })]
    NotExcited {
        /// The joints, at least one.
        joints: Vec<StillJoint>,
    },
    /// A torque column of zeros.
    #[error(
        "{}: column tau.{joint} is zero in every row; log the measured torque of `{joint}`, or hold the joint with --hold {joint}",
        path.display()
    )]
    ZeroTorque {
        /// The log.
        path: PathBuf,
        /// The joint.
        joint: String,
    },
    /// Stamps that are no seconds.
    #[error(
        "{}: the time stamps are {period} apart, and no robot is logged at {rate_hz:.3e} Hz: they are not in seconds; \
         {mend}", path.display()
    )]
    TimeUnit {
        /// The log.
        path: PathBuf,
        /// Distance of the stamps.
        period: f64,
        /// What the rate would be \[Hz\].
        rate_hz: f64,
        /// What the stamps look like.
        mend: &'static str,
    },
    /// Stamps of which most are that of the row before.
    #[error(
        "{}: {repeated} of {rows} rows have the time stamp of the row before: the stamps were written with too \
         few digits; write them to a tenth of the sample period, or from the start of the log", path.display()
    )]
    CoarseStamps {
        /// The log.
        path: PathBuf,
        /// Rows whose stamp is that of the row before.
        repeated: u64,
        /// All rows.
        rows: u64,
    },
    /// Velocities that are the positions' derivative but for a unit.
    #[error(
        "{}: dq/dt of `{joint}` is {factor:.4} times its column qd.{joint}: {mend}", path.display()
    )]
    VelocityUnit {
        /// The log.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// Slope of dq/dt over qd.
        factor: f64,
        /// What the factor looks like.
        mend: &'static str,
    },
    /// Positions far beyond what the joint can reach.
    #[error(
        "{}: q.{joint} runs from {min:.4} to {max:.4}, far beyond the joint's limits {lower:.3} to {upper:.3} {unit}: \
         it is in another unit (mm for m, degrees or encoder steps for rad); convert it", path.display()
    )]
    PositionUnit {
        /// The log.
        path: PathBuf,
        /// The joint.
        joint: String,
        /// Lowest position in the log.
        min: f64,
        /// Highest position in the log.
        max: f64,
        /// Lower limit \[rad, m\].
        lower: f64,
        /// Upper limit \[rad, m\].
        upper: f64,
        /// Unit of the limits.
        unit: &'static str,
    },
    /// A robot whose factors do not fit into memory.
    #[error(
        "{joints} joints with {parameters} parameters or more need {:.1} GB for their factors, more than {:.1} GB: \
         hold joints that need not be identified together (--hold JOINT)", *bytes as f64 / 1e9, *most as f64 / 1e9
    )]
    TooLarge {
        /// Joints that move.
        joints: usize,
        /// Parameters of the model.
        parameters: usize,
        /// Bytes needed.
        bytes: u64,
        /// The limit \[bytes\].
        most: u64,
    },
    /// Nothing moves in what is held out.
    #[error(
        "{held_out}: no joint moves there for long enough, so nothing can be said of the model's error on motion held out; \
         name a log with motion (--validate), or cut the rest off the log"
    )]
    NothingHeldOut {
        /// The stretches that are held out, in words.
        held_out: String,
    },
    /// Fewer rows than parameters.
    #[error(
        "the training logs are too short: {rows} rows after filtering, but {parameters} parameters are to be found; \
         record at least {} s more", (*seconds_missing).ceil()
    )]
    TooShort {
        /// Rows of all torques after filtering.
        rows: u64,
        /// Parameters of the model.
        parameters: usize,
        /// Roughly how much longer \[s\].
        seconds_missing: f64,
    },
}

/// A travel below this counts as standing still \[rad, m\].
const STANDING_STILL: f64 = 1e-3;
/// A travel below this many standard deviations of the position noise counts as standing still.
const TRAVEL_TO_NOISE: f64 = 20.0;

/// Rates at which robots are logged \[Hz\]; stamps in another unit than seconds give a rate outside, a
/// thousand times too low or too high.
const RATES_HZ: std::ops::Range<f64> = 2.0..50_000.0;
/// Times beyond its limits that a joint's positions may run; drives read beyond their limits by a little,
/// another unit by 57 or 1000.
const BEYOND_LIMITS: f64 = 6.0;
/// Distance of a factor from that of a change of units, as a share of it.
const FACTOR_TOLERANCE: f64 = 0.05;

fn check_time_unit(survey: &Survey) -> Result<(), InputError> {
    let rate_hz = survey.rate_hz();
    if RATES_HZ.contains(&rate_hz) {
        return Ok(());
    }
    // A clock's seconds since 1970 in six or ten digits are whole seconds or more.
    let is_repeated = |gap: &&GapCount| gap.reason == GapReason::DuplicateStamp;
    let repeated = survey.gaps.iter().filter(is_repeated).map(|gap| gap.count).sum();
    if 2 * repeated > survey.rows {
        return Err(InputError::CoarseStamps { path: survey.path.clone(), repeated, rows: survey.rows });
    }
    let plausible = |factor: f64| (10.0..20_000.0).contains(&(rate_hz * factor));
    let mend = if plausible(1e3) {
        "they look like milliseconds: divide them by 1000"
    } else if plausible(1e6) {
        "they look like microseconds: divide them by 1 000 000"
    } else if plausible(1e9) {
        "they look like nanoseconds: divide them by 1 000 000 000"
    } else {
        "write them in seconds"
    };
    Err(InputError::TimeUnit { path: survey.path.clone(), period: survey.period, rate_hz, mend })
}

/// A velocity column whose slope against the positions' derivative is that of another unit: either is wrong,
/// and nobody can tell which.
fn check_velocity_unit(survey: &Survey) -> Result<(), InputError> {
    let degree = std::f64::consts::PI / 180.0;
    let units = [
        (degree, "qd is in degrees/s: multiply it by pi/180"),
        (1.0 / degree, "q is in degrees: multiply it by pi/180"),
        (1e-3, "t is in ms or qd in mm/s, while the other is not: convert it"),
        (1e3, "t is a thousand times too small or q is in mm, while qd is not: convert it"),
        (1e-6, "t is in microseconds: divide it by 1 000 000"),
        (1e6, "t is a million times too small: it must be in seconds"),
    ];
    for joint in &survey.joints {
        let Some(velocity) = &joint.velocity else { continue };
        let near = |unit: f64| (velocity.agreement / unit - 1.0).abs() < FACTOR_TOLERANCE;
        if let Some(&(_, mend)) = units.iter().find(|(unit, _)| near(*unit)) {
            let factor = velocity.agreement;
            return Err(InputError::VelocityUnit {
                path: survey.path.clone(),
                joint: joint.name.clone(),
                factor,
                mend,
            });
        }
    }
    Ok(())
}

/// Checks what only logs and robot together can tell: degrees for radians, torques that are missing.
///
/// # Errors
/// The first that is wrong, by log and joint.
pub fn check_logs(tree: &Tree, train: &[Survey], validate: &[Survey]) -> Result<(), InputError> {
    for survey in train.iter().chain(validate) {
        check_time_unit(survey)?;
        check_velocity_unit(survey)?;
        for (index, joint) in survey.joints.iter().enumerate() {
            let body = tree.joint(index);
            let (lower, upper) = (body.limits.lower, body.limits.upper);
            let largest = joint.q_min.abs().max(joint.q_max.abs());
            // A joint turns three times round at the most in what is identified here; degrees exceed that by
            // far.
            let limit = lower.abs().max(upper.abs());
            let limit = if limit.is_finite() && upper > lower { limit } else { std::f64::consts::TAU };
            let beyond = largest > 6.0 * limit && largest > 10.0;
            if body.joint_type != JointType::Prismatic && beyond && largest.to_radians() < 1.5 * limit {
                let (path, joint_name) = (survey.path.clone(), joint.name.clone());
                let (min, max) = (joint.q_min, joint.q_max);
                return Err(InputError::Degrees { path, joint: joint_name, min, max, lower, upper });
            }
            let reach = upper - lower;
            let outside = (lower - joint.q_min).max(joint.q_max - upper);
            if reach.is_finite() && reach > 0.0 && outside > BEYOND_LIMITS * limit.max(reach) {
                return Err(InputError::PositionUnit {
                    path: survey.path.clone(),
                    joint: joint.name.clone(),
                    min: joint.q_min,
                    max: joint.q_max,
                    lower,
                    upper,
                    unit: if body.joint_type == JointType::Prismatic { "m" } else { "rad" },
                });
            }
            if joint.torque.as_ref().is_some_and(|torque| torque.all_zero()) {
                return Err(InputError::ZeroTorque { path: survey.path.clone(), joint: joint.name.clone() });
            }
        }
    }
    Ok(())
}

/// Checks that the triangular factors of all torques fit into memory, for each fold and for each thread.
///
/// # Errors
/// [`InputError::TooLarge`].
pub fn check_size_of_factors(design: &Design, folds: usize, limits: &Limits) -> Result<(), InputError> {
    let widths = design.rows().iter().map(|row| row.range.len());
    check_size(widths, design.parameter_count(), folds, limits)
}

/// The same from the fewest parameters that a robot and its effects can have, before the base parameters are
/// searched for, which takes long and much memory where there are many joints.
///
/// # Errors
/// [`InputError::TooLarge`].
pub fn check_size_of_robot<'a>(
    tree: &Tree,
    effects: impl IntoIterator<Item = &'a dyn Effect>,
    folds: usize,
    limits: &Limits,
) -> Result<(), InputError> {
    let fewest = fewest_base_parameters(tree);
    let regressor = JointTorqueRegressor::new(tree);
    // A row's last number is the measured torque.
    let mut widths: Vec<usize> = (0..regressor.rows())
        .map(|row| 1 + regressor.row_bodies(row).iter().map(|&body| fewest[body]).sum::<usize>())
        .collect();
    let mut parameters = fewest.iter().sum();
    for effect in effects {
        parameters += effect.parameters().len();
        effect.entries().iter().for_each(|entry| widths[entry.row] += 1);
    }
    check_size(widths.into_iter(), parameters, folds, limits)
}

fn check_size(
    widths: impl ExactSizeIterator<Item = usize>,
    parameters: usize,
    folds: usize,
    limits: &Limits,
) -> Result<(), InputError> {
    let (joints, copies) = (widths.len(), (folds + rayon::current_num_threads()) as u64);
    let bytes = copies * widths.map(|width| (width as u64).pow(2) * size_of::<f64>() as u64).sum::<u64>();
    let most = limits.factor_bytes;
    if bytes > most { Err(InputError::TooLarge { joints, parameters, bytes, most }) } else { Ok(()) }
}

/// A joint that no log moves.
#[derive(Clone, Debug, PartialEq)]
pub struct StillJoint {
    /// Its name.
    pub joint: String,
    /// Its largest travel \[rad, m\].
    pub travel: f64,
    /// Unit of the travel.
    pub unit: &'static str,
    /// Where it stands \[rad, m\].
    pub position: f64,
}

fn not_excited(joints: &[StillJoint]) -> String {
    let [first, others @ ..] = joints else { return String::new() };
    let StillJoint { joint, travel, unit, .. } = first;
    let mut text =
        format!("joint `{joint}` is not excited: it moves by {travel:.1e} {unit} in all training logs");
    let others: Vec<String> = others.iter().map(|other| format!("`{}`", other.joint)).collect();
    if !others.is_empty() {
        text += &format!("; nor is {}", others.join(", nor "));
    }
    text
}

/// What `--hold` takes.
fn held(joints: &[StillJoint]) -> String {
    let held = joints.iter().map(|joint| format!("{}={:.4}", joint.joint, joint.position));
    held.collect::<Vec<String>>().join(",")
}

/// Checks that every joint moves in some log: the parameters of what stands still are unidentifiable.
///
/// # Errors
/// All joints that do not.
pub fn check_excitation(tree: &Tree, train: &[Survey]) -> Result<(), InputError> {
    let still = |index: usize| {
        let body = tree.joint(index);
        let logs = || train.iter().map(|survey| &survey.joints[index]);
        let travel = logs().map(|joint| joint.travel()).fold(0.0, f64::max);
        let noise = logs().map(|joint| joint.position_noise_std).fold(0.0, f64::max);
        (travel < STANDING_STILL.max(TRAVEL_TO_NOISE * noise)).then(|| StillJoint {
            joint: body.joint.clone(),
            travel,
            unit: if body.joint_type == JointType::Prismatic { "m" } else { "rad" },
            position: logs().next().map_or(0.0, |joint| joint.q_mean),
        })
    };
    let joints: Vec<StillJoint> = (0..tree.joint_count()).filter_map(still).collect();
    if joints.is_empty() { Ok(()) } else { Err(InputError::NotExcited { joints }) }
}
