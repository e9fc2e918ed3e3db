//! Which effects a model lacks, from triangles alone.
//!
//! Plain data go in: for each torque and fold the scalar products of all columns (the model's, and those of
//! every candidate beside them), which columns make a hypothesis, and which hypotheses are one family. What
//! comes out is the set of hypotheses at which one criterion is smallest. Nothing here knows a robot, a log,
//! or an effect by name.
//!
//! The criterion is that of Schwarz (1978) over torques whose noise is unknown and whose rows are correlated,
//! with the price of a choice among many (Chen & Chen 2008): see [`criterion`].

mod admissible;
mod anew;
mod blocks;
mod cholesky;
mod criterion;
mod cross_validation;
mod design_effect;
mod distribution;
mod families;
mod fit;
mod moves;
mod multiple;
mod one_for_several;
mod one_for_two;
mod problem;
mod products;
mod screening;
mod search;
mod two_ends;
mod wald;

#[cfg(test)]
mod tests;

pub(crate) use cross_validation::{Foretelling, Parts};
pub(crate) use distribution::students_tail;
pub(crate) use families::Families;
pub(crate) use fit::Fit;
pub(crate) use multiple::{Multiple, multiples};
pub(crate) use problem::{Hypothesis, Member, Prior, Problem, Torque, Variant};
pub(crate) use products::Products;
pub(crate) use search::{LEAST_STEP, Policy, choose_variants, select};
pub(crate) use two_ends::{Judged, value_in_force};
pub(crate) use wald::certainty;
