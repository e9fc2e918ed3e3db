//! Kinematics of a tree in which lengths are joints too.
//!
//! Each node moves by one coordinate: an angle of θ^h, or a length of ξ^h, which is a slide that all samples
//! share. All of it is generic over the scalar: a number, or a SIMD register of samples.

use phiw_dynamics::scalar::Scalar;
use phiw_dynamics::{Mat3, Spatial, Vec3};

/// Where a node's coordinate comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    /// It stays at this value.
    Held(f64),
    /// It is column `.0` of a sample: a trajectory or a parameter.
    Column(usize),
}

impl Source {
    /// The column, if it is one.
    pub fn column(self) -> Option<usize> {
        match self {
            Source::Held(_) => None,
            Source::Column(column) => Some(column),
        }
    }
}

/// How a node moves along or about a coordinate axis (0 x, 1 y, 2 z) of its parent's frame, in the sense of
/// the sign.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NodeMotion {
    pub kind: MotionKind,
    pub axis: usize,
    pub sign: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MotionKind {
    Turn,
    Slide,
}

#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub parent: Option<usize>,
    pub motion: NodeMotion,
    pub source: Source,
    /// Which rotation it has: its own if it turns, else that of the next one above that does; 0 is none.
    frame: usize,
    /// Nodes above it that a column moves, nearest first, with the column.
    pub above: Vec<(usize, usize)>,
    /// Whether a point hangs on it or further down.
    pub carries: bool,
}

/// A marker fixed to a node.
#[derive(Clone, Debug)]
pub(crate) struct Point {
    pub node: usize,
    pub local: Vec3<f64>,
}

/// The tree.
#[derive(Clone, Debug, Default)]
pub(crate) struct Kinematics {
    nodes: Vec<Node>,
    points: Vec<Point>,
}

/// Room for one sample, or as many as the scalar has.
pub(crate) struct HumanScratch<S> {
    /// The world's, then one for each node; those of nodes that do not turn stay unused.
    rotations: Vec<Mat3<S>>,
    origins: Vec<Vec3<S>>,
    /// Velocity of the world's origin as if fixed to a node, for each node's coordinate.
    pub(super) twists: Vec<Spatial<S>>,
    /// What pulls at a node and all below it: force, and moment about the world's origin.
    pub(crate) wrenches: Vec<Spatial<S>>,
    pub(crate) masses: Vec<super::masses::Masses<S>>,
}

impl Kinematics {
    /// Adds a node and gives its index.
    pub fn push(&mut self, parent: Option<usize>, motion: NodeMotion, source: Source) -> usize {
        let index = self.nodes.len();
        let frame = match motion.kind {
            MotionKind::Turn => index + 1,
            MotionKind::Slide => parent.map_or(0, |parent| self.nodes[parent].frame),
        };
        let above = parent.map_or(Vec::new(), |parent| {
            let own = self.nodes[parent].source.column().map(|column| (parent, column));
            own.into_iter().chain(self.nodes[parent].above.iter().copied()).collect()
        });
        self.nodes.push(Node { parent, motion, source, frame, above, carries: false });
        index
    }

    /// Fixes a marker to a node.
    pub fn add_point(&mut self, point: Point) {
        self.carry(point.node);
        self.points.push(point);
    }

    /// Something pulls at this node, or will.
    pub fn carry(&mut self, node: usize) {
        let mut next = Some(node);
        while let Some(index) = next.filter(|&index| !self.nodes[index].carries) {
            self.nodes[index].carries = true;
            next = self.nodes[index].parent;
        }
    }

    pub fn nodes(&self) -> &[Node] {
        &self.nodes
    }
    pub fn points(&self) -> &[Point] {
        &self.points
    }

    pub fn scratch<S: Scalar>(&self) -> HumanScratch<S> {
        let count = self.nodes.len();
        HumanScratch {
            rotations: vec![Mat3::identity(); count + 1],
            origins: vec![Vec3::zero(); count],
            twists: vec![Spatial::zero(); count],
            wrenches: vec![Spatial::zero(); count],
            masses: vec![super::masses::Masses::zero(); count],
        }
    }

    /// Places all nodes; `columns` are the sample's coordinates.
    #[inline(always)]
    pub fn place<S: Scalar>(&self, columns: &[S], scratch: &mut HumanScratch<S>) {
        for (index, node) in self.nodes.iter().enumerate() {
            let value = match node.source {
                Source::Held(value) => S::constant(value),
                Source::Column(column) => columns[column],
            };
            let (origin, frame) = match node.parent {
                Some(parent) => (scratch.origins[parent], self.nodes[parent].frame),
                None => (Vec3::zero(), 0),
            };
            let NodeMotion { kind, axis, sign } = node.motion;
            let value = S::constant(sign) * value;
            match kind {
                MotionKind::Slide => {
                    scratch.origins[index] = origin + column(&scratch.rotations[frame], axis).scale(value);
                }
                MotionKind::Turn => {
                    // Rotations of parents come first.
                    let (above, own) = scratch.rotations.split_at_mut(node.frame);
                    turn(&above[frame], axis, value, &mut own[0]);
                    scratch.origins[index] = origin;
                }
            }
        }
    }

