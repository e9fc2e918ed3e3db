//! The outward pass that inverse dynamics and the regressor share: how each body moves.

use crate::scalar::Scalar;
use crate::{Body, JointType, Mat3, Placement, Spatial, Tree, Vec3};

/// Motion of one body, in its own frame.
#[derive(Clone, Copy, Debug)]
pub struct BodyMotion<T> {
    /// The body's frame in its parent's (in the world's for a root).
    pub placement: Placement<T>,
    /// Angular velocity \[rad/s\].
    pub angular_velocity: Vec3<T>,
    /// Angular acceleration \[rad/s²\].
    pub angular_acceleration: Vec3<T>,
    /// Classical acceleration of the frame's origin less gravity \[m/s²\].
    pub proper_acceleration: Vec3<T>,
}

impl<T: Scalar> BodyMotion<T> {
    /// At rest at the origin.
    pub fn rest() -> Self {
        BodyMotion {
            placement: Placement::identity(),
            angular_velocity: Vec3::zero(),
            angular_acceleration: Vec3::zero(),
            proper_acceleration: Vec3::zero(),
        }
    }
}

impl Tree {
    /// Motion of every body for configuration `q`, velocity `v` and acceleration `a` (see [`Tree`] for their
    /// layout; a floating base's acceleration is the spatial one, Pinocchio's).
    ///
    /// Sizes are the caller's duty: `q` has [`Tree::configuration_size`] elements, `v` and `a`
    /// [`Tree::velocity_size`], `motions` one for each body.
    #[inline(always)]
    pub fn body_motions<T: Scalar>(&self, q: &[T], v: &[T], a: &[T], motions: &mut [BodyMotion<T>]) {
        for (index, body) in self.bodies.iter().enumerate() {
            motions[index] = match (body.joint_type, body.parent) {
                (JointType::Floating, _) => self.floating_motion(q, v, a),
                (_, Some(parent)) => self.child_motion(body, &motions[parent], q, v, a),
                (_, None) => {
                    let mut world = BodyMotion::rest();
                    world.proper_acceleration = -Vec3::constant(self.gravity);
                    self.child_motion(body, &world, q, v, a)
                }
            };
        }
    }

    #[inline(always)]
    fn floating_motion<T: Scalar>(&self, q: &[T], v: &[T], a: &[T]) -> BodyMotion<T> {
        let placement = floating_placement(q);
        let linear_velocity = Vec3([v[0], v[1], v[2]]);
        let angular_velocity = Vec3([v[3], v[4], v[5]]);
        BodyMotion {
            placement,
            angular_velocity,
            angular_acceleration: Vec3([a[3], a[4], a[5]]),
            proper_acceleration: Vec3([a[0], a[1], a[2]]) + angular_velocity.cross(linear_velocity)
                - placement.rotation.transpose_mul(Vec3::constant(self.gravity)),
        }
    }

    #[inline(always)]
    fn child_motion<T: Scalar>(
        &self,
        body: &Body,
        parent: &BodyMotion<T>,
        q: &[T],
        v: &[T],
        a: &[T],
    ) -> BodyMotion<T> {
        let placement = body.placement(self.joint_position(body, q));
        let Spatial { linear, angular } = body.motion_axis::<T>();
        let (speed, acceleration) = (v[body.velocity_index], a[body.velocity_index]);
        let rotation: Mat3<T> = placement.rotation.transpose();
        let carried = rotation * parent.angular_velocity;
        let turning = angular.scale(speed);
        let origin = parent.proper_acceleration
            + parent.angular_acceleration.cross(placement.translation)
            + parent.angular_velocity.cross(parent.angular_velocity.cross(placement.translation));
        let mut proper_acceleration = rotation * origin;
        if body.joint_type == JointType::Prismatic {
            proper_acceleration +=
                linear.scale(acceleration) + carried.cross(linear.scale(speed * T::constant(2.0)));
        }
        BodyMotion {
            placement,
            angular_velocity: carried + turning,
            angular_acceleration: rotation * parent.angular_acceleration
                + angular.scale(acceleration)
                + carried.cross(turning),
            proper_acceleration,
        }
    }
}

/// Placement of a floating base in the world, from the first seven coordinates of the configuration.
#[inline(always)]
pub(crate) fn floating_placement<T: Scalar>(q: &[T]) -> Placement<T> {
    Placement {
        rotation: Mat3::from_quaternion([q[3], q[4], q[5], q[6]]),
        translation: Vec3([q[0], q[1], q[2]]),
    }
}
