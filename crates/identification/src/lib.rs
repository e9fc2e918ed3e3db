#![doc = include_str!("../README.md")]

pub mod accuracy;
pub mod bandwidth;
pub mod block_source;
pub mod checks;
pub mod consistent;
pub mod design;
pub mod effect;
pub mod model;

mod accumulate;
mod consistent_model;
mod conventions;
mod covariance;
mod disturbances;
mod drawn;
mod effect_selector;
mod error;
mod factor_rows;
mod filtered_rows;
mod fit;
mod free_constants;
pub mod held_joints;
mod held_out_change;
mod identify;
mod jackknife;
mod kept_blocks;
mod knowledge;
mod known_payload;
mod log_change;
mod log_file;
mod log_set;
mod logged_factors;
mod mirrored;
mod model_sources;
mod own_torque;
mod pairs;
mod predict;
mod prediction_errors;
mod rates;
mod reference;
pub mod reproduction;
mod rests;
mod rivals;
mod robot_findings;
mod sample;
pub mod shard;
pub mod told;
mod variants;

pub use accumulate::Fold;
pub use block_source::{BlockSource, EveryNth};
pub use design::Design;
pub use effect::{Effect, EffectCatalogue, EffectSpec};
pub use error::IdentificationError;
pub use identify::{Data, Identified, RowsAtRest, Variants, WithRests, identify, identify_with_rests};
pub use kept_blocks::KeptBlocks;
pub use log_file::{Interruption, LogFile, Progress};
pub use log_set::LogSet;
pub use model::Model;
pub use predict::{Prediction, predict};

/// The steps of [`identify()`] by themselves: blocks to factors, factors to parameters, and their error on
/// the folds held out.
pub mod fitting {
    pub use crate::accumulate::{FoldFactors, Rests, accumulate, accumulate_folds};
    pub use crate::disturbances::{Disturbance, DisturbanceSettings, disturbances};
    pub use crate::factor_rows::FactorRows;
    pub use crate::filtered_rows::{FilteredRows, map_filtered_rows};
    pub use crate::fit::{Fit, TorqueError, fit, merge, torque_error, torques_with_enough_rows};
    pub use crate::free_constants::{ByConstant, FreeConstant, free_constants};
    pub use crate::held_out_change::{HeldOutChange, held_out_change};
    pub use crate::identify::Declared;
    pub use crate::log_change::{LogChange, log_changes, odd_log};
    pub use crate::own_torque::{OwnTorqueFit, fit_with_own_torque};
}

/// What a model's torques are worth: the parameters' covariance, each effect's share, bands, and the errors
/// summed up.
pub mod prediction {
    pub use crate::covariance::{Covariance, CovarianceSource};
    pub use crate::predict::{EffectShare, PredictionParts, predict_in_parts};
    pub use crate::prediction_errors::{BAND_95, PredictionErrors};
}
