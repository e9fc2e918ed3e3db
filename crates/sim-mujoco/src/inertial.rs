//! From standard parameters to what MuJoCo takes: centre of mass, principal axes, principal moments.

use crate::MujocoError;
use nalgebra::{Matrix3, Rotation3, SymmetricEigen, UnitQuaternion};
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::{Body, Mat3, Vec3};

/// A body's inertia about its centre of mass, along its principal axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PrincipalInertia {
    /// \[kg\].
    pub mass: f64,
    /// In the joint frame \[m\].
    pub center: [f64; 3],
    /// Orientation of the principal axes in the joint frame, `(w, x, y, z)`.
    pub axes: [f64; 4],
    /// \[kg·m²\].
    pub moments: [f64; 3],
}

impl PrincipalInertia {
    /// The body's parameters, whatever they are: identified ones need not be those of a real body.
    pub fn of(body: &Body) -> Result<Self, MujocoError> {
        let inertia = Inertia::<f64>::from_parameters(&body.inertial);
        let center = match inertia.mass {
            0.0 if inertia.moment == Vec3::zero() => Vec3::zero(),
            mass => inertia.moment.scale(1.0 / mass),
        };
        if !center.0.iter().all(|x| x.is_finite()) {
            return Err(MujocoError::NoCenterOfMass { link: body.link.clone(), mass: inertia.mass });
        }
        let tensor = inertia.tensor_about_center_of_mass(center).0;
        let eigen = SymmetricEigen::new(Matrix3::from_fn(|row, column| tensor[row][column]));
        let mut axes = eigen.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        Ok(PrincipalInertia {
            mass: inertia.mass,
            center: center.0,
            axes: quaternion(axes),
            moments: eigen.eigenvalues.into(),
        })
    }

    /// Whether neither the mass nor a principal moment is negative, up to rounding.
    pub fn is_positive(&self) -> bool {
        let largest = self.moments.iter().fold(0.0_f64, |largest, moment| largest.max(moment.abs()));
        self.mass >= 0.0 && self.moments.iter().all(|&moment| moment >= -1e-12 * largest)
    }
}

/// MuJoCo's quaternion `(w, x, y, z)` of a rotation.
pub(crate) fn quaternion_of(rotation: Mat3<f64>) -> [f64; 4] {
    quaternion(Matrix3::from_fn(|row, column| rotation.0[row][column]))
}

fn quaternion(rotation: Matrix3<f64>) -> [f64; 4] {
    let unit = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
    [unit.w, unit.i, unit.j, unit.k]
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_tree};

    fn parameters_of(principal: &PrincipalInertia) -> [f64; 10] {
        let [w, x, y, z] = principal.axes;
        let axes = Mat3::from_quaternion([x, y, z, w]);
        let mut moments = Mat3::constant([[0.0; 3]; 3]);
        (0..3).for_each(|axis| moments.0[axis][axis] = principal.moments[axis]);
        let tensor = axes * moments * axes.transpose();
        Inertia::from_center_of_mass(principal.mass, Vec3(principal.center), tensor).parameters()
    }

    fn check(body: &Body) {
        let back = parameters_of(&PrincipalInertia::of(body).unwrap());
        let scale = body.inertial.iter().fold(0.0_f64, |largest, x| largest.max(x.abs()));
        for (found, given) in back.iter().zip(&body.inertial) {
            assert!((found - given).abs() <= 1e-14 * scale, "{back:?} is not {:?}", body.inertial);
        }
    }

    #[test]
    fn nothing_is_lost_on_the_way_to_principal_axes() {
        let mut random = RandomNumbers::new(1);
        for seed in 0..20 {
            let tree = random_tree(seed, &RandomTreeOptions::default()).unwrap();
            for body in tree.bodies() {
                check(body);
                // Identified parameters may be those of no real body.
                let mut unreal = body.clone();
                unreal.inertial.iter_mut().for_each(|x| *x += random.uniform(-0.5, 0.5));
                check(&unreal);
            }
        }
    }

    #[test]
    fn a_first_moment_without_mass_is_refused() {
        let tree = random_tree(1, &RandomTreeOptions::default()).unwrap();
        let mut body = tree.bodies()[0].clone();
        body.inertial[0] = 0.0;
        let error = PrincipalInertia::of(&body).unwrap_err();
        assert!(matches!(error, MujocoError::NoCenterOfMass { mass: 0.0, .. }), "{error}");
        body.inertial[1..4].fill(0.0);
        check(&body);
    }
}
