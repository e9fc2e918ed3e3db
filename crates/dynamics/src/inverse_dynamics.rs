//! Inverse dynamics: the recursive Newton-Euler algorithm (RNEA).

use crate::check::check_size;
use crate::inertia::Inertia;
use crate::motion::BodyMotion;
use crate::scalar::Scalar;
use crate::{DimensionError, JointType, Spatial, Tree, Workspace};

impl Tree {
    /// Generalised force that the motion `(q, v, a)` needs: `M(q)·a + h(q, v)`.
    ///
    /// `q` has [`Tree::configuration_size`] elements, `v`, `a` and `force` have [`Tree::velocity_size`].
    /// Torque \[N·m\] or force \[N\] for each joint; for a floating base first the force and moment on the
    /// base, in its own frame. The torque of a mimic's leader includes what its followers need. Friction is
    /// not part of it.
    ///
    /// Luh, Walker & Paul 1980, in body frames.
    ///
    /// # Errors
    /// A slice or the workspace does not fit this robot.
    #[inline(always)]
    pub fn inverse_dynamics<T: Scalar>(
        &self,
        q: &[T],
        v: &[T],
        a: &[T],
        workspace: &mut Workspace<T>,
        force: &mut [T],
    ) -> Result<(), DimensionError> {
        self.check_state(q, v)?;
        check_size("the acceleration a", a.len(), self.velocity_size)?;
        check_size("the generalised force", force.len(), self.velocity_size)?;
        workspace.check(self)?;
        let Workspace { motions, forces, .. } = workspace;
        self.newton_euler(q, v, a, motions, forces, force);
        Ok(())
    }

    /// [`Tree::inverse_dynamics`] without checks; leaves in `forces` the wrench that each joint transmits, in
    /// the frame of its body.
    #[inline(always)]
    pub(crate) fn newton_euler<T: Scalar>(
        &self,
        q: &[T],
        v: &[T],
        a: &[T],
        motions: &mut [BodyMotion<T>],
        forces: &mut [Spatial<T>],
        force: &mut [T],
    ) {
        self.body_motions(q, v, a, motions);
        for (index, body) in self.bodies.iter().enumerate() {
            forces[index] = Inertia::from_parameters(&body.inertial).wrench(&motions[index]);
        }
        force.fill(T::zero());
        for (index, body) in self.bodies.iter().enumerate().rev() {
            let wrench = forces[index];
            if body.joint_type == JointType::Floating {
                force[..3].copy_from_slice(&wrench.linear.0);
                force[3..6].copy_from_slice(&wrench.angular.0);
                continue;
            }
            force[body.velocity_index] += body.motion_axis().dot(wrench);
            if let Some(parent) = body.parent {
                forces[parent] = forces[parent] + motions[index].placement.force(wrench);
            }
        }
    }

    /// The wrench that the world gives to the robot in the motion that [`Tree::inverse_dynamics`] has just
    /// computed with this workspace: force, then moment about the world's origin, along the world's axes.
    pub(crate) fn base_wrench(&self, workspace: &Workspace<f64>) -> [f64; 6] {
        let mut total = Spatial::zero();
        for (index, body) in self.bodies.iter().enumerate() {
            if body.parent.is_none() {
                total = total + workspace.motions[index].placement.force(workspace.forces[index]);
            }
        }
        let ([fx, fy, fz], [mx, my, mz]) = (total.linear.0, total.angular.0);
        [fx, fy, fz, mx, my, mz]
    }
}
