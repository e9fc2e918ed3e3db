//! Φ without Φ: the triangular factor R of \[Φ f\], streamed.
//!
//! Everything that a consumer of Φ needs (least squares, cond, standard deviations, adding or dropping
//! columns, the price of one more motion) is in R. Rows stream into R in blocks ([`FactorBuilder`]); two
//! factors merge by one small QR, in any order ([`Factor::merge`]).
//!
//! A builder gives a [`Factor`], and what makes a new factor of old ones pushes them through a builder:
//! `builder.rs` and `triangle.rs` name each other.

mod builder;
mod leave_one_out;
mod queries;
mod substitution;
mod triangle;

pub use builder::FactorBuilder;
pub use leave_one_out::leave_one_out;
pub use queries::{ROUNDING, Solution};
pub use substitution::{solve_lower, solve_upper};
pub use triangle::Factor;
