//! Equation (13) for a robot on its feet.

use crate::Controller;
use phiw_curriculum::CurriculumError;
use phiw_curriculum::standing::{Feet, VIRTUAL_JOINTS};
use phiw_dynamics::{DimensionError, Tree, Workspace, check_size};
use phiw_estimation::{Robot, RobotModel};
use phiw_identification::JointProperty;
use phiw_plant::{ComputedTorque, Gains, TorqueModel};

/// The joints of a virtual base come first.
const BASE: usize = VIRTUAL_JOINTS.len();

/// The belief's torque for the reference, what the feet carry taken off, and a PD on all motors.
///
/// The reference of the motors says where the base is, as long as the first foot stays in its place. Of
/// friction it knows the viscous.
#[derive(Clone, Debug)]
pub struct StandingFeedForward {
    /// K_p and K_d of the motors.
    pub gains: Gains,
    /// What it stands on.
    pub feet: Feet,
    /// Configuration, with virtual joints, in which it stands at first.
    pub stance: Vec<f64>,
}

impl Controller for StandingFeedForward {
    fn controller(&self, robot: &Robot, model: &RobotModel) -> Result<ComputedTorque, CurriculumError> {
        let tree = model.tree(robot)?;
        let size = tree.velocity_size();
        let mut viscous = vec![0.0; size];
        for effect in &model.effects {
            let joint = effect.spec.joints.first().and_then(|joint| tree.joint_index(joint));
            let property = robot.catalogue().joint_property(&effect.spec);
            if let (Some(JointProperty::Damping), Some(joint), [value]) =
                (property, joint, effect.parameters.as_slice())
            {
                viscous[joint] += value;
            }
        }
        let torque = StandingTorque {
            workspace: Workspace::new(&tree),
            tree,
            viscous,
            feet: self.feet.clone(),
            full: [self.stance.clone(), vec![0.0; size], vec![0.0; size]],
            force: vec![0.0; size],
        };
        Ok(ComputedTorque::new(torque, self.gains.clone()))
    }
}

struct StandingTorque {
    tree: Tree,
    workspace: Workspace<f64>,
    viscous: Vec<f64>,
    feet: Feet,
    /// q, v, a with virtual joints.
    full: [Vec<f64>; 3],
    force: Vec<f64>,
}

impl TorqueModel for StandingTorque {
    fn torque(&mut self, q: &[f64], v: &[f64], a: &[f64], torque: &mut [f64]) -> Result<(), DimensionError> {
        check_size("the model's torque", torque.len(), self.force.len() - BASE)?;
        for (full, part) in self.full.iter_mut().zip([q, v, a]) {
            check_size("the model's reference", part.len(), full.len() - BASE)?;
            full[BASE..].copy_from_slice(part);
        }
        let before: [f64; BASE] = std::array::from_fn(|joint| self.full[0][joint]);
        let [q, v, a] = &mut self.full;
        if self.feet.close(&[0, 1, 2, 3, 4, 5], &[0], [q, v, a]).is_err() {
            // No base fits a reference that was not made for these feet: it is believed to stay.
            q[..BASE].copy_from_slice(&before);
            v[..BASE].fill(0.0);
            a[..BASE].fill(0.0);
        }
        let [q, v, a] = &self.full;
        self.tree.inverse_dynamics(q, v, a, &mut self.workspace, &mut self.force)?;
        self.feet.take_load(q, &mut self.force)?;
        for (joint, torque) in torque.iter_mut().enumerate() {
            *torque = self.force[BASE + joint] + self.viscous[BASE + joint] * v[BASE + joint];
        }
        Ok(())
    }
}
