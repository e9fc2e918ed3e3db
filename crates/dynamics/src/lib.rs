#![doc = include_str!("../README.md")]

pub mod body_kinematics;
pub mod check;
pub mod dense;
pub mod inertia;
pub mod random_tree;
pub mod scalar;
pub mod urdf;

mod analytic;
mod articulated_body;
mod backend;
mod configuration;
mod derivatives;
mod forward_dynamics;
mod inverse_dynamics;
mod kinematics;
mod mass_matrix;
mod motion;
mod spatial;
mod tree;
mod workspace;
mod world;

pub use analytic::AnalyticBackend;
pub use backend::{BackendError, DynamicsBackend, SimulationBackend};
pub use body_kinematics::BodyKinematics;
pub use check::DimensionError;
pub use derivatives::{DerivativesWorkspace, ForceDerivatives};
pub use spatial::{Mat3, Placement, Spatial, Vec3};
pub use tree::{Body, JointLimits, JointType, Tree};
pub use workspace::Workspace;
pub use world::{Foot, World, WorldError};
