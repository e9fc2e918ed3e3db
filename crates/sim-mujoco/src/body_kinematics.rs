//! How the bodies move, by MuJoCo's own kinematics.

use crate::MujocoBackend;
use crate::simulation::Simulation;
use phiw_dynamics::body_kinematics::{BodyJoint, BodyMotion, MotionSubspace};
use phiw_dynamics::check::check_size;
use phiw_dynamics::{BackendError, BodyKinematics, Spatial, Tree};

/// The joints before the bodies, their axes as MuJoCo's Jacobians have them.
pub(crate) fn body_joints(tree: &Tree, simulation: &mut Simulation) -> Vec<BodyJoint> {
    simulation.inverse();
    let mut joints = Vec::with_capacity(tree.bodies().len());
    for (index, body) in tree.bodies().iter().enumerate() {
        let floats = index == 0 && tree.is_floating();
        let motion_subspace = if floats {
            MotionSubspace::Floating
        } else {
            let axis = simulation.body_jacobian_column(index, body.velocity_index);
            let rotation = simulation.body_placement(index).rotation;
            MotionSubspace::Axis(Spatial {
                linear: rotation.transpose_mul(axis.linear),
                angular: rotation.transpose_mul(axis.angular),
            })
        };
        let (parent, velocity_index) = (body.parent, body.velocity_index);
        joints.push(BodyJoint { parent, velocity_index, motion_subspace });
    }
    joints
}

impl BodyKinematics for MujocoBackend {
    type Error = BackendError;

    fn body_count(&self) -> usize {
        self.body_joints.len()
    }

    fn body_joint(&self, body: usize) -> BodyJoint {
        self.body_joints[body]
    }

    fn gravity(&self) -> [f64; 3] {
        self.gravity
    }

    fn body_motions(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        motions: &mut [BodyMotion<f64>],
    ) -> Result<(), BackendError> {
        self.check_motion(q, v)?;
        check_size("the acceleration a", a.len(), v.len())?;
        check_size("the motions of bodies", motions.len(), self.body_joints.len())?;
        self.put_motion(q, v, a);
        let alone = self.alone.get_mut();
        alone.inverse();
        alone.accelerate_bodies();
        for (index, (motion, joint)) in motions.iter_mut().zip(&self.body_joints).enumerate() {
            let placement = alone.body_placement(index);
            let acceleration = alone.body_acceleration(index);
            *motion = BodyMotion {
                placement: match joint.parent {
                    Some(parent) => alone.body_placement(parent).inverse().compose(placement),
                    None => placement,
                },
                angular_velocity: alone.body_velocity(index).angular,
                angular_acceleration: acceleration.angular,
                proper_acceleration: acceleration.linear,
            };
        }
        Ok(())
    }
}
