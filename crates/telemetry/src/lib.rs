#![doc = include_str!("../README.md")]

pub mod clock;
pub mod cutoff;
pub mod findings;
pub mod joint_survey;
pub mod segments;

mod alignment;
mod any_number;
mod block;
mod blocks;
mod check_settings;
mod columns;
mod conditioning;
mod contents;
mod controller_signal;
mod differentiator;
mod error;
mod gap;
mod held_positions;
mod histogram;
mod hold;
mod kernel;
mod log_rows;
mod log_source;
mod map;
mod mending;
mod named_columns;
mod parallel_filter;
mod plan;
mod reader;
mod recording;
mod repeated;
mod samples;
mod session;
mod signal_shape;
mod spectrum;
mod spike;
mod steps;
mod still;
mod stream;
mod survey;
mod turns;
mod without_held;
mod without_stretches;
mod writer;
mod zero_rows;

pub use block::{Block, Signals};
pub use columns::TorqueColumns;
pub use conditioning::{Conditioning, ConditioningOptions, WARM_UP_S};
pub use contents::LogContents;
pub use controller_signal::ControllerSignal;
pub use error::LogError;
pub use log_source::LogSource;
pub use map::{LogFacts, LogMap, LogPart, MapError, Payload};
pub use named_columns::NamedColumns;
pub use phiw_log_formats::{FormatError, is_guarded, looks_like};
pub use plan::LogPlan;
pub use recording::Recording;
pub use samples::{Sample, samples};
pub use session::{Session, arrange_session};
pub use stream::{StreamSummary, stream};
pub use survey::{Survey, survey};
pub use writer::{LogColumns, LogWriter};
pub use zero_rows::ZeroRows;

/// Zero-phase low-passes, and the derivatives that a smoothing kernel gives.
pub mod filter {
    pub use crate::kernel::{LowPass, SmoothingKernel};
    pub use crate::parallel_filter::{FilterScratch, ParallelFilter};
}
