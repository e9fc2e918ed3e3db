//! Kinematics of a tree in which lengths are joints too, and its markers' normal equations.
//!
//! Each node moves by one coordinate: an angle of θ^h, or a length of ξ^h, which is a slide that all samples share. Then J'J of
//! all markers is the mass matrix of unit points at the markers: composite sums from the leaves to the root give it without
//! ever forming J.

use phiw_dynamics::{Mat3, Vec3};

/// Where a node's coordinate comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Source {
    /// It stays at this value.
    Held(f64),
    /// It is column `.0` of a sample: a trajectory or a parameter.
    Column(usize),
}

/// A rotation about a coordinate axis, or a slide along a direction, in the parent's frame.
#[derive(Clone, Copy, Debug)]
pub(crate) enum NodeMotion {
    Turn { axis: usize, sign: f64 },
    Slide(Vec3<f64>),
}

#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub parent: Option<usize>,
    pub motion: NodeMotion,
    pub source: Source,
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
    pub nodes: Vec<Node>,
    pub points: Vec<Point>,
}

/// Velocity of the world's origin as if fixed to a body, and its angular velocity: v(p) = linear + angular × p.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Twist {
    pub linear: Vec3<f64>,
    pub angular: Vec3<f64>,
}

/// Unit points in sum: their weight, first moment, and second moment about the world's origin (xx, xy, yy, xz, yz, zz).
#[derive(Clone, Copy, Debug, Default)]
struct Masses {
    weight: f64,
    first: [f64; 3],
    second: [f64; 6],
}

/// Room for one sample.
pub(crate) struct HumanScratch {
    pub rotations: Vec<Mat3<f64>>,
    pub origins: Vec<Vec3<f64>>,
    pub twists: Vec<Twist>,
    masses: Vec<Masses>,
    wrenches: Vec<Twist>,
}

const ZERO: Vec3<f64> = Vec3([0.0; 3]);

impl Twist {
    const ZERO: Twist = Twist { linear: ZERO, angular: ZERO };
    fn dot(&self, other: &Twist) -> f64 {
        self.linear.dot(other.linear) + self.angular.dot(other.angular)
    }
}

impl Masses {
    fn add_point(&mut self, p: Vec3<f64>) {
        let [x, y, z] = p.0;
        self.weight += 1.0;
        for (sum, value) in self.first.iter_mut().zip([x, y, z]) {
            *sum += value;
        }
        let second = [y * y + z * z, -x * y, x * x + z * z, -x * z, -y * z, x * x + y * y];
        for (sum, value) in self.second.iter_mut().zip(second) {
            *sum += value;
        }
    }
    fn add(&mut self, other: &Masses) {
        self.weight += other.weight;
        for (sum, value) in self.first.iter_mut().zip(other.first) {
            *sum += value;
        }
        for (sum, value) in self.second.iter_mut().zip(other.second) {
            *sum += value;
        }
    }
    /// Σ X' X · twist, the momentum.
    fn times(&self, twist: &Twist) -> Twist {
        let first = Vec3(self.first);
        let [xx, xy, yy, xz, yz, zz] = self.second;
        let [a, b, c] = twist.angular.0;
        let turned = Vec3([xx * a + xy * b + xz * c, xy * a + yy * b + yz * c, xz * a + yz * b + zz * c]);
        Twist {
            linear: twist.linear.scale(self.weight) + twist.angular.cross(first),
            angular: first.cross(twist.linear) + turned,
        }
    }
}

impl Kinematics {
    pub fn scratch(&self) -> HumanScratch {
        let count = self.nodes.len();
        HumanScratch {
            rotations: vec![Mat3::identity(); count],
            origins: vec![ZERO; count],
            twists: vec![Twist::ZERO; count],
            masses: vec![Masses::default(); count],
            wrenches: vec![Twist::ZERO; count],
        }
    }

    /// Places all nodes; `columns` are the sample's coordinates.
    pub fn place(&self, columns: &[f64], scratch: &mut HumanScratch) {
        for (index, node) in self.nodes.iter().enumerate() {
            let value = match node.source {
                Source::Held(value) => value,
                Source::Column(column) => columns[column],
            };
            let (rotation, origin) = match node.parent {
                Some(parent) => (scratch.rotations[parent], scratch.origins[parent]),
                None => (Mat3::identity(), ZERO),
            };
            match node.motion {
                NodeMotion::Slide(direction) => {
                    scratch.rotations[index] = rotation;
                    scratch.origins[index] = origin + rotation * direction.scale(value);
                }
                NodeMotion::Turn { axis, sign } => {
                    scratch.rotations[index] = turned(rotation, axis, sign * value);
                    scratch.origins[index] = origin;
                }
            }
        }
    }

