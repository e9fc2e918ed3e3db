//! Forward dynamics: the articulated body algorithm (ABA), or the mass matrix where mimic joints close loops.

use crate::articulated_body::{ArticulatedBody, ArticulatedInertia};
use crate::check::check_size;
use crate::dense::ldl::solve_in_place;
use crate::inertia::Inertia;
use crate::scalar::Scalar;
use crate::{DimensionError, JointType, Placement, Spatial, Tree, Vec3, Workspace};

impl Tree {
    /// Acceleration under the generalised force: `M(q)⁻¹·(force − h(q, v))`, the inverse of
    /// [`Tree::inverse_dynamics`].
    ///
    /// Where the robot is singular (a joint with nothing but massless links behind it) the result is not
    /// finite.
    ///
    /// Featherstone 1983, in body frames; with mimic joints, whose tree is no tree, by way of the mass
    /// matrix.
    ///
    /// # Errors
    /// A slice or the workspace does not fit this robot.
    #[inline(always)]
    pub fn forward_dynamics<T: Scalar>(
        &self,
        q: &[T],
        v: &[T],
        force: &[T],
        workspace: &mut Workspace<T>,
        acceleration: &mut [T],
    ) -> Result<(), DimensionError> {
        self.check_state(q, v)?;
        check_size("the generalised force", force.len(), self.velocity_size)?;
        check_size("the acceleration", acceleration.len(), self.velocity_size)?;
        workspace.check(self)?;
        if self.has_mimic() {
            self.solve_mass_matrix([q, v, force], &[], workspace, acceleration);
            return Ok(());
        }
        let Workspace { placements, articulated, .. } = workspace;
        self.articulate_outward(q, v, placements, articulated);
        self.articulate_inward(force, placements, articulated, acceleration);
        self.accelerate_outward(q, placements, articulated, acceleration);
        Ok(())
    }

    /// Forward dynamics by way of the mass matrix, without checks. `rotor_inertia`: what is added to the
    /// diagonal, one for each joint, or empty.
    #[inline(always)]
    pub(crate) fn solve_mass_matrix<T: Scalar>(
        &self,
        [q, v, force]: [&[T]; 3],
        rotor_inertia: &[f64],
        workspace: &mut Workspace<T>,
        acceleration: &mut [T],
    ) {
        let Workspace { motions, forces, placements, composites, matrix, vector: bias, .. } = workspace;
        acceleration.fill(T::zero());
        self.newton_euler(q, v, acceleration, motions, forces, bias);
        for index in 0..self.velocity_size {
            acceleration[index] = force[index] - bias[index];
        }
        self.composite_rigid_bodies(q, placements, composites, matrix);
        let first_joint = self.velocity_size - self.joint_count();
        for (joint, &inertia) in rotor_inertia.iter().enumerate() {
            matrix[(first_joint + joint) * (self.velocity_size + 1)] += T::constant(inertia);
        }
        solve_in_place(matrix, acceleration, self.velocity_size);
    }

    /// Velocities, velocity-product terms and rigid inertias.
    #[inline(always)]
    fn articulate_outward<T: Scalar>(
        &self,
        q: &[T],
        v: &[T],
        placements: &mut [Placement<T>],
        articulated: &mut [ArticulatedBody<T>],
    ) {
        for (index, body) in self.bodies.iter().enumerate() {
            let (velocity, bias_acceleration) = if body.joint_type == JointType::Floating {
                placements[index] = crate::motion::floating_placement(q);
                (
                    Spatial { linear: Vec3([v[0], v[1], v[2]]), angular: Vec3([v[3], v[4], v[5]]) },
                    Spatial::zero(),
                )
            } else {
                placements[index] = body.placement(self.joint_position(body, q));
                let own = body.motion_axis().scale(v[body.velocity_index]);
                let carried = match body.parent {
                    Some(parent) => placements[index].motion_inverse(articulated[parent].velocity),
                    None => Spatial::zero(),
                };
                (carried + own, carried.cross_motion(own))
            };
            let rigid = Inertia::from_parameters(&body.inertial);
            let state = &mut articulated[index];
            state.velocity = velocity;
            state.bias_acceleration = bias_acceleration;
            state.bias_force = velocity.cross_force(rigid.times(velocity));
            state.inertia = ArticulatedInertia::rigid(rigid);
        }
    }

