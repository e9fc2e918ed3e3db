//! B-splines: bases (14) and curves, with analytic derivatives of any order.

mod basis;
mod curve;

pub use basis::{Basis, BasisError};
pub use curve::{Curve, CurveError};
