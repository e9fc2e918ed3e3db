//! Where bodies and the centre of mass are, and how they move with the coordinates.

use crate::check::{check_index, check_size};
use crate::inertia::Inertia;
use crate::scalar::Scalar;
use crate::{DimensionError, JointType, Mat3, Placement, Spatial, Tree, Vec3};

impl Tree {
    /// Placement of every body's frame in the world, one for each body.
    ///
    /// # Errors
    /// A slice does not fit this robot.
    #[inline(always)]
    pub fn forward_kinematics<T: Scalar>(
        &self,
        q: &[T],
        placements: &mut [Placement<T>],
    ) -> Result<(), DimensionError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the placements", placements.len(), self.bodies.len())?;
        for (index, body) in self.bodies.iter().enumerate() {
            placements[index] = if body.joint_type == JointType::Floating {
                crate::motion::floating_placement(q)
            } else {
                let local = body.placement(self.joint_position(body, q));
                body.parent.map_or(local, |parent| placements[parent].compose(local))
            };
        }
        Ok(())
    }

    /// Geometric Jacobian of a point fixed to a body: 6 × [`Tree::velocity_size`], row by row.
    ///
    /// Times `v` it gives the velocity of the point (three rows, m/s) and the body's angular velocity (three
    /// rows, rad/s), both along the world's axes. `placements` come from [`Tree::forward_kinematics`];
    /// `point` is in the body's frame \[m\].
    ///
    /// # Errors
    /// A slice does not fit this robot, or there is no such body.
    #[inline(always)]
    pub fn point_jacobian<T: Scalar>(
        &self,
        placements: &[Placement<T>],
        body: usize,
        point: Vec3<T>,
        jacobian: &mut [T],
    ) -> Result<(), DimensionError> {
        let size = self.velocity_size;
        check_size("the placements", placements.len(), self.bodies.len())?;
        check_size("the Jacobian", jacobian.len(), 6 * size)?;
        check_index("body", body, self.bodies.len())?;
        jacobian.fill(T::zero());
        let point = placements[body].point(point);
        self.for_each_axis(placements, body, point, |column, motion| {
            for row in 0..3 {
                jacobian[row * size + column] += motion.linear.0[row];
                jacobian[(row + 3) * size + column] += motion.angular.0[row];
            }
        });
        Ok(())
    }

    /// Total mass of the moving bodies \[kg\].
    pub fn mass(&self) -> f64 {
        self.bodies.iter().map(|body| body.inertial[0]).sum()
    }

    /// Centre of mass of the moving bodies, in the world \[m\]; not finite for a robot without mass.
    ///
    /// # Errors
    /// The placements (from [`Tree::forward_kinematics`]) do not fit this robot.
    #[inline(always)]
    pub fn center_of_mass<T: Scalar>(&self, placements: &[Placement<T>]) -> Result<Vec3<T>, DimensionError> {
        check_size("the placements", placements.len(), self.bodies.len())?;
        let moment = self.bodies.iter().zip(placements).fold(Vec3::zero(), |sum, (body, placement)| {
            let Inertia { mass, moment, .. } = Inertia::from_parameters(&body.inertial);
            sum + placement.rotation * moment + placement.translation.scale(mass)
        });
        Ok(moment.scale(T::constant(1.0 / self.mass())))
    }

    /// Jacobian of the centre of mass: 3 × [`Tree::velocity_size`], row by row; times `v` it gives the
    /// velocity of the centre of mass along the world's axes \[m/s\].
    ///
    /// # Errors
    /// A slice does not fit this robot.
    #[inline(always)]
    pub fn center_of_mass_jacobian<T: Scalar>(
        &self,
        placements: &[Placement<T>],
        jacobian: &mut [T],
    ) -> Result<(), DimensionError> {
        let size = self.velocity_size;
        check_size("the placements", placements.len(), self.bodies.len())?;
        check_size("the Jacobian", jacobian.len(), 3 * size)?;
        jacobian.fill(T::zero());
        let share = T::constant(1.0 / self.mass());
        for (index, body) in self.bodies.iter().enumerate() {
            let Inertia { mass, moment, .. } = Inertia::from_parameters(&body.inertial);
            let moment = placements[index].rotation * moment;
            let origin = placements[index].translation;
            self.for_each_axis(placements, index, origin, |column, motion| {
                // Mass times the velocity of the body's origin, and what turning adds to the first moment.
                let momentum = motion.linear.scale(mass) + motion.angular.cross(moment);
                for row in 0..3 {
                    jacobian[row * size + column] += momentum.0[row] * share;
                }
            });
        }
        Ok(())
    }

    /// For every coordinate that moves `body`, the motion that its unit velocity gives to `point` (in the
    /// world), along the world's axes. A coordinate comes more than once where mimic joints share it.
    #[inline(always)]
    fn for_each_axis<T: Scalar>(
        &self,
        placements: &[Placement<T>],
        body: usize,
        point: Vec3<T>,
        mut visit: impl FnMut(usize, Spatial<T>),
    ) {
        let mut next = Some(body);
        while let Some(index) = next {
            let body = &self.bodies[index];
            let Placement { rotation, translation } = placements[index];
            let lever = point - translation;
            if body.joint_type == JointType::Floating {
                let axes: Mat3<T> = rotation.transpose();
                for axis in 0..3 {
                    let direction = Vec3(axes.0[axis]);
                    visit(axis, Spatial { linear: direction, angular: Vec3::zero() });
                    visit(axis + 3, Spatial { linear: direction.cross(lever), angular: direction });
                }
            } else {
                let axis = body.motion_axis();
                let angular = rotation * axis.angular;
                let linear = rotation * axis.linear + angular.cross(lever);
                visit(body.velocity_index, Spatial { linear, angular });
            }
            next = body.parent;
        }
    }
}