    /// Articulated inertias and bias forces; the base's acceleration where it floats.
    #[inline(always)]
    fn articulate_inward<T: Scalar>(
        &self,
        force: &[T],
        placements: &[Placement<T>],
        articulated: &mut [ArticulatedBody<T>],
        acceleration: &mut [T],
    ) {
        for (index, body) in self.bodies.iter().enumerate().rev() {
            if body.joint_type == JointType::Floating {
                solve_base(&mut articulated[index], force, acceleration);
                continue;
            }
            let state = &mut articulated[index];
            let axis = body.motion_axis();
            state.axis_force = state.inertia.times(axis);
            state.axis_inertia = axis.dot(state.axis_force);
            state.joint_force = force[body.velocity_index] - axis.dot(state.bias_force);
            let state = *state;
            if let Some(parent) = body.parent {
                let inertia = state.inertia.without_axis(state.axis_force, state.axis_inertia);
                let bias = state.bias_force
                    + inertia.times(state.bias_acceleration)
                    + state.axis_force.scale(state.joint_force / state.axis_inertia);
                let parent = &mut articulated[parent];
                parent.inertia = parent.inertia + inertia.moved(placements[index]);
                parent.bias_force = parent.bias_force + placements[index].force(bias);
            }
        }
    }

    /// Accelerations of the joints.
    #[inline(always)]
    fn accelerate_outward<T: Scalar>(
        &self,
        q: &[T],
        placements: &[Placement<T>],
        articulated: &mut [ArticulatedBody<T>],
        acceleration: &mut [T],
    ) {
        let upward = Spatial { linear: -Vec3::constant(self.gravity), angular: Vec3::zero() };
        for (index, body) in self.bodies.iter().enumerate() {
            if body.joint_type == JointType::Floating {
                // The recursion computes the base's acceleration minus gravity; the coordinates need the
                // acceleration itself.
                let rotation = crate::motion::floating_placement(q).rotation;
                let gravity = rotation.transpose_mul(Vec3::constant(self.gravity));
                for axis in 0..3 {
                    acceleration[axis] += gravity.0[axis];
                }
                continue;
            }
            let outer = body.parent.map_or(upward, |parent| articulated[parent].acceleration);
            let state = &mut articulated[index];
            let carried = placements[index].motion_inverse(outer) + state.bias_acceleration;
            let own = (state.joint_force - state.axis_force.dot(carried)) / state.axis_inertia;
            acceleration[body.velocity_index] = own;
            state.acceleration = carried + body.motion_axis().scale(own);
        }
    }
}

/// Solves the six equations of a floating base; leaves its acceleration less gravity in `acceleration` and in
/// the state.
#[inline(always)]
fn solve_base<T: Scalar>(state: &mut ArticulatedBody<T>, force: &[T], acceleration: &mut [T]) {
    let ArticulatedInertia { linear, coupling, angular } = state.inertia;
    let mut matrix = [T::zero(); 36];
    for row in 0..3 {
        for column in 0..3 {
            matrix[6 * row + column] = linear.0[row][column];
            matrix[6 * row + 3 + column] = coupling.0[row][column];
            matrix[6 * (row + 3) + column] = coupling.0[column][row];
            matrix[6 * (row + 3) + 3 + column] = angular.0[row][column];
        }
    }
    for axis in 0..3 {
        acceleration[axis] = force[axis] - state.bias_force.linear.0[axis];
        acceleration[axis + 3] = force[axis + 3] - state.bias_force.angular.0[axis];
    }
    solve_in_place(&mut matrix, &mut acceleration[..6], 6);
    state.acceleration = Spatial {
        linear: Vec3([acceleration[0], acceleration[1], acceleration[2]]),
        angular: Vec3([acceleration[3], acceleration[4], acceleration[5]]),
    };
}
