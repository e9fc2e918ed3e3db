//! A person as measured in a static trial.

use crate::human::Placed;
use std::collections::BTreeMap;

/// A person as measured in a static trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibration {
    /// Where markers sit on their segments.
    pub markers: BTreeMap<String, Placed>,
    /// The lengths ξ^h \[m\], in the order of [`crate::human::SEGMENT_PARAMETERS`].
    pub lengths_m: Vec<f64>,
    /// Coordinates of the pose by name \[rad, m\].
    pub pose: BTreeMap<String, f64>,
    /// RMS distance of the markers that the map places from where they are \[m\].
    pub marker_rms_m: f64,
}
