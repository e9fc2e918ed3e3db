//! The marker map: which marker sits where, in TOML.

use super::skeleton::Segment;
use crate::recording::{MarkerRecording, metres};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Which marker sits on which segment, and what is known of where.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MarkerMap {
    /// Name of the map.
    pub name: String,
    /// Unit of length of the recordings (m, dm, cm, mm, in, ft), if they do not say it or say it wrong. A CSV
    /// is in metres without it.
    #[serde(default)]
    pub units: Option<String>,
    /// How names of static trials end (`_static`); they calibrate the recordings that share the name before
    /// it.
    #[serde(default)]
    pub static_suffix: Option<String>,
    /// Standard deviation \[m\] of markers from where the map or the static trial puts them on their segment;
    /// with more than zero their positions are estimated jointly with the motion.
    #[serde(default)]
    pub marker_spread_m: f64,
    /// How joints move, by segment; `free` where nothing is said.
    #[serde(default)]
    pub joints: BTreeMap<String, JointMode>,
    /// Markers by segment.
    pub segments: BTreeMap<String, SegmentMarkers>,
    /// Points of the robot, where they should not be found from its shape.
    #[serde(default)]
    pub robot: crate::robot::RobotMap,
}

/// How the joint before a segment moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum JointMode {
    /// Over time.
    Free,
    /// Not within a recording, but it is not known where it is.
    Still,
    /// Not at all: it rests.
    Held,
}

/// The markers of a segment.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SegmentMarkers {
    /// Markers whose place on the segment is measured in a static trial.
    #[serde(default)]
    pub cluster: Vec<String>,
    /// Markers at a place \[m\] from the joint before the segment: x forward, y left, z up, arms hanging.
    #[serde(default)]
    pub at: BTreeMap<String, [f64; 3]>,
    /// Markers at a place \[m\] from the end of the segment.
    #[serde(default)]
    pub at_end: BTreeMap<String, [f64; 3]>,
}

/// A marker map that can not be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MapError {
    /// It is not TOML of this form.
    #[error("not a marker map: {0}")]
    Toml(String),
    /// A segment that the human model has not.
    #[error("`{name}` is no segment of the human model; nearest are {nearest}")]
    Segment {
        /// Name in the map.
        name: String,
        /// Names like it.
        nearest: String,
    },
    /// A marker that the recording has not.
    #[error("the map's marker `{name}` is not in the recording; nearest are {nearest}")]
    Marker {
        /// Name in the map.
        name: String,
        /// Names like it in the recording.
        nearest: String,
    },
    /// A marker that is there by name only, or without a measurement.
    #[error(
        "marker `{name}` is missing in every frame, or frozen, or zero; take it out of the map, or label it in the recording"
    )]
    NeverSeen {
        /// Name in the map.
        name: String,
    },
    /// A cluster without a static trial.
    #[error(
        "nothing says where marker `{name}` sits: give a static trial (`static_suffix`), or list it under `at` with \
         `marker_spread_m`"
    )]
    Uncalibrated {
        /// Name in the map.
        name: String,
    },
    /// Too few markers to find a body.
    #[error("the map places {0} markers that the recording has; a body needs at least 4")]
    TooFew(usize),
}

impl MarkerMap {
    /// The map for the set `ue_adl`: seated, arms and shoulders in clusters of four, one marker on the
    /// sternum.
    ///
    /// # Errors
    /// None, as long as the file in the crate is a map, which is tested; like [`MarkerMap::from_toml`]
    /// otherwise.
    pub fn ue_adl() -> Result<Self, MapError> {
        Self::from_toml(include_str!("../../maps/ue_adl.toml"))
    }

    /// The map of the embedded motions: markers on all segments of the upper body.
    ///
    /// # Errors
    /// As [`MarkerMap::ue_adl`].
    pub fn embedded() -> Result<Self, MapError> {
        Self::from_toml(include_str!("../../maps/embedded.toml"))
    }

    /// The map for BVH files whose joints have the names of LAFAN1.
    ///
    /// # Errors
    /// As [`MarkerMap::ue_adl`].
    pub fn lafan1() -> Result<Self, MapError> {
        Self::from_toml(include_str!("../../maps/lafan1.toml"))
    }

    /// The map for the joints of AMASS and SMPL-X.
    ///
    /// # Errors
    /// As [`MarkerMap::ue_adl`].
    pub fn smpl() -> Result<Self, MapError> {
        Self::from_toml(include_str!("../../maps/smpl.toml"))
    }

