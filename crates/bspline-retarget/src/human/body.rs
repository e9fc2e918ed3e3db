//! A person with markers: the skeleton's coordinates, its lengths, and the markers of one recording.

use super::kinematics::{Kinematics, MotionKind, NodeMotion, Point, Source};
use super::marker_map::{JointMode, MapError, MarkerMap};
use super::skeleton::{Along, Joint, Motion, SEGMENT_PARAMETERS, Segment, joints, length_to, length_to_end};
use crate::recording::MarkerRecording;
use phiw_dynamics::Vec3;
use std::collections::BTreeMap;

/// Standard deviation of a length that a static trial measured \[m\].
const CALIBRATED_SPREAD_M: f64 = 0.01;

/// A marker's place on its segment \[m\], from the segment's joint or from its end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The segment.
    pub segment: Segment,
    /// Whether the place is seen from the segment's end.
    pub from_end: bool,
    /// Where.
    pub local_m: [f64; 3],
}

/// A coordinate with what is known of it beforehand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Coordinate {
    pub name: String,
    pub mean: f64,
    pub spread: f64,
    /// What is anatomically possible; infinite where that is no matter.
    pub range: (f64, f64),
}

const ANYWHERE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// The human model for one recording: coordinates over time, parameters ξ^h, markers.
#[derive(Clone, Debug)]
pub struct HumanBody {
    pub(crate) kinematics: Kinematics,
    /// Columns `0..`: what moves over time.
    pub(crate) trajectories: Vec<Coordinate>,
    /// Columns after the trajectories of human and robot: lengths, joints that keep still, markers' places.
    pub(crate) parameters: Vec<Coordinate>,
    /// Their first column.
    pub(crate) first_parameter: usize,
    /// Which parameters are joints that keep still.
    pub(crate) still: std::ops::Range<usize>,
    /// Node of each segment's frame, in the order of [`Segment::ALL`].
    pub(crate) segment_nodes: [usize; 12],
    /// The recording's marker of each point.
    pub(crate) markers: Vec<usize>,
    /// Names of the points.
    pub(crate) marker_names: Vec<String>,
    pub(crate) placed: Vec<Placed>,
}

impl HumanBody {
    /// The body for a recording. `calibrated` are places of markers from a static trial, and its
    /// lengths (one for each of [`SEGMENT_PARAMETERS`]); `robot_coordinates` columns are left free between
    /// trajectories and parameters.
    pub(crate) fn new(
        map: &MarkerMap,
        recording: &MarkerRecording,
        calibrated: &BTreeMap<String, Placed>,
        lengths: Option<&[f64]>,
        still: bool,
        robot_coordinates: usize,
    ) -> Result<Self, MapError> {
        let mut body = HumanBody {
            kinematics: Kinematics::default(),
            trajectories: Vec::new(),
            parameters: Vec::new(),
            first_parameter: 0,
            still: SEGMENT_PARAMETERS.len()..0,
            segment_nodes: [0; 12],
            markers: Vec::new(),
            marker_names: Vec::new(),
            placed: Vec::new(),
        };
        let mode = |segment| match map.mode(segment) {
            JointMode::Free if still => JointMode::Still,
            mode => mode,
        };
        let moving = |segment: &Segment| mode(*segment) == JointMode::Free;
        let count: usize = Segment::ALL.iter().filter(|s| moving(s)).map(|&s| joints(s).len()).sum();
        let first_parameter = count + robot_coordinates;
        body.first_parameter = first_parameter;
        for (index, parameter) in SEGMENT_PARAMETERS.iter().enumerate() {
            body.parameters.push(Coordinate {
                name: parameter.name.to_owned(),
                mean: lengths.map_or(parameter.typical_m, |lengths| lengths[index]),
                spread: if lengths.is_some() { CALIBRATED_SPREAD_M } else { parameter.spread_m },
                range: ANYWHERE,
            });
        }
        body.add_segments(&mode, first_parameter);
        body.add_markers(map, recording, calibrated, still, first_parameter)?;
        // Correspondences pull at segments without markers, too.
        for node in body.segment_nodes {
            body.kinematics.carry(node);
        }
        if body.markers.len() < 4 {
            return Err(MapError::TooFew(body.markers.len()));
        }
        Ok(body)
    }

    /// The joints of all segments, each as its `mode` says.
    fn add_segments(&mut self, mode: &dyn Fn(Segment) -> JointMode, first_parameter: usize) {
        for segment in Segment::ALL {
            let parent = segment.parent().map(|parent| self.segment_nodes[parent.index()]);
            let mut last = self.slide_along(parent, &length_to(segment), first_parameter);
            for joint in joints(segment) {
                let name = format!("{}_{}", segment.name(), joint.name);
                let Joint { rest, spread, range, .. } = joint;
                let coordinate = Coordinate { name, mean: rest, spread, range };
                let source = match mode(segment) {
                    JointMode::Free => {
                        self.trajectories.push(coordinate);
                        Source::Column(self.trajectories.len() - 1)
                    }
                    JointMode::Still => {
                        self.parameters.push(coordinate);
                        Source::Column(first_parameter + self.parameters.len() - 1)
                    }
                    JointMode::Held => Source::Held(joint.rest),
                };
                let motion = match joint.motion {
                    Motion::Turn(axis, sign) => NodeMotion { kind: MotionKind::Turn, axis, sign },
                    Motion::Slide(axis) => NodeMotion { kind: MotionKind::Slide, axis, sign: 1.0 },
                };
                last = Some(self.kinematics.push(last, motion, source));
            }
            self.segment_nodes[segment.index()] = last.unwrap_or(0);
        }
        self.still.end = self.parameters.len();
    }

