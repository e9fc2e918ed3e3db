#![doc = include_str!("../README.md")]

mod model;
mod write;

pub use model::{FixedTendon, JointModel, RobotModel, impossible_bodies};
pub use write::{MjcfError, comment, write_mjcf};
