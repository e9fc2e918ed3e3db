//! Spatial inertia of a rigid body at an arbitrary origin: linear in the standard parameters, no division by
//! the mass.

pub use crate::tree::{InertialParameters, PARAMETER_NAMES, PARAMETERS_PER_BODY};

use crate::dense::Cholesky;
use crate::motion::BodyMotion;
use crate::scalar::Scalar;
use crate::{Mat3, Placement, Spatial, Vec3};

/// Inertia of a body (or of several welded together) in one frame, at its origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertia<T> {
    /// Mass \[kg\].
    pub mass: T,
    /// First moment: mass times centre of mass \[kg·m\].
    pub moment: Vec3<T>,
    /// Inertia tensor about the frame's origin \[kg·m²\].
    pub tensor: Mat3<T>,
}

impl<T: Scalar> Inertia<T> {
    /// No mass.
    #[inline(always)]
    pub fn zero() -> Self {
        Inertia { mass: T::zero(), moment: Vec3::zero(), tensor: Mat3::constant([[0.0; 3]; 3]) }
    }

    /// From the standard parameters, in the order of [`crate::inertia::PARAMETER_NAMES`].
    #[inline(always)]
    pub fn from_parameters(parameters: &InertialParameters) -> Self {
        let [mass, x, y, z, xx, xy, yy, xz, yz, zz] = *parameters;
        Inertia {
            mass: T::constant(mass),
            moment: Vec3::constant([x, y, z]),
            tensor: Mat3::constant([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]),
        }
    }

    /// The same body seen from the outer frame of `placement`, about the outer frame's origin.
    #[inline(always)]
    pub fn moved(self, placement: Placement<T>) -> Self {
        let Placement { rotation, translation } = placement;
        let moment = rotation * self.moment;
        let tensor = rotation * self.tensor * rotation.transpose();
        // I + 2(h·t)1 − htᵀ − thᵀ + m(t·t 1 − ttᵀ), written as I + (2h + mt)·t 1 − h tᵀ − t(h + mt)ᵀ
        let carried = moment + translation.scale(self.mass);
        let diagonal = (moment + carried).dot(translation);
        let mut shifted = tensor;
        for row in 0..3 {
            shifted.0[row][row] += diagonal;
            for column in 0..3 {
                shifted.0[row][column] -=
                    moment.0[row] * translation.0[column] + translation.0[row] * carried.0[column];
            }
        }
        Inertia { mass: self.mass, moment: carried, tensor: shifted }
    }

    /// Inertia times a motion: momentum of a velocity, or the force that gives an acceleration to a body at
    /// rest.
    #[inline(always)]
    pub fn times(self, motion: Spatial<T>) -> Spatial<T> {
        Spatial {
            linear: motion.linear.scale(self.mass) + motion.angular.cross(self.moment),
            angular: self.moment.cross(motion.linear) + self.tensor * motion.angular,
        }
    }

    /// The wrench, at the frame's origin, that the motion needs (Newton and Euler, gravity included).
    #[inline(always)]
    pub fn wrench(self, motion: &BodyMotion<T>) -> Spatial<T> {
        let omega = motion.angular_velocity;
        let Spatial { linear, angular } =
            self.times(Spatial { linear: motion.proper_acceleration, angular: motion.angular_acceleration });
        Spatial {
            linear: linear + omega.cross(omega.cross(self.moment)),
            angular: angular + omega.cross(self.tensor * omega),
        }
    }
}

impl<T: Scalar> std::ops::Add for Inertia<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Inertia {
            mass: self.mass + other.mass,
            moment: self.moment + other.moment,
            tensor: self.tensor + other.tensor,
        }
    }
}

impl Inertia<f64> {
    /// From mass \[kg\], centre of mass \[m\] and the tensor about the centre of mass \[kg·m²\].
    pub fn from_center_of_mass(mass: f64, center: Vec3<f64>, tensor: Mat3<f64>) -> Self {
        let at_center = Inertia { mass, moment: Vec3::zero(), tensor };
        at_center.moved(Placement { rotation: Mat3::identity(), translation: center })
    }

    /// The tensor about the point `center` of a body whose centre of mass that is.
    pub fn tensor_about_center_of_mass(self, center: Vec3<f64>) -> Mat3<f64> {
        let lever = Inertia::from_center_of_mass(self.mass, center, Inertia::zero().tensor);
        self.tensor - lever.tensor
    }

    /// Whether a distribution of positive mass has this inertia: the pseudo-inertia \[½tr(I)·1 − I, h; hᵀ,
    /// m\] is positive definite (Wensing, Kim & Slotine 2018).
    pub fn is_physical(&self) -> bool {
        let (Vec3(h), Mat3(tensor)) = (self.moment, self.tensor);
        let half = 0.5 * (tensor[0][0] + tensor[1][1] + tensor[2][2]);
        let entry = |row: usize, column: usize| match (row, column) {
            (3, 3) => self.mass,
            (3, axis) => h[axis],
            _ if row == column => half - tensor[row][row],
            _ => -tensor[row][column],
        };
        Cholesky::of(4, entry).is_some()
    }

    /// The standard parameters, in the order of [`crate::inertia::PARAMETER_NAMES`].
    pub fn parameters(self) -> InertialParameters {
        let ([x, y, z], i) = (self.moment.0, self.tensor.0);
        [self.mass, x, y, z, i[0][0], i[0][1], i[1][1], i[0][2], i[1][2], i[2][2]]
    }
}

#[cfg(test)]
mod tests {
    use super::Inertia;
    use crate::{Mat3, Vec3};

    #[test]
    fn real_bodies_are_physical_and_others_are_not() {
        let body = |mass, center, moments: [f64; 3]| {
            let [x, y, z] = moments;
            let tensor = Mat3([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
            Inertia::from_center_of_mass(mass, Vec3(center), tensor).parameters()
        };
        for (parameters, physical) in [
            (body(2.0, [0.3, -1.0, 0.5], [0.1, 0.1, 0.1]), true),
            (body(2.0, [0.0; 3], [0.1, 0.1, 0.1999]), true),
            // One principal moment above the sum of the others.
            (body(2.0, [0.3, -1.0, 0.5], [0.1, 0.1, 0.21]), false),
            (body(-2.0, [0.0; 3], [0.1, 0.1, 0.1]), false),
            (body(2.0, [0.0; 3], [-0.1, 0.1, 0.1]), false),
            ([0.0; 10], false),
        ] {
            assert_eq!(
                Inertia::<f64>::from_parameters(&parameters).is_physical(),
                physical,
                "{parameters:?}"
            );
        }
    }
}
