//! w_g ‖P^r − P^h‖², the second term of (15).

use super::{Problem, Scratch};
use crate::human::{HumanScratch, Segment, Twist};
use crate::robot::{Correspondence, RobotModel, world};
use phiw_dynamics::{Placement, Vec3};

impl Problem<'_> {
    /// w_g ‖P^r − P^h‖², vectors seen from pelvis and base.
    pub(super) fn correspondence(
        &self,
        robot: &RobotModel,
        sample: usize,
        scratch: &mut Scratch,
        gradient: bool,
        normal: bool,
    ) -> f64 {
        let human_coordinates = self.body.trajectories.len();
        let joints = robot.tree.joint_count();
        let size = scratch.columns.len();
        let q = &scratch.columns[human_coordinates..human_coordinates + joints];
        // The sizes are those of this robot.
        let _ = robot.tree.forward_kinematics(q, &mut scratch.placements);
        let pelvis = scratch.human.rotations[self.body.segment_nodes[0]];
        let mut cost = 0.0;
        for (index, correspondence) in robot.correspondences.iter().enumerate() {
            let weight = self.weights.correspondence * correspondence.weight;
            if weight == 0.0 {
                continue;
            }
            let replaced = self.targets.iter().find(|(target, _)| *target == index);
            let human = match replaced {
                Some((_, vectors)) => vectors[sample],
                None => self.human_vector(correspondence, &scratch.human),
            };
            let residual = robot_vector(correspondence, &scratch.placements) - human;
            cost += weight * residual.dot(residual);
            if !gradient {
                continue;
            }
            scratch.derivative.clear();
            if replaced.is_none() {
                for (segment, vector) in &correspondence.human {
                    let node = self.body.segment_nodes[segment.index()];
                    let arm = scratch.human.rotations[node] * *vector;
                    self.turning_columns(node, &scratch.human, |column, twist| {
                        let change = pelvis.transpose_mul(twist.angular.cross(arm));
                        match scratch.derivative.iter_mut().find(|(other, _)| *other == column) {
                            Some((_, sum)) => *sum = *sum - change,
                            None => scratch.derivative.push((column, -change)),
                        }
                    });
                }
            }
            for (point, jacobian) in
                [correspondence.to, correspondence.from].into_iter().zip(&mut scratch.jacobians)
            {
                match point.body {
                    Some(body) => {
                        let _ = robot.tree.point_jacobian(&scratch.placements, body, point.local, jacobian);
                    }
                    None => jacobian.fill(0.0),
                }
            }
            let [to, from] = &scratch.jacobians;
            for joint in 0..joints {
                let change = Vec3([0, 1, 2].map(|row| to[row * joints + joint] - from[row * joints + joint]));
                if change.0 != [0.0; 3] {
                    scratch.derivative.push((human_coordinates + joint, change));
                }
            }
            for (a, &(column, change)) in scratch.derivative.iter().enumerate() {
                scratch.gradient[column] += weight * change.dot(residual);
                if normal {
                    for &(other, other_change) in &scratch.derivative[..=a] {
                        let (high, low) = (column.max(other), column.min(other));
                        scratch.normal[low * size + high] += weight * change.dot(other_change);
                    }
                }
            }
        }
        cost
    }

    /// The human's vector of a correspondence, seen from the pelvis.
    pub(super) fn human_vector(&self, correspondence: &Correspondence, scratch: &HumanScratch) -> Vec3<f64> {
        let rotation = |segment: Segment| scratch.rotations[self.body.segment_nodes[segment.index()]];
        let vectors = correspondence.human.iter().map(|&(segment, vector)| rotation(segment) * vector);
        rotation(Segment::Pelvis).transpose_mul(vectors.fold(Vec3([0.0; 3]), |sum, vector| sum + vector))
    }

    /// Visits the columns that turn a segment against the pelvis.
    pub(super) fn turning_columns(
        &self,
        segment_node: usize,
        scratch: &HumanScratch,
        mut visit: impl FnMut(usize, Twist),
    ) {
        let mut next = Some(segment_node);
        let pelvis = self.body.segment_nodes[0];
        while let Some(index) = next.filter(|&index| index > pelvis) {
            if let Some(column) = self.body.kinematics.turns(index) {
                visit(column, scratch.twists[index]);
            }
            next = self.body.kinematics.nodes[index].parent;
        }
    }
}

/// The robot's vector of a correspondence, seen from its base.
pub(crate) fn robot_vector(correspondence: &Correspondence, placements: &[Placement<f64>]) -> Vec3<f64> {
    world(placements, correspondence.to) - world(placements, correspondence.from)
}
