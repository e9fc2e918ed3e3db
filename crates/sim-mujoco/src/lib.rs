#![doc = include_str!("../README.md")]

mod backend;
mod base;
mod body_kinematics;
mod error;
mod inertial;
mod layout;
mod library;
mod mjcf;
mod simulation;

pub use backend::{Integrator, MujocoBackend};
pub use error::MujocoError;
pub use library::{LIBRARY_FILE_NAME, LIBRARY_VARIABLE, VERSION, find_library, library_cache_path};
