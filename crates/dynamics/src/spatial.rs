//! Vectors, rotations and placements in space, generic over the scalar.
//!
//! Spatial vectors keep their linear and angular halves apart, linear first (Pinocchio's order).

use crate::scalar::Scalar;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

/// A vector in 3-D space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<T>(pub [T; 3]);

/// A 3×3 matrix, `0[row][column]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mat3<T>(pub [[T; 3]; 3]);

/// Where a frame is, seen from another: `x_outer = rotation · x_inner + translation`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement<T> {
    /// Columns are the inner frame's axes in the outer frame.
    pub rotation: Mat3<T>,
    /// The inner frame's origin in the outer frame \[m\].
    pub translation: Vec3<T>,
}

/// A spatial motion (velocity, acceleration, joint axis) or force (force, moment), in one frame and at its
/// origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spatial<T> {
    /// Linear velocity, or force.
    pub linear: Vec3<T>,
    /// Angular velocity, or moment.
    pub angular: Vec3<T>,
}

impl<T: Scalar> Vec3<T> {
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Vec3([T::zero(); 3])
    }
    /// A constant vector.
    #[inline(always)]
    pub fn constant(value: [f64; 3]) -> Self {
        Vec3(value.map(T::constant))
    }
    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }
    /// The vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Vec3([b * z - c * y, c * x - a * z, a * y - b * x])
    }
    /// The vector times a scalar.
    #[inline(always)]
    pub fn scale(self, factor: T) -> Self {
        let [x, y, z] = self.0;
        Vec3([x * factor, y * factor, z * factor])
    }
}

impl<T: Scalar> Add for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Vec3([self.0[0] + other.0[0], self.0[1] + other.0[1], self.0[2] + other.0[2]])
    }
}
impl<T: Scalar> Sub for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Vec3([self.0[0] - other.0[0], self.0[1] - other.0[1], self.0[2] - other.0[2]])
    }
}
impl<T: Scalar> Neg for Vec3<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3(self.0.map(|x| -x))
    }
}
impl<T: Scalar> AddAssign for Vec3<T> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Scalar> Mat3<T> {
    /// The identity.
    #[inline(always)]
    pub fn identity() -> Self {
        Self::constant([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])
    }
    /// A constant matrix.
    #[inline(always)]
    pub fn constant(value: [[f64; 3]; 3]) -> Self {
        Mat3(value.map(|row| row.map(T::constant)))
    }
    /// The matrix of `v ×`.
    #[inline(always)]
    pub fn skew(v: Vec3<T>) -> Self {
        let ([x, y, z], o) = (v.0, T::zero());
        Mat3([[o, -z, y], [z, o, -x], [-y, x, o]])
    }
    /// The transpose.
    #[inline(always)]
    pub fn transpose(self) -> Self {
        let m = self.0;
        Mat3([[m[0][0], m[1][0], m[2][0]], [m[0][1], m[1][1], m[2][1]], [m[0][2], m[1][2], m[2][2]]])
    }
    /// `selfᵀ · v`.
    #[inline(always)]
    pub fn transpose_mul(self, v: Vec3<T>) -> Vec3<T> {
        self.transpose() * v
    }
    /// The matrix times a scalar.
    #[inline(always)]
    pub fn scale(self, factor: T) -> Self {
        Mat3(self.0.map(|row| row.map(|x| x * factor)))
    }
    /// The rotation of a unit quaternion `(x, y, z, w)`.
    #[inline(always)]
    pub fn from_quaternion(quaternion: [T; 4]) -> Self {
        let [x, y, z, w] = quaternion;
        let (one, two) = (T::one(), T::constant(2.0));
        Mat3([
            [one - two * (y * y + z * z), two * (x * y - z * w), two * (x * z + y * w)],
            [two * (x * y + z * w), one - two * (x * x + z * z), two * (y * z - x * w)],
            [two * (x * z - y * w), two * (y * z + x * w), one - two * (x * x + y * y)],
        ])
    }
}

