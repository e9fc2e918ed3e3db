#![doc = include_str!("../README.md")]

mod expression;
mod mathematics;
mod program;
mod source;
mod symbol;

pub use expression::{Expression, Function, JointTorque};
pub use program::CodegenError;
pub use source::{Model, write_c, write_rust};
