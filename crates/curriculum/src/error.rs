//! What can go wrong in a curriculum.

use phiw_dynamics::DimensionError;
use phiw_estimation::EstimationError;
use phiw_identification::IdentificationError;
use phiw_identification::effect::EffectError;
use phiw_regressor::RegressorError;
use phiw_telemetry::LogError;

/// Why an iteration can not be done.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CurriculumError {
    /// A motion is not one.
    #[error("the motion {name}: {problem}")]
    Motion {
        /// Its name.
        name: String,
        /// What is wrong with it, and how to mend it.
        problem: String,
    },
    /// There is nothing to choose from.
    #[error("there are no motions to choose from: retarget some first (phiw retarget)")]
    NoMotions,
    /// A number lies outside what makes sense.
    #[error("{what} is {value}: it must be {must_be}")]
    Value {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        must_be: &'static str,
    },
    /// Every motion is expected to topple the robot.
    #[error(
        "none of the {motions} motions keeps the ZMP over the support under the present estimate: the \
         safest, {safest}, leaves it by {:.1} mm; {safer}",
        1e3 * outside_m
    )]
    NothingSafe {
        /// How many there are.
        motions: usize,
        /// The one that comes nearest.
        safest: String,
        /// How far its ZMP may be outside \[m\], the uncertainty included where it counts.
        outside_m: f64,
        /// Which safer motion would do.
        safer: String,
    },
    /// The robot has fallen on every motion.
    #[error(
        "the robot has fallen on all of the {motions} motions: add calmer motions, or start from a better model"
    )]
    FellOnAll {
        /// How many there are.
        motions: usize,
    },
    /// Noise is stated twice.
    #[error(
        "the estimator counts on a noise of {assumed} N·m (N) in the torque of {joint}, where the \
         experiment makes {made}: give it the experiment's own torque_noise()"
    )]
    Noise {
        /// The joint.
        joint: String,
        /// Standard deviation that the experiment makes \[N·m, N\].
        made: f64,
        /// Standard deviation that the estimator assumes \[N·m, N\].
        assumed: f64,
    },
    /// A saved run is not of this robot or these motions.
    #[error(
        "the saved run does not fit: {0}; use the robot and the motions that it was begun with, or begin anew"
    )]
    SavedRun(String),
    /// A slice does not fit the robot.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// An effect can not be built.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The estimate failed.
    #[error(transparent)]
    Estimation(#[from] EstimationError),
    /// A fit failed.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// The robot cannot be run.
    #[error(transparent)]
    Experiment(Box<dyn std::error::Error + Send + Sync>),
    /// A log can not be conditioned.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The linear algebra failed.
    #[error(transparent)]
    Regressor(#[from] RegressorError),
}

impl CurriculumError {
    /// Why an [`crate::Experiment`] could not be done.
    pub fn of_experiment(error: impl std::error::Error + Send + Sync + 'static) -> Self {
        CurriculumError::Experiment(Box::new(error))
    }
}
