//! What may be otherwise in a log than in the URDF, and how a log becomes one of such a robot.

use phiw_dynamics::{Tree, Workspace};
use phiw_identification::checks::{Convention, ConventionKind};
use phiw_telemetry::Block;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A change, and what should be said of it.
pub struct Change {
    /// The row of the table that it counts for.
    pub name: &'static str,
    /// What is true of the changed log.
    pub kind: ConventionKind,
    /// On which joints; none where it is all of them.
    pub joints: Vec<usize>,
}

/// Factor between two scales, and cosine between two directions of gravity, up to which they are the same.
const SAME_SCALE: f64 = 1.25;
const SAME_DIRECTION: f64 = 0.94;

/// One change of each kind for a robot, on joints and by amounts that follow from the seed.
pub fn changes(tree: &Tree, seed: u64) -> Vec<Change> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let joints = tree.joint_count();
    let mut joint = || vec![random.random_range(0..joints)];
    let mut all = vec![
        Change { name: "one joint turns the other way", kind: ConventionKind::Axis, joints: joint() },
        Change { name: "one torque's sign", kind: ConventionKind::TorqueSign, joints: joint() },
        Change { name: "one position's sign", kind: ConventionKind::PositionSign, joints: joint() },
        Change { name: "one torque in mN·m", kind: ConventionKind::TorqueScale(1000.0), joints: joint() },
        Change {
            name: "one torque before its gear",
            kind: ConventionKind::TorqueScale(0.02),
            joints: joint(),
        },
    ];
    let mut of_all = |name, kind| all.push(Change { name, kind, joints: Vec::new() });
    of_all("all torques' signs", ConventionKind::AllTorqueSigns);
    of_all("all torques in kgf·cm", ConventionKind::AllTorqueScales(10.197));
    of_all("torques without the robot's weight", ConventionKind::NoGravity);
    of_all("on a wall", ConventionKind::Mounting([1.0, 0.0, 0.0]));
    of_all("under a ceiling", ConventionKind::Mounting([0.0, 0.0, 1.0]));
    if joints > 1 {
        let first = random.random_range(0..joints - 1);
        for (name, kind) in [
            ("two joints exchanged", ConventionKind::Swapped),
            ("two torques exchanged", ConventionKind::SwappedTorques),
        ] {
            all.push(Change { name, kind, joints: vec![first, first + 1] });
        }
        let constants = (0..joints).map(|_| 10.0_f64.powf(random.random_range(-1.7..0.7))).collect();
        let kind = ConventionKind::EachTorqueScale(constants);
        all.push(Change { name: "currents in place of torques", kind, joints: (0..joints).collect() });
    }
    all
}

impl Change {
    /// Makes the blocks of a robot that is as `tree` has it those of a log with this change.
    ///
    /// # Errors
    /// The blocks are not the robot's.
    pub fn apply(&self, tree: &Tree, blocks: &mut [Block]) -> anyhow::Result<()> {
        for block in blocks {
            let joints = block.joints;
            match &self.kind {
                ConventionKind::Axis => {
                    turn(&mut block.tau, joints, self.joints[0]);
                    turn_motion(block, self.joints[0]);
                }
                ConventionKind::TorqueSign => turn(&mut block.tau, joints, self.joints[0]),
                ConventionKind::PositionSign => turn_motion(block, self.joints[0]),
                ConventionKind::AllTorqueSigns => block.tau.iter_mut().for_each(|tau| *tau *= -1.0),
                ConventionKind::TorqueScale(scale) => times(&mut block.tau, joints, self.joints[0], *scale),
                ConventionKind::AllTorqueScales(scale) => block.tau.iter_mut().for_each(|tau| *tau *= scale),
                ConventionKind::EachTorqueScale(scales) => {
                    let scales = scales.iter().enumerate();
                    scales.for_each(|(joint, scale)| times(&mut block.tau, joints, joint, *scale));
                }
                ConventionKind::Swapped => {
                    for signal in [&mut block.q, &mut block.qd, &mut block.qdd, &mut block.tau] {
                        swap(signal, joints, &self.joints);
                    }
                }
                ConventionKind::SwappedTorques => swap(&mut block.tau, joints, &self.joints),
                ConventionKind::NoGravity => carry(tree, block, [0.0; 3])?,
                ConventionKind::Mounting(downward) => carry(tree, block, downward.map(|along| 9.81 * along))?,
            }
        }
        Ok(())
    }

    /// Whether what is said is this change: its kind, its joints, and nearly its amount.
    pub fn is(&self, said: &Convention) -> bool {
        let same = |a: f64, b: f64| a > 0.0 && b > 0.0 && (a / b).ln().abs() < SAME_SCALE.ln();
        match (&self.kind, &said.kind) {
            (ConventionKind::TorqueScale(a), ConventionKind::TorqueScale(b)) => {
                self.joints == said.joints && same(*a, *b)
            }
            (ConventionKind::AllTorqueScales(a), ConventionKind::AllTorqueScales(b)) => same(*a, *b),
            // A torque that carries next to nothing tells no unit.
            (ConventionKind::EachTorqueScale(a), ConventionKind::EachTorqueScale(b)) => {
                let told = said.joints.iter().zip(b);
                2 * b.len() > a.len()
                    && told.clone().filter(|(joint, b)| same(a[**joint], **b)).count() + 1 >= b.len()
            }
            (ConventionKind::Mounting(a), ConventionKind::Mounting(b)) => {
                a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() > SAME_DIRECTION
            }
            (own, said_kind) => own == said_kind && self.joints == said.joints,
        }
    }
}

/// Gives the torques another gravity than the tree's.
fn carry(tree: &Tree, block: &mut Block, gravity: [f64; 3]) -> anyhow::Result<()> {
    let mut other = tree.clone();
    other.gravity = gravity;
    let joints = block.joints;
    let mut workspace = Workspace::new(tree);
    let (mut own, mut instead, zeros) = (vec![0.0; joints], vec![0.0; joints], vec![0.0; joints]);
    for (q, tau) in block.q.chunks_exact(joints).zip(block.tau.chunks_exact_mut(joints)) {
        tree.inverse_dynamics(q, &zeros, &zeros, &mut workspace, &mut own)?;
        other.inverse_dynamics(q, &zeros, &zeros, &mut workspace, &mut instead)?;
        tau.iter_mut().zip(own.iter().zip(&instead)).for_each(|(tau, (own, instead))| *tau += instead - own);
    }
    Ok(())
}

fn times(values: &mut [f64], joints: usize, joint: usize, factor: f64) {
    values.iter_mut().skip(joint).step_by(joints).for_each(|value| *value *= factor);
}

fn turn(values: &mut [f64], joints: usize, joint: usize) {
    times(values, joints, joint, -1.0);
}

fn turn_motion(block: &mut Block, joint: usize) {
    let joints = block.joints;
    [&mut block.q, &mut block.qd, &mut block.qdd].into_iter().for_each(|values| turn(values, joints, joint));
}

fn swap(values: &mut [f64], joints: usize, pair: &[usize]) {
    values.chunks_exact_mut(joints).for_each(|row| row.swap(pair[0], pair[1]));
}
