//! From a belief to the controller that follows a motion: equation (13).

use phiw_curriculum::CurriculumError;
use phiw_dynamics::DimensionError;
use phiw_estimation::{Robot, RobotModel};
use phiw_identification::{Design, JointProperty};
use phiw_plant::{ComputedTorque, Gains, RigidBodyModel, TorqueModel};
use phiw_telemetry::Block;

/// Makes a controller from what is believed.
pub trait Controller: Send + Sync {
    /// The controller that the robot is given.
    ///
    /// # Errors
    /// The model is not of this robot.
    fn controller(&self, robot: &Robot, model: &RobotModel) -> Result<ComputedTorque, CurriculumError>;
}

/// Equation (13): the model's torque for the reference, and a PD with these gains.
#[derive(Clone, Debug, PartialEq)]
pub struct FeedForward {
    /// K_p and K_d; small in the paper, so that tracking is poor.
    pub gains: Gains,
}

impl Controller for FeedForward {
    fn controller(&self, robot: &Robot, model: &RobotModel) -> Result<ComputedTorque, CurriculumError> {
        let gains = self.gains.clone();
        if let Some(viscous) = viscous_alone(robot, model) {
            return Ok(ComputedTorque::new(RigidBodyModel::new(model.tree(robot)?, viscous)?, gains));
        }
        let design = robot.design_of(model)?;
        let parameters = model.parameters(robot)?;
        Ok(ComputedTorque::new(
            ModelTorque { evaluation: vec![0.0; design.evaluation_width()], design, parameters },
            gains,
        ))
    }
}

/// The coefficients of viscous friction, if the model has no other effects.
fn viscous_alone(robot: &Robot, model: &RobotModel) -> Option<Vec<f64>> {
    let mut viscous = vec![0.0; robot.tree().joint_count()];
    for effect in &model.effects {
        let property = robot.catalogue().joint_property(&effect.spec);
        let (Some(JointProperty::Damping), [joint], [value]) =
            (property, effect.spec.joints.as_slice(), effect.parameters.as_slice())
        else {
            return None;
        };
        viscous[robot.tree().joint_index(joint)?] += value;
    }
    Some(viscous)
}

/// The torque of a rigid body with any effects: φ(q, q̇, q̈)·w of the grown model.
///
/// Each call is an instant by itself: effects with memory see no past.
struct ModelTorque {
    design: Design,
    parameters: Vec<f64>,
    evaluation: Vec<f64>,
}

impl TorqueModel for ModelTorque {
    fn torque(&mut self, q: &[f64], v: &[f64], a: &[f64], torque: &mut [f64]) -> Result<(), DimensionError> {
        let mut block = Block::unfiltered(q.len(), vec![0.0], [q, v, a].map(<[f64]>::to_vec), Vec::new());
        self.design.correct(&mut block);
        let mut scratch = self.design.scratch();
        scratch.begin(&block)?;
        scratch.evaluate(&block, 0, &mut self.evaluation)?;
        for (torque, layout) in torque.iter_mut().zip(self.design.rows()) {
            *torque = layout.torque(&self.evaluation, &self.parameters);
        }
        Ok(())
    }
}
