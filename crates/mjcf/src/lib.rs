#![doc = include_str!("../README.md")]

mod model;
mod read;
mod turning;
mod write;

pub use model::{FixedTendon, JointModel, RobotModel, impossible_bodies};
pub use read::{Loader, MjcfReadError, MjcfReading, is_mjcf, read_mjcf, read_mjcf_with};
pub use write::{MjcfError, comment, write_mjcf};
