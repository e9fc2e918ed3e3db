//! The contract between algorithms that need the motion of a robot's bodies and what provides it.

pub use crate::motion::BodyMotion;

use crate::check::check_size;
use crate::scalar::Scalar;
use crate::{DimensionError, JointType, Spatial, Tree, Vec3};

/// The joint before a body: what the body hangs on, and which coordinates move it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyJoint {
    /// Index of the parent body, which is smaller than the body's own; `None` is the world.
    pub parent: Option<usize>,
    /// Index of the first velocity coordinate that moves the joint. Joints that follow one leader share its
    /// coordinate.
    pub velocity_index: usize,
    /// How these coordinates move the body against its parent.
    pub motion_subspace: MotionSubspace,
}

/// The motions that a joint allows, as seen in the frame of the body behind it and at that frame's origin.
/// They do not depend on the configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum MotionSubspace {
    /// One coordinate, whose velocity times this axis is the body's velocity against its parent. A prismatic
    /// joint has a linear unit vector, a revolute joint an angular one; for a joint that follows another it
    /// is multiplied by the ratio.
    Axis(Spatial<f64>),
    /// Six coordinates of a floating base: the linear, then the angular velocity of the body in its own
    /// frame.
    Floating,
}

impl MotionSubspace {
    /// Number of coordinates.
    #[inline(always)]
    pub fn dimension(&self) -> usize {
        match self {
            MotionSubspace::Axis(_) => 1,
            MotionSubspace::Floating => 6,
        }
    }

    /// Writes the motion that unit velocity of each coordinate gives, one after the other; as many as there
    /// is room for.
    #[inline(always)]
    pub fn axes<T: Scalar>(&self, axes: &mut [Spatial<T>]) {
        match self {
            MotionSubspace::Axis(Spatial { linear, angular }) => {
                if let Some(axis) = axes.first_mut() {
                    *axis = Spatial { linear: Vec3::constant(linear.0), angular: Vec3::constant(angular.0) };
                }
            }
            MotionSubspace::Floating => {
                for (coordinate, axis) in axes.iter_mut().take(6).enumerate() {
                    *axis = Spatial::zero();
                    if coordinate < 3 {
                        axis.linear.0[coordinate] = T::one();
                    } else {
                        axis.angular.0[coordinate - 3] = T::one();
                    }
                }
            }
        }
    }
}

/// How the bodies of a robot hang together and how they move, whoever computes it: the little that the joint
/// torque regressor and the ZMP need to know of a robot.
///
/// A [`Tree`] provides it, and so may any library that knows where bodies are and how they accelerate;
/// neither dynamics nor inertial parameters are asked for. Algorithms take it by value, as readers are taken
/// by value in [`std::io`]: pass `&tree` or `&mut backend`.
///
/// **Bodies** come parents before children. The frame of a body is fixed to it, and otherwise the provider's
/// choice: the ten standard parameters that belong to the body ([`crate::inertia::PARAMETER_NAMES`]) are
/// those in this frame. **Coordinates** are those of [`Tree`]: on a floating base, which only the first body
/// can be, the configuration starts with `[x, y, z, qx, qy, qz, qw]`.
pub trait BodyKinematics<T: Scalar = f64> {
    /// What goes wrong where the motion is computed.
    type Error: From<DimensionError>;

    /// Number of moving bodies.
    fn body_count(&self) -> usize;

    /// The joint before the body `body`, which is below [`body_count`](Self::body_count).
    fn body_joint(&self, body: usize) -> BodyJoint;

    /// Gravity in the world frame \[m/s²\].
    fn gravity(&self) -> [f64; 3];

    /// The motion of every body for configuration `q`, velocity `v` and acceleration `a`, one for each body.
    ///
    /// # Errors
    /// A slice does not fit the robot, or the motion can not be computed.
    fn body_motions(
        &mut self,
        q: &[T],
        v: &[T],
        a: &[T],
        motions: &mut [BodyMotion<T>],
    ) -> Result<(), Self::Error>;

    /// Whether the first body floats.
    #[inline(always)]
    fn has_floating_base(&self) -> bool {
        self.body_count() > 0 && matches!(self.body_joint(0).motion_subspace, MotionSubspace::Floating)
    }
}

impl<T: Scalar> BodyKinematics<T> for &Tree {
    type Error = DimensionError;

    #[inline(always)]
    fn body_count(&self) -> usize {
        self.bodies.len()
    }

    #[inline(always)]
    fn body_joint(&self, body: usize) -> BodyJoint {
        let body = &self.bodies[body];
        let motion_subspace = match body.joint_type {
            JointType::Floating => MotionSubspace::Floating,
            _ => MotionSubspace::Axis(body.motion_axis()),
        };
        BodyJoint { parent: body.parent, velocity_index: body.velocity_index, motion_subspace }
    }

    #[inline(always)]
    fn gravity(&self) -> [f64; 3] {
        self.gravity
    }

    #[inline(always)]
    fn body_motions(
        &mut self,
        q: &[T],
        v: &[T],
        a: &[T],
        motions: &mut [BodyMotion<T>],
    ) -> Result<(), DimensionError> {
        self.check_state(q, v)?;
        check_size("the acceleration a", a.len(), self.velocity_size)?;
        check_size("the motions of bodies", motions.len(), self.bodies.len())?;
        Tree::body_motions(self, q, v, a, motions);
        Ok(())
    }
}

impl<T: Scalar, K: BodyKinematics<T> + ?Sized> BodyKinematics<T> for &mut K {
    type Error = K::Error;

    #[inline(always)]
    fn body_count(&self) -> usize {
        K::body_count(self)
    }

    #[inline(always)]
    fn body_joint(&self, body: usize) -> BodyJoint {
        K::body_joint(self, body)
    }

    #[inline(always)]
    fn gravity(&self) -> [f64; 3] {
        K::gravity(self)
    }

    #[inline(always)]
    fn body_motions(
        &mut self,
        q: &[T],
        v: &[T],
        a: &[T],
        motions: &mut [BodyMotion<T>],
    ) -> Result<(), K::Error> {
        K::body_motions(self, q, v, a, motions)
    }
}
