#![doc = include_str!("../README.md")]

mod base_parameters;
mod error;
pub mod factor;
mod joint_torque;
pub mod least_squares;

pub use base_parameters::{BaseParameters, BaseParametersOptions, Regrouping, parameter_scales};
pub use error::RegressorError;
pub use joint_torque::{JointTorqueRegressor, RegressorScratch};
