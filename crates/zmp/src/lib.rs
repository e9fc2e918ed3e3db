#![doc = include_str!("../README.md")]

mod balance;
mod bounds;
mod center_of_mass;
mod error;
mod feet;
mod motion_balance;
mod rows;
mod support_polygon;
mod workspace;
mod zero_moment_point;

pub use balance::Balance;
pub use bounds::Bounds;
pub use center_of_mass::CenterOfMass;
pub use error::SupportError;
pub use feet::{FeetError, feet_from_toml};
pub use motion_balance::{MotionBalance, Stance, WorstZmp};
pub use rows::{BalanceRows, standard_deviation};
pub use support_polygon::{NearestEdge, SupportPolygon, SureMargin};
pub use workspace::{ZmpWorkspace, standing_parameters};
pub use zero_moment_point::{ZmpModel, multi_body_zmp, point_mass_zmp};
