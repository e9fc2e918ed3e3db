//! Whether logs and a robot fit each other, before anything is computed.

use phiw_dynamics::{JointType, Tree};
use phiw_telemetry::Survey;
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
    /// A joint that no log moves.
    #[error(
        "joint `{joint}` is not excited: it moves by {travel:.1e} {unit} in all training logs; \
         move it, or hold it with --hold {joint}={position:.4}"
    )]
    NotExcited {
        /// The joint.
        joint: String,
        /// Its largest travel \[rad, m\].
        travel: f64,
        /// Unit of the travel.
        unit: &'static str,
        /// Where it stands \[rad, m\].
        position: f64,
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
    /// Nothing moves in what is held out.
    #[error(
        "{held_out}: no joint moves there, so nothing can be said of the model's error on motion held out; \
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

/// Checks what only logs and robot together can tell: degrees for radians, torques that are missing.
///
/// # Errors
/// The first that is wrong, by log and joint.
pub fn check_logs(tree: &Tree, train: &[Survey], validate: &[Survey]) -> Result<(), InputError> {
    for survey in train.iter().chain(validate) {
        for (index, joint) in survey.joints.iter().enumerate() {
            let body = tree.joint(index);
            let (lower, upper) = (body.limits.lower, body.limits.upper);
            let largest = joint.q_min.abs().max(joint.q_max.abs());
            // A joint turns three times round at the most in what is identified here; degrees exceed that by far.
            let limit = lower.abs().max(upper.abs());
            let limit = if limit.is_finite() && upper > lower { limit } else { std::f64::consts::TAU };
            let beyond = largest > 6.0 * limit && largest > 10.0;
            if body.joint_type != JointType::Prismatic && beyond && largest.to_radians() < 1.5 * limit {
                let (path, joint_name) = (survey.path.clone(), joint.name.clone());
                let (min, max) = (joint.q_min, joint.q_max);
                return Err(InputError::Degrees { path, joint: joint_name, min, max, lower, upper });
            }
            if joint.torque.as_ref().is_some_and(|torque| torque.all_zero()) {
                return Err(InputError::ZeroTorque { path: survey.path.clone(), joint: joint.name.clone() });
            }
        }
    }
    Ok(())
}

/// Checks that every joint moves in some log: what stands still tells nothing of itself.
///
/// # Errors
/// The first joint that does not.
pub fn check_excitation(tree: &Tree, train: &[Survey]) -> Result<(), InputError> {
    for index in 0..tree.joint_count() {
        let body = tree.joint(index);
        let logs = || train.iter().map(|survey| &survey.joints[index]);
        let travel = logs().map(|joint| joint.travel()).fold(0.0, f64::max);
        let noise = logs().map(|joint| joint.position_noise_std).fold(0.0, f64::max);
        if travel < STANDING_STILL.max(TRAVEL_TO_NOISE * noise) {
            let unit = if body.joint_type == JointType::Prismatic { "m" } else { "rad" };
            let position = logs().next().map_or(0.0, |joint| joint.q_mean);
            return Err(InputError::NotExcited { joint: body.joint.clone(), travel, unit, position });
        }
    }
    Ok(())
}
