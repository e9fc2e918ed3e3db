//! What a plant can not be made of, or can not do.

use phiw_dynamics::{BackendError, DimensionError, WorldError};

/// Why a plant could not be built or run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlantError {
    /// The backend failed.
    #[error("{t_s:.4} s after the motion's start: {source}")]
    Backend {
        /// Time since the motion's start \[s\]; negative while the robot settles.
        t_s: f64,
        /// What it reports.
        source: BackendError,
    },
    /// The backend could not be built.
    #[error("the backend for the robot as built: {0}")]
    Build(BackendError),
    /// A list does not fit the robot.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// The world does not fit the robot.
    #[error(transparent)]
    World(#[from] WorldError),
    /// An effect names a joint or a body that the robot has not.
    #[error("{kind} acts on {what} {index}, but the robot has {count}")]
    NoSuchPlace {
        /// The effect's name.
        kind: &'static str,
        /// `"joint"` or `"body"`.
        what: &'static str,
        /// The index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A number lies outside what makes sense.
    #[error("{what} is {value}: it must be {must_be}")]
    Value {
        /// Which number.
        what: String,
        /// Its value.
        value: f64,
        /// What it must be.
        must_be: &'static str,
    },
    /// Actuator noise is a share of the effort limit.
    #[error("{joint} has no effort limit, which the actuator's noise is a share of: give it one in the URDF")]
    NoEffortLimit {
        /// The joint.
        joint: String,
    },
    /// A rotor behind a spring must have inertia.
    #[error("{joint} is flexible, so its rotor moves by itself: give it a rotor inertia > 0 in the world")]
    FlexibleWithoutRotor {
        /// The joint.
        joint: String,
    },
    /// Two flexible transmissions on one joint.
    #[error("{joint} has two flexible transmissions: make them one")]
    TwiceFlexible {
        /// The joint.
        joint: String,
    },
    /// A backend takes joint torques only.
    #[error(
        "an external force would push the floating base too, which a backend has no way to do: use a fixed base"
    )]
    ForceOnFloatingBase,
    /// The reference gave a number that is NaN or infinite.
    #[error("the reference at {t_s} s has an element that is not a finite number")]
    Reference {
        /// The time asked for \[s\].
        t_s: f64,
    },
}

/// `Ok` if `value` is finite and satisfies `test`.
pub(crate) fn check_value(
    what: impl FnOnce() -> String,
    value: f64,
    must_be: &'static str,
    test: impl FnOnce(f64) -> bool,
) -> Result<(), PlantError> {
    if value.is_finite() && test(value) {
        Ok(())
    } else {
        Err(PlantError::Value { what: what(), value, must_be })
    }
}
