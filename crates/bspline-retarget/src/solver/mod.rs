//! Solvers of problem (15): one that knows its structure, and the paper's.

mod arrow;
mod bounded_step;
mod levenberg_marquardt;
mod pattern;
mod quasi_newton;

pub(crate) use arrow::Arrow;
pub use levenberg_marquardt::{Iterations, Solution, Stop, solve};
pub(crate) use pattern::Pattern;
pub use quasi_newton::{QuasiNewton, quasi_newton};
