#![doc = include_str!("../README.md")]

mod backend;
mod base;
mod body_kinematics;
mod error;
mod inertial;
mod integrator;
mod layout;
mod library;
mod mjcf;
mod mjcf_file;
mod simulation;

pub use backend::MujocoBackend;
pub use error::MujocoError;
pub use integrator::Integrator;
pub use library::{LIBRARY_FILE_NAME, LIBRARY_VARIABLE, VERSION, find_library, library_cache_path};
pub use mjcf_file::MjcfFile;
