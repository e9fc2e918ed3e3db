#![doc = include_str!("../README.md")]
#![warn(missing_docs)]

mod artefacts;
pub mod bspline;
pub mod c3d;
mod calibration;
pub mod embedded;
mod finite_difference;
pub mod human;
mod human_start;
mod marker_settings;
mod point_csv;
mod pose_search;
mod problem;
mod quality;
mod reach;
mod reading;
mod recording;
mod retarget;
mod retarget_error;
mod robot;
mod robot_start;
pub mod solver;
mod start;
mod weights;

pub use artefacts::{Artefact, ArtefactKind};
pub use calibration::Calibration;
pub use finite_difference::backward_differences;
pub use marker_settings::MarkerSettings;
pub use point_csv::read_point_csv;
pub use problem::Problem;
pub use quality::Quality;
pub use reading::read_recording;
pub use recording::{MarkerRecording, RecordingError};
pub use retarget::{Person, RetargetOptions, Retargeted, Retargeter};
pub use retarget_error::RetargetError;
pub use robot::{Arm, ArmMap, BodyPoint, RobotError, RobotMap, RobotModel};
pub use weights::{Cost, Weights};
