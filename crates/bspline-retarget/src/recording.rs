//! Marker recordings, whatever file they come from.

use crate::c3d::C3dError;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Positions of named markers over time.
#[derive(Clone, Debug, PartialEq)]
pub struct MarkerRecording {
    /// Frames per second \[Hz\].
    pub rate_hz: f64,
    /// The markers' labels, as the file has them.
    pub labels: Vec<String>,
    /// Position of each marker \[m\], frame by frame; a missing one is NaN in all three coordinates.
    pub positions_m: Vec<[f64; 3]>,
}

impl MarkerRecording {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.positions_m.len().checked_div(self.labels.len()).unwrap_or(0)
    }
    /// Time from the first frame to the last \[s\].
    pub fn duration_s(&self) -> f64 {
        self.frames().saturating_sub(1) as f64 / self.rate_hz
    }
    /// Position of a marker in a frame \[m\].
    pub fn position_m(&self, frame: usize, marker: usize) -> [f64; 3] {
        self.positions_m[frame * self.labels.len() + marker]
    }

    /// The marker of this name: as it is, or behind a subject's prefix (`Anna:LSHO`) that no two markers
    /// share.
    pub fn marker(&self, name: &str) -> Option<usize> {
        if let Some(index) = self.labels.iter().position(|label| label == name) {
            return Some(index);
        }
        let mut behind_prefix = self
            .labels
            .iter()
            .enumerate()
            .filter(|(_, label)| label.rsplit_once(':').is_some_and(|(_, own)| own == name));
        let (index, _) = behind_prefix.next()?;
        behind_prefix.next().is_none().then_some(index)
    }

    /// Whether a marker is seen in any frame.
    pub fn is_ever_seen(&self, marker: usize) -> bool {
        (0..self.frames()).any(|frame| self.position_m(frame, marker)[0].is_finite())
    }

    /// Share of marker positions that are missing, 0 to 1.
    pub fn missing_share(&self) -> f64 {
        let missing = self.positions_m.iter().filter(|position| !position[0].is_finite()).count();
        missing as f64 / self.positions_m.len().max(1) as f64
    }
}

/// Rates that cameras have \[Hz\]. Any other is a mistake of whoever wrote the file, and would stretch the
/// motion with it.
pub(crate) const RATES_HZ: RangeInclusive<f64> = 1.0..=100_000.0;

/// Length of a unit \[m\].
pub(crate) fn metres(units: &str) -> Option<f64> {
    match units.trim().to_ascii_lowercase().as_str() {
        "m" | "meter" | "meters" | "metre" | "metres" => Some(1.0),
        "dm" => Some(0.1),
        "cm" => Some(0.01),
        "mm" | "millimeter" | "millimeters" | "millimetre" | "millimetres" => Some(0.001),
        "in" | "inch" | "inches" => Some(0.0254),
        "ft" | "feet" => Some(0.3048),
        _ => None,
    }
}

/// Why a recording can not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The system does not give the file out.
    #[error("{}: {}", path.display(), if source.kind() == std::io::ErrorKind::NotFound {
        "no such file; check the path".to_owned()
    } else {
        format!("can't be read: {source}")
    })]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// It is no sound C3D file.
    #[error("{}: {source}", path.display())]
    C3d {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: C3dError,
    },
    /// The markers are no person's.
    #[error(
        "{}: the markers span {extent_m:.3e} m, a person's {} to {} m: the unit is another; set `units` in the map{}",
        path.display(), person_m.start(), person_m.end(), fitting_unit(*extent_m, person_m)
    )]
    Extent {
        /// The file.
        path: PathBuf,
        /// The box around all markers, from corner to corner, median over the frames \[m\].
        extent_m: f64,
        /// A person's \[m\].
        person_m: RangeInclusive<f64>,
    },
    /// It is no sound BVH, TRC or npz.
    #[error("{}: {what}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and the mend.
        what: String,
    },
    /// It is no table of points.
    #[error("{}: {what}", path.display())]
    Csv {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and the mend.
        what: String,
    },
}

/// The unit in which the numbers would be a person's, in words.
fn fitting_unit(extent_m: f64, person_m: &RangeInclusive<f64>) -> String {
    let factors = [(1000.0, "m, not mm"), (0.001, "mm, not m"), (100.0, "m, not cm"), (0.01, "cm, not m")];
    factors
        .iter()
        .find(|(factor, _)| person_m.contains(&(extent_m * factor)))
        .map_or_else(String::new, |(_, words)| format!(" (as if they were in {words})"))
}