    /// The markers that the map places and the recording has.
    fn add_markers(
        &mut self,
        map: &MarkerMap,
        recording: &MarkerRecording,
        calibrated: &BTreeMap<String, Placed>,
        still: bool,
        first_parameter: usize,
    ) -> Result<(), MapError> {
        for (name, markers) in &map.segments {
            let Some(segment) = Segment::from_name(name) else { continue };
            for name in &markers.cluster {
                // The place is looked up after the marker was found, so that an absent marker is reported
                // as absent.
                let index = map.find(name, recording)?;
                match calibrated.get(name) {
                    Some(&placed) => self.place(name, index, placed, map, first_parameter),
                    None if still => {}
                    None => return Err(MapError::Uncalibrated { name: name.clone() }),
                }
            }
            let listed = markers.at.iter().map(|(name, at)| (name, at, false));
            for (name, &local_m, from_end) in listed.chain(markers.at_end.iter().map(|(n, at)| (n, at, true)))
            {
                let nominal = Placed { segment, from_end, local_m };
                let placed = calibrated.get(name).copied().unwrap_or(nominal);
                // Anatomical markers may be there in the static trial alone.
                match map.find(name, recording) {
                    Ok(index) => self.place(name, index, placed, map, first_parameter),
                    Err(_) if !still && calibrated.contains_key(name) => {}
                    Err(error) => return Err(error),
                }
            }
        }
        Ok(())
    }

    /// Number of coordinates that move over time.
    pub fn trajectories(&self) -> usize {
        self.trajectories.len()
    }
    /// Number of parameters ξ^h.
    pub fn parameters(&self) -> usize {
        self.parameters.len()
    }
    /// Names of the coordinates that move over time, `left_forearm_flexion`, …
    pub fn trajectory_names(&self) -> impl Iterator<Item = &str> {
        self.trajectories.iter().map(|coordinate| coordinate.name.as_str())
    }
    /// Names of the parameters ξ^h.
    pub fn parameter_names(&self) -> impl Iterator<Item = &str> {
        self.parameters.iter().map(|coordinate| coordinate.name.as_str())
    }
    /// Names of the markers that the model has.
    pub fn marker_names(&self) -> &[String] {
        &self.marker_names
    }

    /// Where the markers sit, by name, for values of the parameters.
    pub(crate) fn markers_placed(&self, parameters: &[f64]) -> BTreeMap<String, Placed> {
        let value = |name: String| {
            let index = self.parameters.iter().position(|parameter| parameter.name == name);
            index.map(|index| parameters[index])
        };
        self.marker_names
            .iter()
            .zip(&self.placed)
            .map(|(name, placed)| {
                let local = ["x", "y", "z"].map(|axis| value(format!("{name}.{axis}")));
                let local_m = std::array::from_fn(|axis| local[axis].unwrap_or(placed.local_m[axis]));
                (name.clone(), Placed { local_m, ..*placed })
            })
            .collect()
    }

    fn slide_along(
        &mut self,
        mut parent: Option<usize>,
        lengths: &[Along],
        first_parameter: usize,
    ) -> Option<usize> {
        for &(length, axis, sign) in lengths {
            let motion = NodeMotion { kind: MotionKind::Slide, axis, sign };
            parent = Some(self.kinematics.push(parent, motion, Source::Column(first_parameter + length)));
        }
        parent
    }

    fn place(&mut self, name: &str, marker: usize, placed: Placed, map: &MarkerMap, first_parameter: usize) {
        let Placed { segment, from_end, local_m } = placed;
        let mut node = self.segment_nodes[segment.index()];
        if from_end {
            node = self.slide_along(Some(node), &length_to_end(segment), first_parameter).unwrap_or(node);
        }
        let mut local = Vec3(local_m);
        if map.marker_spread_m > 0.0 {
            for axis in 0..3 {
                let name = format!("{name}.{}", ["x", "y", "z"][axis]);
                let (mean, spread) = (local_m[axis], map.marker_spread_m);
                self.parameters.push(Coordinate { name, mean, spread, range: ANYWHERE });
                let source = Source::Column(first_parameter + self.parameters.len() - 1);
                let motion = NodeMotion { kind: MotionKind::Slide, axis, sign: 1.0 };
                node = self.kinematics.push(Some(node), motion, source);
            }
            local = Vec3([0.0; 3]);
        }
        self.kinematics.add_point(Point { node, local });
        self.markers.push(marker);
        self.marker_names.push(name.to_owned());
        self.placed.push(placed);
    }
}