    /// Twists of all nodes' coordinates; after [`Self::place`].
    #[inline(always)]
    pub fn twist<S: Scalar>(&self, scratch: &mut HumanScratch<S>) {
        for (index, node) in self.nodes.iter().enumerate() {
            let NodeMotion { kind, axis, sign } = node.motion;
            let axis = column(self.rotation(index, scratch), axis).scale(S::constant(sign));
            scratch.twists[index] = match kind {
                MotionKind::Slide => Spatial { linear: axis, angular: Vec3::zero() },
                MotionKind::Turn => Spatial { linear: scratch.origins[index].cross(axis), angular: axis },
            };
        }
    }

    /// The column that turns a node, if one does.
    pub fn turns(&self, node: usize) -> Option<usize> {
        match (self.nodes[node].motion.kind, self.nodes[node].source) {
            (MotionKind::Turn, Source::Column(column)) => Some(column),
            _ => None,
        }
    }

    /// The node that turns a node: itself, or one above it; `None` if none does.
    pub fn turner(&self, node: usize) -> Option<usize> {
        self.nodes[node].frame.checked_sub(1)
    }

    /// How a node is turned; after [`Self::place`].
    #[inline(always)]
    pub fn rotation<'a, S: Scalar>(&self, node: usize, scratch: &'a HumanScratch<S>) -> &'a Mat3<S> {
        &scratch.rotations[self.nodes[node].frame]
    }

    /// The velocity that a unit of a node's coordinate gives to what hangs on it; after [`Self::twist`].
    #[inline(always)]
    pub fn twist_of<S: Scalar>(&self, node: usize, scratch: &HumanScratch<S>) -> Spatial<S> {
        scratch.twists[node]
    }

    /// Where a node is; after [`Self::place`].
    #[inline(always)]
    pub fn origin<S: Scalar>(&self, node: usize, scratch: &HumanScratch<S>) -> Vec3<S> {
        scratch.origins[node]
    }

    /// Where a point is; after [`Self::place`].
    #[inline(always)]
    pub fn position<S: Scalar>(&self, point: usize, scratch: &HumanScratch<S>) -> Vec3<S> {
        let Point { node, local } = &self.points[point];
        let origin = scratch.origins[*node];
        // Markers whose place is estimated have nodes of their own.
        if local.0 == [0.0; 3] {
            return origin;
        }
        origin + rotate(self.rotation(*node, scratch), &Vec3::constant(local.0))
    }
}

/// Where an axis of a frame points.
#[inline(always)]
fn column<S: Scalar>(Mat3([x, y, z]): &Mat3<S>, axis: usize) -> Vec3<S> {
    Vec3([x[axis], y[axis], z[axis]])
}

/// A vector of a frame, in the world. By reference: a matrix of SIMD registers is too long to hand around.
#[inline(always)]
pub(crate) fn rotate<S: Scalar>(Mat3([a, b, c]): &Mat3<S>, Vec3(v): &Vec3<S>) -> Vec3<S> {
    Vec3([
        a[0] * v[0] + a[1] * v[1] + a[2] * v[2],
        b[0] * v[0] + b[1] * v[1] + b[2] * v[2],
        c[0] * v[0] + c[1] * v[1] + c[2] * v[2],
    ])
}

/// A vector of the world, in a frame.
#[inline(always)]
pub(crate) fn rotate_back<S: Scalar>(Mat3([a, b, c]): &Mat3<S>, Vec3([x, y, z]): &Vec3<S>) -> Vec3<S> {
    Vec3([
        a[0] * *x + b[0] * *y + c[0] * *z,
        a[1] * *x + b[1] * *y + c[1] * *z,
        a[2] * *x + b[2] * *y + c[2] * *z,
    ])
}

/// The rotation times one about its own axis x, y or z.
#[inline(always)]
fn turn<S: Scalar>(Mat3(rotation): &Mat3<S>, axis: usize, angle: S, Mat3(turned): &mut Mat3<S>) {
    let (sine, cosine) = angle.sin_cos();
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    for (row, turned) in rotation.iter().zip(turned) {
        turned[axis] = row[axis];
        turned[next] = row[next] * cosine + row[last] * sine;
        turned[last] = row[last] * cosine - row[next] * sine;
    }
}
