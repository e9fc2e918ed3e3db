#![doc = include_str!("../README.md")]

mod catalogue;
mod columns;
mod coupling;
mod declaration;
mod drift;
mod drive;
mod efficiency;
mod elasticity;
mod external;
mod fitted;
mod friction;
mod hysteresis;
mod kind;
mod mechanism;
mod position;
mod position_map;
mod sensing;
mod sign;
mod smoothing;
mod trigonometric_spline;

pub use catalogue::{Catalogue, sentence};
pub use columns::{Formula, OwnTorque, ParameterKind};
pub use fitted::FittedEffect;
pub use kind::{Constants, EffectKind, JointRange, Signal, SignalRanges};
pub use mechanism::{Mechanism, Mechanisms, ServoFriction};
pub use sign::smooth_sign;
pub use smoothing::smoothing_corner_hz;
