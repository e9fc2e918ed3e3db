//! The kinematic tree: bodies in depth-first order, each behind one joint.

use crate::scalar::Scalar;
use crate::{Mat3, Placement, Spatial, Vec3};

/// Number of standard inertial parameters of a body.
pub const PARAMETERS_PER_BODY: usize = 10;

/// Names of the standard parameters of a body, in their order (Pinocchio's): mass \[kg\], first moment
/// \[kg·m\], and inertia about the joint frame's origin \[kg·m²\].
pub const PARAMETER_NAMES: [&str; PARAMETERS_PER_BODY] =
    ["m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz"];

/// The standard parameters of one body, in its joint frame, in the order of [`PARAMETER_NAMES`].
pub type InertialParameters = [f64; PARAMETERS_PER_BODY];

/// How a body moves against its parent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum JointType {
    /// Six degrees of freedom against the world; only ever the first body.
    Floating,
    /// Turns about the axis within limits.
    Revolute,
    /// Turns about the axis without limits.
    Continuous,
    /// Slides along the axis.
    Prismatic,
}

/// Limits of a joint; an absent one is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointLimits {
    /// Lowest position \[rad, m\].
    pub lower: f64,
    /// Highest position \[rad, m\].
    pub upper: f64,
    /// Largest speed \[rad/s, m/s\].
    pub velocity: f64,
    /// Largest torque or force \[N·m, N\].
    pub effort: f64,
}

/// One moving body and the joint before it.
#[derive(Clone, Debug)]
pub struct Body {
    /// Name of the joint in the URDF (`"floating_base"` for a floating base).
    pub joint: String,
    /// Name of the link in the URDF that the joint carries; links behind fixed joints are merged into it.
    pub link: String,
    /// Index of the parent body; `None` is the world.
    pub parent: Option<usize>,
    /// How it moves.
    pub joint_type: JointType,
    /// The joint frame at zero position, seen from the parent body's joint frame.
    pub origin: Placement<f64>,
    /// Unit axis in the joint frame (unused for a floating base).
    pub axis: Vec3<f64>,
    /// Limits of the joint.
    pub limits: JointLimits,
    /// Index of the body's first velocity coordinate. Mimic joints share that of their leader.
    pub velocity_index: usize,
    /// Position = `ratio` · coordinate + `offset`; 1 and 0 but for `<mimic>` joints.
    pub ratio: f64,
    /// See `ratio` \[rad, m\].
    pub offset: f64,
    /// Whether this joint follows another (`<mimic>`).
    pub mimic: bool,
    /// Viscous friction that the URDF declares \[N·m·s/rad, N·s/m\].
    pub damping: f64,
    /// Coulomb friction that the URDF declares \[N·m, N\].
    pub friction: f64,
    /// Standard parameters that the URDF declares, fixed links merged.
    pub inertial: InertialParameters,
    /// The three matrices of R(q) = A + sin q · B + (1 − cos q) · C (Rodrigues), with the origin's rotation
    /// multiplied in.
    pub(crate) rotation_terms: [Mat3<f64>; 3],
}

/// A robot: bodies in depth-first order, parents before children.
///
/// Velocity coordinates: six for a floating base (linear and angular velocity of the base in its own frame),
/// then one for each joint that moves by itself. Configuration: `[x, y, z, qx, qy, qz, qw]` for a floating
/// base, then one position for each joint. The URDF reader in [`crate::urdf`] builds it.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(crate) name: String,
    pub(crate) bodies: Vec<Body>,
    pub(crate) velocity_size: usize,
    /// For each joint coordinate (floating base left out), the body it moves first-hand.
    pub(crate) joint_bodies: Vec<usize>,
    /// Gravity in the world frame \[m/s²\].
    pub gravity: [f64; 3],
}

impl Body {
    /// Placement of the body's frame in its parent's, for the joint position `position` \[rad, m\].
    #[inline(always)]
    pub fn placement<T: Scalar>(&self, position: T) -> Placement<T> {
        match self.joint_type {
            JointType::Prismatic => {
                let origin = self.origin.cast::<T>();
                let along = Vec3::constant((self.origin.rotation * self.axis).0);
                Placement {
                    rotation: origin.rotation,
                    translation: origin.translation + along.scale(position),
                }
            }
            _ => {
                let (sine, cosine) = position.sin_cos();
                let [a, b, c] = self.rotation_terms;
                let versine = T::one() - cosine;
                let mut rotation = Mat3::constant(a.0);
                for row in 0..3 {
                    for column in 0..3 {
                        rotation.0[row][column] +=
                            T::constant(b.0[row][column]) * sine + T::constant(c.0[row][column]) * versine;
                    }
                }
                Placement { rotation, translation: Vec3::constant(self.origin.translation.0) }
            }
        }
    }

