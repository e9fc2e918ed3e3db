//! Solvers of problem (15): one that knows its structure, and the paper's.

mod arrow;
mod levenberg_marquardt;
mod quasi_newton;

pub(crate) use arrow::Arrow;
pub use levenberg_marquardt::{Iterations, Solution, Stop, solve};
pub use quasi_newton::{QuasiNewton, quasi_newton};
