//! What can go wrong between a log and a model.

use crate::effect::EffectError;
use phiw_dynamics::DimensionError;
use phiw_regressor::RegressorError;
use phiw_telemetry::LogError;

/// Why a robot could not be identified.
#[derive(Debug, thiserror::Error)]
pub enum IdentificationError {
    /// The log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// The numbers.
    #[error(transparent)]
    Regressor(#[from] RegressorError),
    /// An effect.
    #[error(transparent)]
    Effect(#[from] EffectError),
    /// The log and the robot do not fit each other.
    #[error(transparent)]
    Input(#[from] crate::checks::InputError),
    /// What was said to be known of the bodies contradicts itself.
    #[error(transparent)]
    Consistency(#[from] phiw_consistency::ConsistencyError),
    /// A model file that does not fit the robot.
    #[error("{0}")]
    Model(String),
}

impl From<DimensionError> for IdentificationError {
    fn from(error: DimensionError) -> Self {
        IdentificationError::Regressor(error.into())
    }
}
