#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

pub mod constraint;
pub mod end;
pub mod growth;
pub mod motion;
pub mod planner;
pub mod relaxation;
pub mod selection;
pub mod standing;

mod curriculum;
mod error;
mod experiment;
mod random;
mod record;

pub use curriculum::{Curriculum, CurriculumSettings, unreliable_model};
pub use error::CurriculumError;
pub use experiment::{Experiment, KeptBalance, Trial};
pub use record::{CurriculumRun, IterationRecord};
