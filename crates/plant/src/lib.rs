#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod active_run;
mod controller;
mod effect;
mod error;
mod friction;
mod history;
mod joint_drive;
mod mechanism;
mod numbers;
mod plant;
mod presliding;
mod reference;
mod robot_as_built;
mod root;
mod run;
mod sensors;
mod standing;
mod step_solver;

pub use controller::{
    ComputedTorque, GainSettings, Gains, RigidBodyModel, TorqueModel, apparent_inertia,
    least_apparent_inertia,
};
pub use effect::{Coupling, PlantEffect};
pub use error::PlantError;
pub use friction::Friction;
pub use history::History;
pub use mechanism::Mechanism;
pub use plant::{Plant, PlantSetup, Timing};
pub use presliding::Presliding;
pub use reference::{FadedSines, MultiSine, Reference};
pub use run::{PlantRun, Reaction};
pub use sensors::{Clock, Derivatives, Sensors};
