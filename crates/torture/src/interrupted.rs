//! Runs that are killed, and runs into one folder at the same time: what is in the results then.

mod kills;
mod pairs;
mod subject;

pub use kills::{KillScore, kill};
pub use pairs::{PairScore, pair};
pub use subject::{Subject, SubjectError, subjects};
