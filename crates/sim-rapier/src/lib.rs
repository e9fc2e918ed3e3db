#![doc = include_str!("../README.md")]

mod articulation;
mod asked_wrench;
mod backend;
mod base_frame;
mod body_kinematics;
mod floor;
mod mass_properties;
mod probe;

pub use backend::{DEFAULT_SOLVER_ITERATIONS, RapierBackend};

use phiw_dynamics::BackendError;

const NAME: &str = "rapier";

fn error(message: impl Into<String>) -> BackendError {
    BackendError::Backend { backend: NAME, message: message.into() }
}
