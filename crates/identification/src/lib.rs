#![doc = include_str!("../README.md")]

pub mod accuracy;

mod accumulate;
mod block_source;
mod checks;
mod covariance;
mod design;
mod effect;
mod error;
mod factor_rows;
mod fit;
mod held_joints;
mod identify;
mod kept_blocks;
mod log_set;
mod model;
mod model_sources;
mod predict;
mod prediction_errors;
mod rates;
mod reference;
pub mod reproduction;
mod robot_findings;
mod sample;

pub use accumulate::{Fold, accumulate};
pub use block_source::{BlockSource, try_for_each_block};
pub use checks::{InputError, check_excitation, check_logs, check_size_of_factors, check_size_of_robot};
pub use covariance::{Covariance, CovarianceSource};
pub use design::{Design, DesignScratch, RowLayout};
pub use effect::{
    Effect, EffectCatalogue, EffectError, EffectParameter, EffectSpec, Entry, Evaluator, JointProperty,
};
pub use error::IdentificationError;
pub use factor_rows::FactorRows;
pub use fit::{Fit, TorqueError, fit, merge, tells_of_torques, torque_error};
pub use held_joints::HeldJoints;
pub use identify::{Data, Identified, Variants, identify};
pub use kept_blocks::KeptBlocks;
pub use log_set::{HELD_OUT_SHARE, LogFile, LogSet, Progress};
pub use model::{
    BodyParameters, EffectParameters, Model, NamedParameter, parameter_name, standard_unit, with_masses,
};
pub use model_sources::{BaseMap, DataFingerprint, DataRole};
pub use predict::{EffectShare, Prediction, PredictionParts, predict, predict_in_parts};
pub use prediction_errors::{BAND_95, PredictionErrors};
pub use reference::ReferenceModel;
pub use robot_findings::robot_findings;
pub use sample::{BlockReference, Needs, Sample};
