//! The robot's side of the correspondence: which of its points answer to the human's.

use crate::human::{Segment, Side};
use phiw_dynamics::scalar::Scalar;
use phiw_dynamics::{DimensionError, Placement, Tree, Vec3};
use serde::Deserialize;

/// A point fixed to a body of the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyPoint {
    /// Index in [`Tree::bodies`]; `None` is the world.
    pub body: Option<usize>,
    /// In the body's joint frame \[m\].
    pub local: Vec3<f64>,
}

/// The points of an arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// Where the upper arm begins.
    pub shoulder: BodyPoint,
    /// Where the forearm begins.
    pub elbow: BodyPoint,
    /// Where the hand begins.
    pub wrist: BodyPoint,
    /// The hand's far point.
    pub hand: BodyPoint,
}

/// Robot points that a map names; what it leaves out is found from the robot's shape.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotMap {
    /// The left arm.
    #[serde(default)]
    pub left: Option<ArmMap>,
    /// The right arm.
    #[serde(default)]
    pub right: Option<ArmMap>,
}

/// Joints whose origins are an arm's points.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ArmMap {
    /// Joint at the shoulder.
    pub shoulder: String,
    /// Joint at the elbow.
    pub elbow: String,
    /// Joint at the wrist.
    pub wrist: String,
    /// The hand's far point in the last joint's frame \[m\].
    pub hand_at: [f64; 3],
    /// The last joint of the arm.
    pub hand: String,
}

/// A robot that can not follow a human upper body.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RobotError {
    /// A floating base.
    #[error("the robot's base floats; retargeting moves joints only: make its first joint a fixed one")]
    FloatingBase,
    /// No two arms were found.
    #[error(
        "no two arms of at least 4 joints were found (x forward, y left at zero position); name them in the map under \
         [robot.left] and [robot.right]"
    )]
    NoArms,
    /// The map names a joint that there is not.
    #[error("the map's [robot] names joint `{0}`, which the robot has not")]
    Joint(String),
}

/// One line of the correspondence: a vector between two points of the robot, and the human's that it should
/// equal.
#[derive(Clone, Debug)]
pub(crate) struct Correspondence {
    pub from: BodyPoint,
    pub to: BodyPoint,
    /// The human's vector: vectors fixed to segments \[m\], with the robot's lengths, in sum.
    pub human: Vec<(Segment, Vec3<f64>)>,
    /// Weight against the other lines.
    pub weight: f64,
}

/// A robot with two arms, and perhaps a torso and a head that move.
#[derive(Clone, Debug)]
pub struct RobotModel {
    pub(crate) tree: Tree,
    /// Left and right.
    pub(crate) arms: [Arm; 2],
    pub(crate) correspondences: Vec<Correspondence>,
    /// Correspondence of the torso and of the head, if the robot has them.
    pub(crate) torso: Option<usize>,
    pub(crate) head: Option<usize>,
}

/// Weight of torso and head against a hand. With w_g = 100 it is about that of a marker, so small enough that
/// markers say how the person sits and looks where the robot can not follow, and large enough that it follows
/// where it can.
const DIRECTION_WEIGHT: f64 = 0.001;

impl RobotModel {
    /// Finds shoulders, elbows, wrists, hands, torso and head of a robot, or takes those of the map.
    ///
    /// # Errors
    /// The base floats, there are no two arms, or the map names joints that are not there.
    pub fn new(tree: Tree, map: &RobotMap) -> Result<Self, RobotError> {
        if tree.is_floating() {
            return Err(RobotError::FloatingBase);
        }
        let placements = zero_placements(&tree).map_err(|_| RobotError::NoArms)?;
        let chains = Chains::of(&tree, &placements);
        let arm = |map: &Option<ArmMap>, side| match map {
            Some(map) => mapped_arm(&tree, map),
            None => chains.arm(&tree, &placements, side).ok_or(RobotError::NoArms),
        };
        let arms = [arm(&map.left, Side::Left)?, arm(&map.right, Side::Right)?];
        let at = |point: BodyPoint| world(&placements, point);
        let mut correspondences = Vec::new();
        for (arm, side) in arms.iter().zip(Side::BOTH) {
            let points = [arm.shoulder, arm.elbow, arm.wrist, arm.hand];
            let segments = [Segment::UpperArm(side), Segment::Forearm(side), Segment::Hand(side)];
            let mut human = Vec::new();
            for index in 0..3 {
                let length = norm(at(points[index + 1]) - at(points[index]));
                human.push((segments[index], Vec3([0.0, 0.0, -length])));
                let (from, to) = (arm.shoulder, points[index + 1]);
                correspondences.push(Correspondence { from, to, human: human.clone(), weight: 1.0 });
            }
        }
        let mut robot = RobotModel { tree, arms, correspondences, torso: None, head: None };
        robot.add_torso_and_head(&placements, &chains);
        Ok(robot)
    }

