//! What can go wrong in an estimation.

use phiw_dynamics::DimensionError;
use phiw_identification::{EffectError, IdentificationError};
use phiw_regressor::RegressorError;

/// Why parameters can not be estimated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EstimationError {
    /// A log lacks what the estimate needs.
    #[error("the motion as measured: {0}")]
    Log(&'static str),
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
    /// A slice does not fit the robot.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// An effect can not be built.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The logs can not be reduced.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// The linear algebra failed.
    #[error(transparent)]
    Regressor(#[from] RegressorError),
}
