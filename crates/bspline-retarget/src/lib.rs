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
mod joint_motion;
mod marker_settings;
pub mod npz;
mod point_csv;
mod pose_search;
mod problem;
mod quality;
mod reach;
mod reading;
mod recording;
mod retarget;
mod retarget_error;
pub mod robot;
mod robot_start;
pub mod solver;
mod start;
mod trc;
mod weights;

pub use calibration::Calibration;
pub use finite_difference::backward_differences;
pub use problem::Problem;
pub use quality::Quality;
pub use retarget::{Person, RetargetOptions, Retargeted, Retargeter};
pub use retarget_error::RetargetError;
pub use weights::{Cost, Weights};

/// Recordings of markers: reading them, and what in them is no measurement of a person.
pub mod markers {
    pub use crate::artefacts::{Artefact, ArtefactKind};
    pub use crate::marker_settings::MarkerSettings;
    pub use crate::point_csv::read_point_csv;
    pub use crate::reading::read_recording;
    pub use crate::recording::{MarkerRecording, RecordingError};
}
