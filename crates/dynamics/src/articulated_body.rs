//! The quantities of one body in the articulated body algorithm.

use crate::inertia::Inertia;
use crate::scalar::Scalar;
use crate::{Mat3, Placement, Spatial, Vec3};

/// Inertia of a body whose joints behind it are free to move: `force = A·a + B·α`, `moment = Bᵀ·a + C·α`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArticulatedInertia<T> {
    pub linear: Mat3<T>,
    pub coupling: Mat3<T>,
    pub angular: Mat3<T>,
}

/// What the three passes hand on for one body.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ArticulatedBody<T> {
    pub velocity: Spatial<T>,
    /// Velocity-product acceleration v × S q̇.
    pub bias_acceleration: Spatial<T>,
    pub inertia: ArticulatedInertia<T>,
    pub bias_force: Spatial<T>,
    /// I·S.
    pub axis_force: Spatial<T>,
    /// SᵀIS, the inertia that the joint feels.
    pub axis_inertia: T,
    /// τ − Sᵀp.
    pub joint_force: T,
    /// Spatial acceleration less gravity.
    pub acceleration: Spatial<T>,
}

impl<T: Scalar> Default for ArticulatedBody<T> {
    fn default() -> Self {
        ArticulatedBody {
            velocity: Spatial::zero(),
            bias_acceleration: Spatial::zero(),
            inertia: ArticulatedInertia::rigid(Inertia::zero()),
            bias_force: Spatial::zero(),
            axis_force: Spatial::zero(),
            axis_inertia: T::zero(),
            joint_force: T::zero(),
            acceleration: Spatial::zero(),
        }
    }
}

impl<T: Scalar> ArticulatedInertia<T> {
    #[inline(always)]
    pub fn rigid(inertia: Inertia<T>) -> Self {
        ArticulatedInertia {
            linear: Mat3::identity().scale(inertia.mass),
            coupling: Mat3::skew(-inertia.moment),
            angular: inertia.tensor,
        }
    }

    #[inline(always)]
    pub fn times(&self, motion: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.linear * motion.linear + self.coupling * motion.angular,
            angular: self.coupling.transpose_mul(motion.linear) + self.angular * motion.angular,
        }
    }

    /// Without what moves along the joint: `I − (I·S)(I·S)ᵀ / (SᵀIS)`.
    #[inline(always)]
    pub fn without_axis(&self, axis_force: Spatial<T>, axis_inertia: T) -> Self {
        let Spatial { linear, angular } = axis_force;
        let scaled = axis_force.scale(T::one() / axis_inertia);
        ArticulatedInertia {
            linear: self.linear - outer(linear, scaled.linear),
            coupling: self.coupling - outer(linear, scaled.angular),
            angular: self.angular - outer(angular, scaled.angular),
        }
    }

    /// The same inertia seen from the outer frame.
    #[inline(always)]
    pub fn moved(&self, placement: Placement<T>) -> Self {
        let Placement { rotation, translation } = placement;
        let turned = |matrix: Mat3<T>| rotation * matrix * rotation.transpose();
        let lever = Mat3::skew(translation);
        let linear = turned(self.linear);
        let coupling = turned(self.coupling);
        let moved_coupling = coupling - linear * lever;
        ArticulatedInertia {
            linear,
            coupling: moved_coupling,
            angular: turned(self.angular) - coupling.transpose() * lever + lever * moved_coupling,
        }
    }
}

impl<T: Scalar> std::ops::Add for ArticulatedInertia<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        ArticulatedInertia {
            linear: self.linear + other.linear,
            coupling: self.coupling + other.coupling,
            angular: self.angular + other.angular,
        }
    }
}

#[inline(always)]
fn outer<T: Scalar>(column: Vec3<T>, row: Vec3<T>) -> Mat3<T> {
    Mat3(column.0.map(|x| row.scale(x).0))
}
