#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod controller;
mod kept_balance;
mod measuring;
mod simulated_robot;
mod standing_controller;
mod standing_robot;

pub use controller::{Controller, FeedForward};
pub use measuring::{Encoders, KnownOfController, LoggedTorque, Measuring};
pub use simulated_robot::{BuildBackend, SimulatedRobot, Stillness};
pub use standing_controller::StandingFeedForward;
pub use standing_robot::{StandingRobot, WrenchNoise};
