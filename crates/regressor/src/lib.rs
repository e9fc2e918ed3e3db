#![doc = include_str!("../README.md")]

mod base_parameters;
mod error;
pub mod factor;
mod fewest_parameters;
pub mod information;
mod joint_torque;
pub mod least_squares;

pub use base_parameters::{BaseParameters, BaseParametersOptions, Regrouping, parameter_scales};
pub use error::RegressorError;
pub use fewest_parameters::fewest_base_parameters;
pub use joint_torque::{JointTorqueRegressor, RegressorScratch};
