//! w_g ‖P^r − P^h‖², the second term of (15).

use super::Problem;
use super::pass::Batch;
use super::samples::{LANES, Lane};
use crate::human::{HumanBody, HumanScratch, Segment, rotate, rotate_back};
use crate::robot::{BodyPoint, Correspondence, RobotModel, world};
use phiw_dynamics::scalar::{Lanes, Scalar};
use phiw_dynamics::{Placement, Spatial, Tree, Vec3};

/// A correspondence, prepared for one body and robot.
pub(super) struct Line {
    weight: f64,
    /// The coordinates that turn the human's vector against the pelvis.
    human: Vec<Turn>,
    /// The robot's bodies that move its points, by coordinate.
    robot: Vec<Axis>,
}

/// A coordinate of the human: its column, its node, and which of the correspondence's vectors it turns.
struct Turn {
    column: usize,
    node: usize,
    vectors: Vec<usize>,
}

/// A joint of the robot: its coordinate, its body, and which ends it moves.
struct Axis {
    coordinate: usize,
    body: usize,
    to: bool,
    from: bool,
}

impl Line {
    pub fn all(body: &HumanBody, robot: &RobotModel, weight: f64) -> Vec<Self> {
        robot
            .correspondences
            .iter()
            .map(|correspondence| Line {
                weight: weight * correspondence.weight,
                human: turns(body, correspondence),
                robot: axes(&robot.tree, correspondence),
            })
            .collect()
    }
}

impl Line {
    /// The columns that are in it; the robot's coordinates begin at `first`.
    pub fn columns(&self, first: usize) -> impl Iterator<Item = usize> {
        let robot = self.robot.iter().map(move |axis| first + axis.coordinate);
        self.human.iter().map(|turn| turn.column).chain(robot)
    }
}

fn turns(body: &HumanBody, correspondence: &Correspondence) -> Vec<Turn> {
    let mut turns: Vec<Turn> = Vec::new();
    let pelvis = body.segment_nodes[0];
    for (vector, (segment, _)) in correspondence.human.iter().enumerate() {
        let mut next = Some(body.segment_nodes[segment.index()]);
        while let Some(node) = next.filter(|&node| node > pelvis) {
            if let Some(column) = body.kinematics.turns(node) {
                match turns.iter_mut().find(|turn| turn.node == node) {
                    Some(turn) => turn.vectors.push(vector),
                    None => turns.push(Turn { column, node, vectors: vec![vector] }),
                }
            }
            next = body.kinematics.nodes()[node].parent;
        }
    }
    turns
}

fn axes(tree: &Tree, correspondence: &Correspondence) -> Vec<Axis> {
    let moved = |point: BodyPoint| {
        let mut moved = vec![false; tree.bodies().len()];
        let mut next = point.body;
        while let Some(body) = next {
            moved[body] = true;
            next = tree.bodies()[body].parent;
        }
        moved
    };
    let (to, from) = (moved(correspondence.to), moved(correspondence.from));
    let bodies = tree.bodies().iter().enumerate();
    let mut axes: Vec<Axis> = bodies
        .map(|(body, own)| Axis { coordinate: own.velocity_index, body, to: to[body], from: from[body] })
        .filter(|axis| axis.to || axis.from)
        .collect();
    // Joints that follow another share its coordinate: side by side their columns can be summed.
    axes.sort_by_key(|axis| axis.coordinate);
    axes
}

