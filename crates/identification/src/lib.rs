#![doc = include_str!("../README.md")]

pub mod accuracy;

mod accumulate;
mod block_source;
mod checks;
mod consistent;
mod design;
mod effect;
mod error;
mod factor_rows;
mod fit;
mod identify;
mod kept_blocks;
mod log_set;
mod model;
mod predict;
mod rates;
mod reference;
mod robot_findings;
mod sample;

pub use accumulate::{Fold, accumulate};
pub use block_source::{BlockSource, try_for_each_block};
pub use checks::{InputError, check_excitation, check_logs, check_size_of_factors, check_size_of_robot};
pub use consistent::{Consistent, ConsistentSettings, Known, consistent, impossible_bodies};
pub use design::{Design, DesignScratch, RowLayout};
pub use effect::{
    Effect, EffectCatalogue, EffectError, EffectParameter, EffectSpec, Entry, Evaluator, JointProperty,
    QuadraticForm, QuadraticTerm,
};
pub use error::IdentificationError;
pub use factor_rows::FactorRows;
pub use fit::{Fit, TorqueError, fit, merge, tells_of_torques, torque_error};
pub use identify::{Data, Identified, Variants, identify};
pub use kept_blocks::KeptBlocks;
pub use log_set::{HELD_OUT_SHARE, LogFile, LogSet, Progress};
pub use model::{
    BodyParameters, ConsistentModel, EffectParameters, Model, NamedParameter, parameter_name, standard_unit,
    with_masses,
};
pub use predict::{Prediction, predict};
pub use reference::ReferenceModel;
pub use robot_findings::robot_findings;
pub use sample::{BlockReference, Needs, Sample};
