//! Least squares over rows that come in groups: one group for each torque, each with its own columns and its
//! own noise.

mod grouped;
mod robust;
mod weighted;

pub use grouped::{Group, GroupedFactor};
pub use robust::{RobustFit, RobustOptions, robust_least_squares};
pub use weighted::{WeightedSolution, ordinary_least_squares, weighted_least_squares};
