#![doc = include_str!("../README.md")]

mod bristles;
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
mod friction_over_position;
mod hysteresis;
mod kind;
mod load_friction;
mod logged_torque;
mod mechanism;
mod position;
mod position_map;
mod sensing;
mod sign;
mod torque_gain;
mod torque_zero;
mod trigonometric_spline;
mod viscous_and_dry;

pub use bristles::{BRISTLE_WAYS, LONGEST_BRISTLES};
pub use catalogue::{Catalogue, sentence};
pub use columns::{Formula, OwnTorque, ParameterKind};
pub use fitted::FittedEffect;
pub use kind::{Constants, EffectKind, JointRange, Refinement, Signal, SignalRanges, SpecialCase};
pub use logged_torque::smoothing_corner_hz;
pub use mechanism::{Mechanism, Mechanisms, ServoFriction};
pub use sign::smooth_sign;
pub use torque_zero::{TorqueZeros, torque_zeros};
