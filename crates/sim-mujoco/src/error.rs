//! Why there is no simulator.
//!
//! It names the library's version and variable, which `library.rs` owns, and `library.rs` returns it: a
//! message is no use without them.

use phiw_dynamics::{BackendError, WorldError};
use std::path::PathBuf;

/// The name under which the backend appears in messages.
pub(crate) const NAME: &str = "MuJoCo";

/// Why a robot can not be simulated with MuJoCo.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MujocoError {
    /// The library is nowhere.
    #[error(
        "MuJoCo {version} is not found: run `cargo xtask mujoco` to fetch it, or set {variable}; tried:{tried}",
        version = crate::VERSION,
        variable = crate::LIBRARY_VARIABLE
    )]
    NotFound {
        /// The places, one on each line, with what is wrong there.
        tried: String,
    },
    /// A library that was asked for can not be used.
    #[error("{} can not be used as MuJoCo: {reason}", path.display())]
    Unusable {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// The library says the right version, but its structures are not that version's.
    #[error("the MuJoCo library is not what its version says: {what} is not where it should be")]
    Layout {
        /// The field that is misplaced.
        what: &'static str,
    },
    /// The robot has `<mimic>` joints.
    #[error(
        "{joint} follows another joint (<mimic>), which MuJoCo holds by a soft constraint only: hold it, or simulate with another backend"
    )]
    Mimic {
        /// The joint that follows.
        joint: String,
    },
    /// A link's parameters have no centre of mass.
    #[error(
        "the inertial parameters of {link} are those of no body: the mass is {mass} kg, but the first \
         moment is not zero, so that there is no centre of mass"
    )]
    NoCenterOfMass {
        /// The link.
        link: String,
        /// Its mass \[kg\].
        mass: f64,
    },
    /// The world does not fit the robot.
    #[error(transparent)]
    World(#[from] WorldError),
    /// MuJoCo refuses the model.
    #[error("MuJoCo refuses the robot: {message}")]
    Refused {
        /// What it says.
        message: String,
    },
}

impl From<MujocoError> for BackendError {
    fn from(error: MujocoError) -> Self {
        match error {
            MujocoError::World(error) => error.into(),
            other => BackendError::Backend { backend: NAME, message: other.to_string() },
        }
    }
}
