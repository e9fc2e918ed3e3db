#![doc = include_str!("../README.md")]

mod catalogue;
mod columns;
mod coupling;
mod drift;
mod drive;
mod elasticity;
mod external;
mod friction;
mod hysteresis;
mod kind;
mod position;
mod sensing;
mod sentence;

pub use catalogue::Catalogue;
pub use columns::{Formula, OwnTorque, ParameterKind, smooth_sign};
pub use kind::{Constants, EffectKind, JointRange, SignalRanges};
pub use sentence::sentence;
