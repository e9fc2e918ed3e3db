//! The body's joints and markers as plain data, for pictures and for other kinematics.

use super::body::HumanBody;
use super::kinematics::{MotionKind, Source};
use super::skeleton::{Segment, length_to_end};
use phiw_dynamics::Vec3;

/// A joint with one coordinate, or a length: it turns about an axis of its parent's frame, or slides along
/// it.
#[derive(Clone, Debug, PartialEq)]
pub struct HumanJoint {
    /// The joint before it, as an index; `None` is the world.
    pub parent: Option<usize>,
    /// Whether it turns; else it slides.
    pub turns: bool,
    /// Its axis in its parent's frame, a unit vector.
    pub axis: [f64; 3],
    /// Index of the coordinate that moves it over time (see [`HumanBody::trajectory_names`]); `None`: it
    /// stays at `value`.
    pub coordinate: Option<usize>,
    /// Where it stays \[rad, m\]; 0 if it moves.
    pub value: f64,
}

/// A marker on the body.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyMarker {
    /// Its name in the map.
    pub name: String,
    /// Its index in the recording.
    pub recorded: usize,
    /// The joint whose frame it is fixed to.
    pub joint: usize,
    /// Where \[m\].
    pub local_m: [f64; 3],
}

impl HumanBody {
    /// All joints and lengths, each after the one it hangs on; `parameters` are the values of ξ^h.
    pub fn joints(&self, parameters: &[f64]) -> Vec<HumanJoint> {
        let joint = |node: &super::kinematics::Node| {
            let mut axis = [0.0; 3];
            axis[node.motion.axis] = node.motion.sign;
            let (coordinate, value) = match node.source {
                Source::Held(value) => (None, value),
                Source::Column(column) if column < self.trajectories.len() => (Some(column), 0.0),
                Source::Column(column) => (None, parameters[column - self.first_parameter]),
            };
            let turns = node.motion.kind == MotionKind::Turn;
            HumanJoint { parent: node.parent, turns, axis, coordinate, value }
        };
        self.kinematics.nodes().iter().map(joint).collect()
    }

    /// The markers that the model has.
    pub fn markers(&self) -> Vec<BodyMarker> {
        let points = self.kinematics.points().iter().zip(&self.markers).zip(&self.marker_names);
        points
            .map(|((point, &recorded), name)| BodyMarker {
                name: name.clone(),
                recorded,
                joint: point.node,
                local_m: point.local.0,
            })
            .collect()
    }

    /// Where the coordinates that move over time rest \[rad, m\].
    pub fn rest(&self) -> Vec<f64> {
        self.trajectories.iter().map(|coordinate| coordinate.mean).collect()
    }

    /// The joint whose frame is that of a segment.
    pub fn segment_joint(&self, segment: Segment) -> usize {
        self.segment_nodes[segment.index()]
    }

    /// Beginning and end of each segment \[m\], in the order of [`Segment::ALL`], for values of the
    /// coordinates and of ξ^h.
    pub fn sticks(&self, coordinates: &[f64], parameters: &[f64]) -> Vec<[[f64; 3]; 2]> {
        let mut columns = vec![0.0; self.first_parameter + parameters.len()];
        columns[..coordinates.len()].copy_from_slice(coordinates);
        columns[self.first_parameter..].copy_from_slice(parameters);
        let mut scratch = self.kinematics.scratch::<f64>();
        self.kinematics.place(&columns, &mut scratch);
        let stick = |segment: Segment| {
            let node = self.segment_nodes[segment.index()];
            let mut along = Vec3([0.0; 3]);
            for (length, axis, sign) in length_to_end(segment) {
                along.0[axis] += sign * parameters[length];
            }
            let from = self.kinematics.origin(node, &scratch);
            [from.0, (from + *self.kinematics.rotation(node, &scratch) * along).0]
        };
        Segment::ALL.into_iter().map(stick).collect()
    }
}