impl<T: Scalar> Mul<Vec3<T>> for Mat3<T> {
    type Output = Vec3<T>;
    #[inline(always)]
    fn mul(self, v: Vec3<T>) -> Vec3<T> {
        // No `map`: its closure is not inlined for SIMD scalars, and whole matrices are copied.
        let [a, b, c] = self.0;
        Vec3([Vec3(a).dot(v), Vec3(b).dot(v), Vec3(c).dot(v)])
    }
}
impl<T: Scalar> Mul for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let [a, b, c] = other.transpose().0;
        let [x, y, z] = [self * Vec3(a), self * Vec3(b), self * Vec3(c)];
        Mat3([x.0, y.0, z.0]).transpose()
    }
}
impl<T: Scalar> Add for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Mat3([0, 1, 2].map(|i| (Vec3(a[i]) + Vec3(b[i])).0))
    }
}
impl<T: Scalar> Sub for Mat3<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Mat3([0, 1, 2].map(|i| (Vec3(a[i]) - Vec3(b[i])).0))
    }
}

impl<T: Scalar> Placement<T> {
    /// The frame itself.
    #[inline(always)]
    pub fn identity() -> Self {
        Placement { rotation: Mat3::identity(), translation: Vec3::zero() }
    }
    /// `self` followed by `inner`.
    #[inline(always)]
    pub fn compose(self, inner: Self) -> Self {
        Placement {
            rotation: self.rotation * inner.rotation,
            translation: self.translation + self.rotation * inner.translation,
        }
    }
    /// The outer frame seen from the inner.
    #[inline(always)]
    pub fn inverse(self) -> Self {
        Placement {
            rotation: self.rotation.transpose(),
            translation: -self.rotation.transpose_mul(self.translation),
        }
    }
    /// A point of the inner frame, in the outer.
    #[inline(always)]
    pub fn point(self, inner: Vec3<T>) -> Vec3<T> {
        self.rotation * inner + self.translation
    }
    /// A motion given in the inner frame, in the outer.
    #[inline(always)]
    pub fn motion(self, inner: Spatial<T>) -> Spatial<T> {
        let angular = self.rotation * inner.angular;
        Spatial { linear: self.rotation * inner.linear + self.translation.cross(angular), angular }
    }
    /// A motion given in the outer frame, in the inner.
    #[inline(always)]
    pub fn motion_inverse(self, outer: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: self.rotation.transpose_mul(outer.linear - self.translation.cross(outer.angular)),
            angular: self.rotation.transpose_mul(outer.angular),
        }
    }
    /// A force given in the inner frame, in the outer.
    #[inline(always)]
    pub fn force(self, inner: Spatial<T>) -> Spatial<T> {
        let linear = self.rotation * inner.linear;
        Spatial { linear, angular: self.rotation * inner.angular + self.translation.cross(linear) }
    }
}

impl Placement<f64> {
    /// The same placement on another scalar.
    #[inline(always)]
    pub fn cast<T: Scalar>(self) -> Placement<T> {
        Placement {
            rotation: Mat3::constant(self.rotation.0),
            translation: Vec3::constant(self.translation.0),
        }
    }
}

impl<T: Scalar> Spatial<T> {
    /// Zero.
    #[inline(always)]
    pub fn zero() -> Self {
        Spatial { linear: Vec3::zero(), angular: Vec3::zero() }
    }
    /// Power of a force along a motion (or the other way round).
    #[inline(always)]
    pub fn dot(self, other: Self) -> T {
        self.linear.dot(other.linear) + self.angular.dot(other.angular)
    }
    /// This velocity × another motion: how that motion changes when it is carried along.
    #[inline(always)]
    pub fn cross_motion(self, motion: Self) -> Self {
        Spatial {
            linear: self.angular.cross(motion.linear) + self.linear.cross(motion.angular),
            angular: self.angular.cross(motion.angular),
        }
    }
    /// This velocity ×* a force (or momentum): how that force changes when it is carried along.
    #[inline(always)]
    pub fn cross_force(self, force: Self) -> Self {
        Spatial {
            linear: self.angular.cross(force.linear),
            angular: self.angular.cross(force.angular) + self.linear.cross(force.linear),
        }
    }
    /// The motion times a scalar.
    #[inline(always)]
    pub fn scale(self, factor: T) -> Self {
        Spatial { linear: self.linear.scale(factor), angular: self.angular.scale(factor) }
    }
}
impl<T: Scalar> Add for Spatial<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Spatial { linear: self.linear + other.linear, angular: self.angular + other.angular }
    }
}
