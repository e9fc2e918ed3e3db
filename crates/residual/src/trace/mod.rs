//! Tracing a residual to the physical effects that the model lacks.
//!
//! All candidates' columns stand beside the model's in one pass over the logs; which of them enter is decided
//! on what is left of the rows (`selection`). Then the constants of what was chosen are refined, columns that
//! are made of the model's torque are made again, and all is chosen anew, until nothing changes. In the end,
//! parts of the training motion, foretold from the other parts, say what has a name. Motion held out is for
//! the errors that are reported.

mod bent;
mod between_logs;
mod constants;
mod constants_together;
mod floor;
mod folds;
mod general_forms;
mod harm;
mod hypotheses;
mod impossible;
mod input;
mod interchangeable;
mod kept_columns;
mod leaning;
mod limits;
mod multiples;
mod naming;
mod of_training_logs;
mod order;
mod probe;
mod remaining;
mod residuals;
mod sample;
mod scanned;
mod search;
mod special_cases;
mod stage;
mod starts;
mod textbook;
mod thresholds;
mod tracing;
mod trial;
mod turning;
mod unstructured;
mod variation;
mod verdict;

pub use floor::{noise_floor, noise_floor_at, poses};
pub use input::{HeldModel, TraceInput, TraceOptions};
pub use order::LEAST_RIVAL;
pub use probe::Dependence;
pub use residuals::{Peaks, ResidualShape, ranges_of_residual, residual_shape};
pub use scanned::{ScannedConstant, scanned_constants};
pub use search::trace;
pub use thresholds::{Thresholds, UnknownThreshold};
pub use tracing::{Disturbance, FoundEffect, Ranked, Remaining, RivalEffect, Tracing, Verdict, Withdrawn};
