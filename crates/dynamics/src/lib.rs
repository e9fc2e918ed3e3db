#![doc = include_str!("../README.md")]

mod analytic;
mod backend;
mod body_kinematics;
mod configuration;
mod forward_dynamics;
mod inertia;
mod inverse_dynamics;
mod kinematics;
mod ldl;
mod mass_matrix;
mod motion;
pub mod random_tree;
mod scalar;
mod spatial;
mod tree;
pub mod urdf;
mod workspace;
mod world;

pub use analytic::AnalyticBackend;
pub use backend::{BackendError, DynamicsBackend, SimulationBackend};
pub use body_kinematics::{BodyJoint, BodyKinematics, MotionSubspace};
pub use inertia::Inertia;
pub use motion::BodyMotion;
pub use scalar::{Dual, Lanes, Scalar};
pub use spatial::{Mat3, Placement, Spatial, Vec3};
pub use tree::{Body, InertialParameters, JointType, Limits, PARAMETER_NAMES, PARAMETERS_PER_BODY, Tree};
pub use workspace::Workspace;
pub use world::{Foot, World, WorldError};

/// A slice whose length does not match the robot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} has {found} elements, but this robot needs {expected}")]
pub struct DimensionError {
    /// Which argument.
    pub what: &'static str,
    /// Its length.
    pub found: usize,
    /// The length that it must have.
    pub expected: usize,
}

/// `Ok` if `found` is `expected`, else an error that names `what`.
pub fn check_size(what: &'static str, found: usize, expected: usize) -> Result<(), DimensionError> {
    if found == expected { Ok(()) } else { Err(DimensionError { what, found, expected }) }
}
