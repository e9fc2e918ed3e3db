//! Small dense linear algebra, in one place: a scalar product and Cholesky's factor with its triangular
//! solves.
//!
//! The order of operations is fixed, so that results are the same on every machine and for every number of
//! threads. Matrices beyond some tens of rows are faer's; the factors of \[Φ f\] are the `regressor` crate's.

mod cholesky;
mod dot;
pub(crate) mod ldl;

pub use cholesky::Cholesky;
pub use dot::dot;
