//! The mass matrix: the composite rigid body algorithm (CRBA).

use crate::check::check_size;
use crate::inertia::Inertia;
use crate::scalar::Scalar;
use crate::{DimensionError, JointType, Spatial, Tree, Vec3, Workspace};

impl Tree {
    /// The mass matrix `M(q)`: dense, symmetric, row by row, `velocity_size` × `velocity_size`.
    ///
    /// In the coordinates of [`Tree::inverse_dynamics`]; rows and columns of a mimic's leader include its
    /// followers.
    ///
    /// Walker & Orin 1982; Featherstone 2008, table 6.2.
    ///
    /// # Errors
    /// A slice or the workspace does not fit this robot.
    #[inline(always)]
    pub fn mass_matrix<T: Scalar>(
        &self,
        q: &[T],
        workspace: &mut Workspace<T>,
        matrix: &mut [T],
    ) -> Result<(), DimensionError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the mass matrix", matrix.len(), self.velocity_size * self.velocity_size)?;
        workspace.check(self)?;
        let Workspace { placements, composites, .. } = workspace;
        self.composite_rigid_bodies(q, placements, composites, matrix);
        Ok(())
    }

    #[inline(always)]
    pub(crate) fn composite_rigid_bodies<T: Scalar>(
        &self,
        q: &[T],
        placements: &mut [crate::Placement<T>],
        composites: &mut [Inertia<T>],
        matrix: &mut [T],
    ) {
        let size = self.velocity_size;
        for (index, body) in self.bodies.iter().enumerate() {
            composites[index] = Inertia::from_parameters(&body.inertial);
            if body.joint_type != JointType::Floating {
                placements[index] = body.placement(self.joint_position(body, q));
            }
        }
        matrix.fill(T::zero());
        // Backwards, so that a body's composite is complete when its turn comes.
        for (index, body) in self.bodies.iter().enumerate().rev() {
            if body.joint_type == JointType::Floating {
                fill_base_block(composites[index], matrix, size);
                continue;
            }
            let row = body.velocity_index;
            let axis = body.motion_axis();
            let mut force = composites[index].times(axis);
            matrix[row * size + row] += axis.dot(force);
            let mut inner = index;
            while let Some(outer) = self.bodies[inner].parent {
                force = placements[inner].force(force);
                let ancestor = &self.bodies[outer];
                if ancestor.joint_type == JointType::Floating {
                    let wrench = force.linear.0.into_iter().chain(force.angular.0);
                    for (column, component) in wrench.enumerate() {
                        matrix[row * size + column] += component;
                        matrix[column * size + row] += component;
                    }
                } else {
                    // A mimic joint may be its leader's descendant: both contributions are then on the
                    // diagonal, correctly.
                    let column = ancestor.velocity_index;
                    let coupling = ancestor.motion_axis().dot(force);
                    matrix[row * size + column] += coupling;
                    matrix[column * size + row] += coupling;
                }
                inner = outer;
            }
            if let Some(parent) = body.parent {
                composites[parent] = composites[parent] + composites[index].moved(placements[index]);
            }
        }
    }
}

#[inline(always)]
fn fill_base_block<T: Scalar>(composite: Inertia<T>, matrix: &mut [T], size: usize) {
    for column in 0..6 {
        let mut axis = [T::zero(); 6];
        axis[column] = T::one();
        let [x, y, z, rx, ry, rz] = axis;
        let force = composite.times(Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) });
        for (row, component) in force.linear.0.into_iter().chain(force.angular.0).enumerate() {
            matrix[row * size + column] = component;
        }
    }
}