    /// The column that turns a node, if one does.
    pub fn turns(&self, node: usize) -> Option<usize> {
        match (self.nodes[node].motion, self.nodes[node].source) {
            (NodeMotion::Turn { .. }, Source::Column(column)) => Some(column),
            _ => None,
        }
    }

    /// Twists of all nodes' coordinates; after [`Self::place`].
    pub fn twist(&self, scratch: &mut HumanScratch) {
        for (index, node) in self.nodes.iter().enumerate() {
            scratch.twists[index] = match node.motion {
                NodeMotion::Slide(direction) => {
                    Twist { linear: scratch.rotations[index] * direction, angular: ZERO }
                }
                NodeMotion::Turn { axis, sign } => {
                    let matrix = scratch.rotations[index].0;
                    let angular = Vec3([matrix[0][axis], matrix[1][axis], matrix[2][axis]]).scale(sign);
                    Twist { linear: scratch.origins[index].cross(angular), angular }
                }
            };
        }
    }

    /// Where a point is; after [`Self::place`].
    pub fn position(&self, point: usize, scratch: &HumanScratch) -> Vec3<f64> {
        let Point { node, local } = self.points[point];
        scratch.origins[node] + scratch.rotations[node] * local
    }

    /// Σ |p − measured|² over the points that are seen (finite); after [`Self::place`].
    pub fn cost(&self, measured: &[[f64; 3]], scratch: &HumanScratch) -> f64 {
        let mut cost = 0.0;
        for (index, measured) in measured.iter().enumerate() {
            if measured[0].is_finite() {
                let residual = self.position(index, scratch) - Vec3(*measured);
                cost += residual.dot(residual);
            }
        }
        cost
    }

    /// The cost, with J'r added to `gradient` and, if wanted, J'J to the upper triangle of `normal` (row by row, `size` columns);
    /// after [`Self::twist`].
    pub fn normal_equations(
        &self,
        measured: &[[f64; 3]],
        scratch: &mut HumanScratch,
        gradient: &mut [f64],
        mut normal: Option<(&mut [f64], usize)>,
    ) -> f64 {
        scratch.masses.fill(Masses::default());
        scratch.wrenches.fill(Twist::ZERO);
        let mut cost = 0.0;
        for (index, measured) in measured.iter().enumerate() {
            if !measured[0].is_finite() {
                continue;
            }
            let position = self.position(index, scratch);
            let residual = position - Vec3(*measured);
            cost += residual.dot(residual);
            let node = self.points[index].node;
            scratch.masses[node].add_point(position);
            let wrench = &mut scratch.wrenches[node];
            wrench.linear += residual;
            wrench.angular += position.cross(residual);
        }
        for index in (0..self.nodes.len()).rev() {
            let (masses, wrench) = (scratch.masses[index], scratch.wrenches[index]);
            if masses.weight == 0.0 {
                continue;
            }
            let node = &self.nodes[index];
            if let Some(parent) = node.parent {
                scratch.masses[parent].add(&masses);
                scratch.wrenches[parent].linear += wrench.linear;
                scratch.wrenches[parent].angular += wrench.angular;
            }
            let Source::Column(column) = node.source else { continue };
            let twist = scratch.twists[index];
            gradient[column] += twist.dot(&wrench);
            let Some((normal, size)) = normal.as_mut() else { continue };
            let momentum = masses.times(&twist);
            normal[column * *size + column] += twist.dot(&momentum);
            let mut next = node.parent;
            while let Some(ancestor) = next {
                let node = &self.nodes[ancestor];
                if let Source::Column(other) = node.source {
                    let value = scratch.twists[ancestor].dot(&momentum);
                    let (high, low) = (column.max(other), column.min(other));
                    // A length that comes twice in one chain meets itself on the diagonal, once from each side.
                    normal[low * *size + high] += if high == low { 2.0 * value } else { value };
                }
                next = node.parent;
            }
        }
        cost
    }
}

/// The rotation times one about its own axis x, y or z.
fn turned(rotation: Mat3<f64>, axis: usize, angle: f64) -> Mat3<f64> {
    let (sine, cosine) = angle.sin_cos();
    let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
    let mut matrix = rotation.0;
    for row in &mut matrix {
        (row[next], row[last]) =
            (row[next] * cosine + row[last] * sine, row[last] * cosine - row[next] * sine);
    }
    Mat3(matrix)
}