    /// All maps that are built in.
    ///
    /// # Errors
    /// As [`MarkerMap::ue_adl`].
    pub fn built_in() -> Result<Vec<Self>, MapError> {
        [Self::ue_adl, Self::embedded, Self::lafan1, Self::smpl].into_iter().map(|map| map()).collect()
    }

    /// Reads a map.
    ///
    /// # Errors
    /// [`MapError::Toml`], or a segment that there is not.
    pub fn from_toml(text: &str) -> Result<Self, MapError> {
        let map: MarkerMap = toml::from_str(text).map_err(|error| {
            let line =
                error.span().map_or(1, |span| 1 + text[..span.start.min(text.len())].matches('\n').count());
            MapError::Toml(format!("line {line}: {}", error.message().replace('\n', "; ")))
        })?;
        if !(map.marker_spread_m.is_finite() && map.marker_spread_m >= 0.0) {
            let message =
                format!("`marker_spread_m` is {}: give a length in metres, 0 or more", map.marker_spread_m);
            return Err(MapError::Toml(message));
        }
        if let Some(units) = map.units.as_ref().filter(|units| metres(units).is_none()) {
            let message = format!("`units` is `{units}`: known are m, dm, cm, mm, in and ft");
            return Err(MapError::Toml(message));
        }
        for name in map.segments.keys().chain(map.joints.keys()) {
            if Segment::from_name(name).is_none() {
                let names: Vec<String> = Segment::ALL.iter().map(|segment| segment.name()).collect();
                return Err(MapError::Segment { name: name.clone(), nearest: nearest(name, &names) });
            }
        }
        Ok(map)
    }

    /// How the joint before a segment moves.
    pub fn mode(&self, segment: Segment) -> JointMode {
        self.joints.get(&segment.name()).copied().unwrap_or(JointMode::Free)
    }

    /// Names of all markers that the map places.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.segments
            .values()
            .flat_map(|segment| segment.cluster.iter().chain(segment.at.keys()).chain(segment.at_end.keys()))
            .map(String::as_str)
    }

    /// Indices of those of the recording's markers that the map places, in order.
    pub fn markers(&self, recording: &MarkerRecording) -> Vec<usize> {
        let mut markers: Vec<usize> = self.names().filter_map(|name| recording.marker(name)).collect();
        markers.sort_unstable();
        markers.dedup();
        markers
    }

    /// Index of a marker in the recording.
    pub(crate) fn find(&self, name: &str, recording: &MarkerRecording) -> Result<usize, MapError> {
        let marker = recording.marker(name).ok_or_else(|| MapError::Marker {
            name: name.to_owned(),
            nearest: nearest(name, &recording.labels),
        })?;
        if recording.is_ever_seen(marker) {
            Ok(marker)
        } else {
            Err(MapError::NeverSeen { name: name.to_owned() })
        }
    }
}

/// The three names most like `name`, for a message.
fn nearest(name: &str, names: &[String]) -> String {
    let mut ranked: Vec<(usize, &String)> =
        names.iter().map(|other| (strsim::osa_distance(name, other), other)).collect();
    ranked.sort();
    ranked.iter().take(3).map(|(_, other)| format!("`{other}`")).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_one_line_and_name_theirs() {
        let map = include_str!("../../maps/ue_adl.toml");
        let error = MarkerMap::from_toml(&format!("{map}\n[[[")).unwrap_err().to_string();
        assert!(error.lines().count() == 1 && error.contains("line "), "{error}");
    }

    #[test]
    fn a_spread_that_is_no_length_is_refused() {
        for spread in ["-0.01", "nan", "inf"] {
            let text = format!(
                "marker_spread_m = {spread}\n{}",
                without_spread(include_str!("../../maps/ue_adl.toml"))
            );
            let error = MarkerMap::from_toml(&text).unwrap_err().to_string();
            assert!(error.contains("marker_spread_m") && error.contains("metres"), "{error}");
        }
    }

    #[test]
    fn a_unit_that_is_none_was_blamed_on_the_recording() {
        let text = format!("units = \"yards\"\n{}", include_str!("../../maps/ue_adl.toml"));
        let error = MarkerMap::from_toml(&text).unwrap_err().to_string();
        assert!(error.contains("`yards`") && error.contains("mm"), "{error}");
    }

    fn without_spread(map: &str) -> String {
        map.lines()
            .filter(|line| !line.trim_start().starts_with("marker_spread_m"))
            .map(|line| format!("{line}\n"))
            .collect()
    }
}