impl Problem<'_> {
    /// w_g ‖P^r − P^h‖² of a batch of samples, each counted `count` times; if wanted, with what the residuals
    /// pull at human and robot.
    #[inline(always)]
    pub(super) fn correspondence(
        &self,
        robot: &RobotModel,
        samples: [usize; LANES],
        count: Lane,
        batch: &mut Batch,
        gradient: bool,
    ) -> Lane {
        let mut cost = Lane::zero();
        let pelvis_node = self.body.segment_nodes[0];
        let pelvis = *self.body.kinematics.rotation(pelvis_node, &batch.human);
        for (index, (line, correspondence)) in self.lines.iter().zip(&robot.correspondences).enumerate() {
            let target = self.target(index);
            let human = match target {
                Some(vectors) => lanes_of(samples.map(|sample| vectors[sample])),
                None => self.human_vector(correspondence, &batch.human),
            };
            let ends = [correspondence.to, correspondence.from].map(|end| world(&batch.placements, end));
            let residual = ends[0] - ends[1] - human;
            let force = residual.scale(Lane::constant(line.weight) * count);
            cost += force.dot(residual);
            if !gradient {
                continue;
            }
            let pulls = [(correspondence.to, ends[0], force), (correspondence.from, ends[1], -force)];
            for (end, at, force) in pulls {
                if let Some(body) = end.body {
                    let wrench = &mut batch.wrenches[body];
                    *wrench = *wrench + Spatial { linear: force, angular: at.cross(force) };
                }
            }
            if target.is_none() {
                // The vectors are expressed in the pelvis' frame, so the pelvis' rotation is subtracted.
                let force = rotate(&pelvis, &-force);
                let mut sum = Vec3::zero();
                for (segment, vector) in &correspondence.human {
                    let node = self.body.segment_nodes[segment.index()];
                    let arm =
                        rotate(self.body.kinematics.rotation(node, &batch.human), &Vec3::constant(vector.0));
                    let moment = arm.cross(force);
                    batch.human.wrenches[node].angular += moment;
                    sum += moment;
                }
                batch.human.wrenches[pelvis_node].angular += -sum;
            }
        }
        cost
    }

    /// J'r of what pulls at the robot; uses it up.
    #[inline(always)]
    pub(super) fn robot_gradient(&self, robot: &RobotModel, batch: &mut Batch) {
        let first = self.body.trajectories.len();
        for (index, body) in robot.tree.bodies().iter().enumerate().rev() {
            let wrench = batch.wrenches[index];
            if let Some(parent) = body.parent {
                batch.wrenches[parent] = batch.wrenches[parent] + wrench;
            }
            let twist = batch.placements[index].motion(body.motion_axis());
            batch.gradient[first + body.velocity_index] += twist.dot(wrench);
        }
    }

    /// J'J of all correspondences, added to the upper triangle of the batch's normal equations.
    #[inline(always)]
    pub(super) fn correspondence_normal(&self, robot: &RobotModel, count: Lane, batch: &mut Batch) {
        let first = self.body.trajectories.len();
        let size = batch.columns.len();
        let kinematics = &self.body.kinematics;
        let pelvis = kinematics.rotation(self.body.segment_nodes[0], &batch.human);
        for (index, (line, correspondence)) in self.lines.iter().zip(&robot.correspondences).enumerate() {
            let weight = Lane::constant(line.weight) * count;
            let derivative = &mut batch.derivative;
            derivative.clear();
            if self.target(index).is_none() {
                for turn in &line.human {
                    let mut arm = Vec3::zero();
                    for &vector in &turn.vectors {
                        let (segment, local) = correspondence.human[vector];
                        let node = self.body.segment_nodes[segment.index()];
                        arm += rotate(kinematics.rotation(node, &batch.human), &Vec3::constant(local.0));
                    }
                    let change = kinematics.twist_of(turn.node, &batch.human).angular.cross(arm);
                    derivative.push((turn.column, -rotate_back(pelvis, &change)));
                }
            }
            let ends = [correspondence.to, correspondence.from].map(|end| world(&batch.placements, end));
            for axis in &line.robot {
                let twist = batch.placements[axis.body].motion(robot.tree.bodies()[axis.body].motion_axis());
                let mut change = Vec3::zero();
                if axis.to {
                    change += twist.linear + twist.angular.cross(ends[0]);
                }
                if axis.from {
                    change = change - (twist.linear + twist.angular.cross(ends[1]));
                }
                let column = first + axis.coordinate;
                match derivative.last_mut() {
                    Some((last, sum)) if *last == column => *sum += change,
                    _ => derivative.push((column, change)),
                }
            }
            for (a, &(column, change)) in derivative.iter().enumerate() {
                let weighted = change.scale(weight);
                for &(other, other_change) in &derivative[..=a] {
                    let (high, low) = (column.max(other), column.min(other));
                    batch.normal[low * size + high] += weighted.dot(other_change);
                }
            }
        }
    }

    /// The human's vector of a correspondence, seen from the pelvis.
    #[inline(always)]
    pub(super) fn human_vector<S: Scalar>(
        &self,
        correspondence: &Correspondence,
        scratch: &HumanScratch<S>,
    ) -> Vec3<S> {
        let rotation = |segment: Segment| {
            self.body.kinematics.rotation(self.body.segment_nodes[segment.index()], scratch)
        };
        let mut sum = Vec3::zero();
        for &(segment, vector) in &correspondence.human {
            sum += rotate(rotation(segment), &Vec3::constant(vector.0));
        }
        rotate_back(rotation(Segment::Pelvis), &sum)
    }
}

/// Vectors of samples side by side.
#[inline(always)]
fn lanes_of(vectors: [Vec3<f64>; LANES]) -> Vec3<Lane> {
    Vec3([0, 1, 2].map(|axis| Lanes(vectors.map(|vector| vector.0[axis]))))
}

/// The robot's vector of a correspondence, seen from its base.
pub(crate) fn robot_vector(correspondence: &Correspondence, placements: &[Placement<f64>]) -> Vec3<f64> {
    world(placements, correspondence.to) - world(placements, correspondence.from)
}
