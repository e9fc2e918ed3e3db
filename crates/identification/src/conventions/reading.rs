//! A way of reading a log's columns as a robot's joints.

use phiw_dynamics::{JointType, Tree};

/// Which column is which joint's, and which way it counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Reading {
    /// For each joint whose position column is its own.
    pub position_of: Vec<usize>,
    /// For each joint whose torque column is its own.
    pub torque_of: Vec<usize>,
    /// What a joint's position is multiplied by.
    pub position_sign: Vec<f64>,
    /// What a joint's torque is multiplied by.
    pub torque_factor: Vec<f64>,
    /// What gravity does in the URDF's root frame \[m/s²\]; zeros where the torques do not carry the robot's
    /// weight.
    pub gravity: [f64; 3],
}

/// How a log may differ from the URDF.
#[derive(Clone, Debug, PartialEq)]
pub enum ConventionKind {
    /// The joint turns the other way: position and torque have the other sign.
    Axis,
    /// The torque has the other sign, the position not.
    TorqueSign,
    /// The position has the other sign, the torque not.
    PositionSign,
    /// All torques have the other sign.
    AllTorqueSigns,
    /// The torque is so many times what it should be: a gear ratio, a torque constant, a unit.
    TorqueScale(f64),
    /// Two joints have each other's columns.
    Swapped,
    /// Two joints have each other's torques.
    SwappedTorques,
    /// Every torque is in a unit of its own: so many times what it should be, joint by joint, as far as the
    /// masses of the URDF are right.
    EachTorqueScale(Vec<f64>),
    /// All torques are so many times what the masses of the URDF ask for.
    AllTorqueScales(f64),
    /// The torques lack what holds the robot's weight.
    NoGravity,
    /// The robot is mounted otherwise than its URDF stands: gravity points this way in the root link's frame,
    /// a vector of length one.
    Mounting([f64; 3]),
}

impl Reading {
    /// Every column is what its name says.
    pub fn as_named(tree: &Tree) -> Self {
        let joints = tree.joint_count();
        Reading {
            position_of: (0..joints).collect(),
            torque_of: (0..joints).collect(),
            position_sign: vec![1.0; joints],
            torque_factor: vec![1.0; joints],
            gravity: tree.gravity,
        }
    }

    /// The same, read otherwise on `joints`.
    pub fn with(&self, kind: &ConventionKind, joints: &[usize]) -> Self {
        let mut reading = self.clone();
        match (kind, joints) {
            (ConventionKind::NoGravity, _) => reading.gravity = [0.0; 3],
            (ConventionKind::Mounting(downward), _) => {
                reading.gravity = downward.map(|along| along * STANDARD_GRAVITY);
            }
            (ConventionKind::AllTorqueSigns, _) => {
                reading.torque_factor.iter_mut().for_each(|factor| *factor *= -1.0);
            }
            (ConventionKind::Swapped, &[a, b]) => {
                reading.position_of.swap(a, b);
                reading.torque_of.swap(a, b);
            }
            (ConventionKind::SwappedTorques, &[a, b]) => reading.torque_of.swap(a, b),
            (ConventionKind::Axis, _) => joints.iter().for_each(|&joint| {
                reading.position_sign[joint] *= -1.0;
                reading.torque_factor[joint] *= -1.0;
            }),
            (ConventionKind::PositionSign, _) => {
                joints.iter().for_each(|&joint| reading.position_sign[joint] *= -1.0);
            }
            (ConventionKind::TorqueSign, _) => {
                joints.iter().for_each(|&joint| reading.torque_factor[joint] *= -1.0);
            }
            (ConventionKind::TorqueScale(scale), _) => {
                joints.iter().for_each(|&joint| reading.torque_factor[joint] /= scale);
            }
            (ConventionKind::EachTorqueScale(scales), _) => {
                joints.iter().zip(scales).for_each(|(&joint, scale)| reading.torque_factor[joint] /= scale);
            }
            (ConventionKind::AllTorqueScales(scale), _) => {
                reading.torque_factor.iter_mut().for_each(|factor| *factor /= scale);
            }
            (ConventionKind::Swapped | ConventionKind::SwappedTorques, _) => {}
        }
        reading
    }
}

/// The ways in which a log may be read otherwise, mounting and scales of torques apart. Of many joints only
/// neighbours are swapped.
pub(super) fn alternatives(tree: &Tree) -> Vec<(ConventionKind, Vec<usize>)> {
    let joints = tree.joint_count();
    let mut all = vec![(ConventionKind::AllTorqueSigns, Vec::new()), (ConventionKind::NoGravity, Vec::new())];
    for joint in 0..joints {
        for kind in [ConventionKind::TorqueSign, ConventionKind::Axis, ConventionKind::PositionSign] {
            all.push((kind, vec![joint]));
        }
    }
    let is_prismatic = |joint| tree.joint(joint).joint_type == JointType::Prismatic;
    let reach = if joints <= MOST_JOINTS_WITH_ALL_PAIRS { joints } else { 2 };
    for a in 0..joints {
        for b in (a + 1..joints.min(a + reach)).filter(|&b| is_prismatic(a) == is_prismatic(b)) {
            all.push((ConventionKind::SwappedTorques, vec![a, b]));
            all.push((ConventionKind::Swapped, vec![a, b]));
        }
    }
    all
}

/// Joints up to which any two may have each other's columns.
const MOST_JOINTS_WITH_ALL_PAIRS: usize = 8;
/// What bodies weigh for each kilogram \[m/s²\].
const STANDARD_GRAVITY: f64 = 9.81;
