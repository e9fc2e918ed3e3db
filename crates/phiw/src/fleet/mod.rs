//! Logs of a fleet, reduced apart: `phiw plan`, `phiw reduce`, and `phiw identify` of their factors.
//!
//! What must be decided over all logs is decided by `plan`: the survey, the cut-offs, the folds, the
//! constants that are tried. What takes the rows is done by `reduce`, for each log by itself. What is left
//! works on factors, in the order of the plan, so the result is that of one process to the last bit.

mod merge;
mod plan;
mod plan_file;
mod reduce;

pub use merge::{MergeArguments, merge};
pub use plan::{PlanArguments, plan};
pub use plan_file::PlanError;
pub use reduce::{ReduceArguments, reduce};

/// What a command has done.
#[derive(Debug)]
pub struct FleetOutcome {
    /// As text for a terminal.
    pub summary: String,
    /// What a reader should know.
    pub warnings: Vec<String>,
}