    /// The robot.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }
    /// Points of the left and the right arm.
    pub fn arms(&self) -> &[Arm; 2] {
        &self.arms
    }
    /// Base and middle of the shoulders, if joints move these against each other.
    pub fn trunk(&self) -> Option<[BodyPoint; 2]> {
        self.torso.map(|torso| [self.correspondences[torso].from, self.correspondences[torso].to])
    }
    /// The head's joint, and a point ahead of it where it looks, if it has one.
    pub fn gaze(&self) -> Option<[BodyPoint; 2]> {
        self.head.map(|head| [self.correspondences[head].from, self.correspondences[head].to])
    }
    /// Where one of its points is \[m\]; `placements` are those of its bodies.
    pub fn place(&self, point: BodyPoint, placements: &[Placement<f64>]) -> Vec3<f64> {
        world(placements, point)
    }
    /// Length of an arm from shoulder to hand, along its segments \[m\].
    pub fn arm_length_m(&self) -> f64 {
        self.correspondences[2].human.iter().map(|(_, vector)| norm(*vector)).sum()
    }

    /// All joints at zero, or at the limit next to it \[rad, m\].
    pub(crate) fn rest(&self) -> impl Iterator<Item = f64> {
        (0..self.tree.joint_count()).map(|joint| {
            let limits = self.tree.joint(joint).limits;
            0.0f64.max(limits.lower).min(limits.upper)
        })
    }

    fn add_torso_and_head(&mut self, placements: &[Placement<f64>], chains: &Chains) {
        let at = |point: BodyPoint| world(placements, point);
        let [left, right] = [self.arms[0].shoulder, self.arms[1].shoulder];
        let middle = (at(left) + at(right)).scale(0.5);
        if let Some(&chest) = chains.trunk.last() {
            let base = BodyPoint { body: None, local: placements[chains.trunk[0]].translation };
            let top = BodyPoint { body: Some(chest), local: placements[chest].inverse().point(middle) };
            let length = norm(middle - base.local);
            let human = vec![(Segment::Chest, Vec3([0.0, 0.0, length]))];
            self.torso = Some(self.correspondences.len());
            self.correspondences.push(Correspondence {
                from: base,
                to: top,
                human,
                weight: DIRECTION_WEIGHT,
            });
        }
        if let Some(&head) = chains.head.last() {
            // A point 0.3 m ahead of the head: where it looks.
            let ahead = placements[head].translation + Vec3([0.3, 0.0, 0.0]);
            let from = BodyPoint { body: Some(head), local: Vec3([0.0; 3]) };
            let to = BodyPoint { body: Some(head), local: placements[head].inverse().point(ahead) };
            let human = vec![(Segment::Head, Vec3([0.3, 0.0, 0.0]))];
            self.head = Some(self.correspondences.len());
            self.correspondences.push(Correspondence { from, to, human, weight: DIRECTION_WEIGHT });
        }
    }
}

/// The chains of bodies of an upper body.
struct Chains {
    /// Bodies that both arms hang on, from the base.
    trunk: Vec<usize>,
    /// Bodies of the left and the right arm, from the trunk.
    arms: [Vec<usize>; 2],
    /// Bodies of the head.
    head: Vec<usize>,
}

