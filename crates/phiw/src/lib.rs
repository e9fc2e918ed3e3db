#![doc = include_str!("../README.md")]

pub mod analysis;
pub mod arguments;
pub mod bandwidth;
pub mod check;
pub mod console;
mod date;
mod draws;
mod error;
pub mod explain;
mod explain_page;
mod exported;
mod fingerprint;
pub mod identified_mjcf;
pub mod identified_urdf;
pub mod identify;
mod input;
mod model_file;
mod model_use;
pub mod next;
mod not_identified;
pub mod output;
pub mod page;
mod parameters;
pub mod possible_bodies;
pub mod predict;
pub mod report_json;
pub mod retarget;
pub mod session;
pub mod simulate;
pub mod summary;
pub mod threads;
pub mod traces;
pub mod warnings;

pub use error::Error;
