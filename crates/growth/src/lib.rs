#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod candidates;
mod completion;
mod constants;
mod contest;
mod hypothesis;
mod score_test;
mod trace_residual;
mod whiteness;

pub use contest::{Contender, ScoreTestSettings, Winner};
pub use hypothesis::Hypothesis;
pub use score_test::ScoreTest;
pub use trace_residual::{SessionSettings, TraceResidual};
pub use whiteness::WhitenessSettings;