impl Chains {
    fn of(tree: &Tree, placements: &[Placement<f64>]) -> Self {
        let bodies = tree.bodies();
        let is_leaf = |body: usize| !bodies.iter().any(|other| other.parent == Some(body));
        let path = |leaf: usize| {
            let mut path = vec![leaf];
            while let Some(parent) = bodies[path[path.len() - 1]].parent {
                path.push(parent);
            }
            path.reverse();
            path
        };
        let paths: Vec<Vec<usize>> = (0..bodies.len()).filter(|&body| is_leaf(body)).map(path).collect();
        let shared = |a: &[usize], b: &[usize]| a.iter().zip(b).take_while(|(a, b)| a == b).count();
        // The two chains that part highest above the ground, to the left and to the right, are the arms.
        let mut best: Option<(f64, usize, usize)> = None;
        for (left, l) in paths.iter().enumerate() {
            for (right, r) in paths.iter().enumerate() {
                let common = shared(l, r);
                if l.len() < common + 4 || r.len() < common + 4 {
                    continue;
                }
                let [a, b] = [l[common], r[common]].map(|body| placements[body].translation.0);
                if a[1] > b[1] + 0.05 {
                    let height = a[2] + b[2] + 1e-3 * (l.len() + r.len()) as f64;
                    if best.is_none_or(|(highest, ..)| height > highest) {
                        best = Some((height, left, right));
                    }
                }
            }
        }
        let Some((_, left, right)) = best else {
            return Chains { trunk: vec![], arms: [vec![], vec![]], head: vec![] };
        };
        let common = shared(&paths[left], &paths[right]);
        let trunk = paths[left][..common].to_vec();
        let arms = [left, right].map(|arm| paths[arm][common..].to_vec());
        let others = paths.iter().filter(|path| {
            let part = shared(path, &paths[left]).max(shared(path, &paths[right]));
            part <= common && path.len() > part && path.starts_with(&trunk)
        });
        let height = |body: usize| placements[body].translation.0[2];
        let head = others
            .filter(|path| path.last().is_some_and(|&last| height(last) > height(arms[0][0])))
            .map(|path| path[common..].to_vec())
            .max_by_key(Vec::len);
        Chains { trunk, arms, head: head.unwrap_or_default() }
    }

    /// Shoulder at the second joint, elbow at the fourth, wrist at the last but one (the last, if the arm has
    /// few), hand at the last link's centre of mass or a hand's breadth further.
    fn arm(&self, tree: &Tree, placements: &[Placement<f64>], side: Side) -> Option<Arm> {
        let chain = &self.arms[usize::from(side == Side::Right)];
        let &last = chain.last()?;
        let origin = |body: usize| BodyPoint { body: Some(body), local: Vec3([0.0; 3]) };
        let (elbow, wrist) = (chain[3], if chain.len() >= 6 { chain[chain.len() - 2] } else { last });
        let [mass, x, y, z, ..] = tree.bodies()[last].inertial;
        let center = if mass > 0.0 { Vec3([x, y, z]).scale(1.0 / mass) } else { Vec3([0.0; 3]) };
        // A hand without a shape goes on in the direction of the forearm.
        let local = if norm(center) > 0.03 {
            center
        } else {
            let along = placements[last].translation - placements[elbow].translation;
            placements[last].rotation.transpose_mul(along.scale(0.09 / norm(along).max(1e-9)))
        };
        Some(Arm {
            shoulder: origin(chain[1]),
            elbow: origin(elbow),
            wrist: origin(wrist),
            hand: BodyPoint { body: Some(last), local },
        })
    }
}

fn mapped_arm(tree: &Tree, map: &ArmMap) -> Result<Arm, RobotError> {
    let body = |joint: &String| {
        let found = tree.bodies().iter().position(|body| body.joint == *joint);
        found.ok_or_else(|| RobotError::Joint(joint.clone()))
    };
    let origin = |joint| body(joint).map(|body| BodyPoint { body: Some(body), local: Vec3([0.0; 3]) });
    Ok(Arm {
        shoulder: origin(&map.shoulder)?,
        elbow: origin(&map.elbow)?,
        wrist: origin(&map.wrist)?,
        hand: BodyPoint { body: Some(body(&map.hand)?), local: Vec3(map.hand_at) },
    })
}

fn zero_placements(tree: &Tree) -> Result<Vec<Placement<f64>>, DimensionError> {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(&tree.neutral_configuration(), &mut placements)?;
    Ok(placements)
}

/// Where a point is in the world.
#[inline(always)]
pub(crate) fn world<S: Scalar>(placements: &[Placement<S>], point: BodyPoint) -> Vec3<S> {
    let local = Vec3::constant(point.local.0);
    point.body.map_or(local, |body| placements[body].point(local))
}

pub(crate) fn norm(vector: Vec3<f64>) -> f64 {
    vector.dot(vector).sqrt()
}
