//! Tracing a residual to the physical effect that the model lacks.
//!
//! The loop: fit, ask whether there is structure, try every candidate of the catalogue by refitting
//! everything with it, take the simplest that explains on motion held out, refine its constants, and begin
//! again, until nothing that is left has a name.

mod candidate;
mod choice;
mod evidence;
mod floor;
mod input;
mod probe;
mod refine;
mod residuals;
mod revision;
mod screening;
mod search;
mod signal_shapes;
mod stability;
mod stage;
mod tracing;
mod verdict;

pub use choice::LEAST_RIVAL;
pub use floor::noise_floor;
pub use input::{HeldModel, TraceInput, TraceOptions};
pub use probe::Dependence;
pub use residuals::{ResidualShape, residual_shape};
pub use search::trace;
pub use tracing::{FoundEffect, Ranked, Remaining, RivalEffect, Tracing, Verdict};