    /// The joint's motion axis in its own frame (times `ratio`, so that coordinates of a mimic's leader can
    /// be used).
    #[inline(always)]
    pub fn motion_axis<T: Scalar>(&self) -> Spatial<T> {
        let axis = Vec3::constant(self.axis.scale(self.ratio).0);
        match self.joint_type {
            JointType::Prismatic => Spatial { linear: axis, angular: Vec3::zero() },
            _ => Spatial { linear: Vec3::zero(), angular: axis },
        }
    }

    pub(crate) fn rotation_terms(origin: &Placement<f64>, axis: Vec3<f64>) -> [Mat3<f64>; 3] {
        let skew = Mat3::skew(axis);
        [origin.rotation, origin.rotation * skew, origin.rotation * skew * skew]
    }
}

impl Tree {
    /// The robot's name.
    pub fn name(&self) -> &str {
        &self.name
    }
    /// The bodies, parents before children.
    pub fn bodies(&self) -> &[Body] {
        &self.bodies
    }
    /// Whether the first body floats.
    pub fn is_floating(&self) -> bool {
        self.bodies.first().is_some_and(|body| body.joint_type == JointType::Floating)
    }
    /// Number of velocity coordinates (6 more than joints when the base floats).
    pub fn velocity_size(&self) -> usize {
        self.velocity_size
    }
    /// Number of configuration coordinates (7 more than joints when the base floats).
    pub fn configuration_size(&self) -> usize {
        self.velocity_size + usize::from(self.is_floating())
    }
    /// Number of joints that move by themselves (mimic joints do not count).
    pub fn joint_count(&self) -> usize {
        self.joint_bodies.len()
    }
    /// The joint that coordinate `joint` (0-based, floating base left out) moves.
    pub fn joint(&self, joint: usize) -> &Body {
        &self.bodies[self.joint_bodies[joint]]
    }
    /// Names of the joints that move by themselves, in the order of their coordinates.
    pub fn joint_names(&self) -> impl ExactSizeIterator<Item = &str> {
        self.joint_bodies.iter().map(|&body| self.bodies[body].joint.as_str())
    }
    /// Coordinate of a joint by name.
    pub fn joint_index(&self, name: &str) -> Option<usize> {
        self.joint_names().position(|joint| joint == name)
    }
    /// Whether any joint follows another.
    pub fn has_mimic(&self) -> bool {
        self.bodies.iter().any(|body| body.mimic)
    }
    /// Standard parameters of all bodies, concatenated.
    pub fn inertial_parameters(&self) -> Vec<f64> {
        self.bodies.iter().flat_map(|body| body.inertial).collect()
    }
    /// Replaces the standard parameters of all bodies.
    ///
    /// # Errors
    /// [`crate::DimensionError`] if there are not ten for each body.
    pub fn set_inertial_parameters(&mut self, parameters: &[f64]) -> Result<(), crate::DimensionError> {
        crate::check::check_size(
            "inertial parameters",
            parameters.len(),
            PARAMETERS_PER_BODY * self.bodies.len(),
        )?;
        for (body, values) in self.bodies.iter_mut().zip(parameters.chunks_exact(PARAMETERS_PER_BODY)) {
            body.inertial.copy_from_slice(values);
        }
        Ok(())
    }
    /// Joint part of a configuration: without the seven coordinates of a floating base.
    pub fn joint_configuration<'a, T>(&self, configuration: &'a [T]) -> &'a [T] {
        &configuration[if self.is_floating() { 7 } else { 0 }..]
    }
    /// Position of the joint of `body` for a configuration; zero for a floating base.
    #[inline(always)]
    pub(crate) fn joint_position<T: Scalar>(&self, body: &Body, configuration: &[T]) -> T {
        let index = body.velocity_index + usize::from(self.is_floating());
        configuration[index] * T::constant(body.ratio) + T::constant(body.offset)
    }
}
