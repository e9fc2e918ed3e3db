//! Tracing a residual to the physical effect that the model lacks.
//!
//! The loop: fit, ask whether there is structure, try every candidate of the catalogue by refitting everything with it, take the
//! simplest that explains on motion held out, refine its constants, and begin again, until nothing that is left has a name.

mod candidate;
mod evidence;
mod floor;
mod probe;
mod residuals;
mod search;
mod stage;

pub use floor::noise_floor;
pub use probe::Dependence;
pub use residuals::{ResidualShape, residual_shape};
pub use search::{
    FoundEffect, HeldModel, Ranked, Remaining, RivalEffect, TraceInput, TraceOptions, Tracing, Verdict, trace,
};
