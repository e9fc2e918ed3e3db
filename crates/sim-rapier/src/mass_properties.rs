//! A body's inertia as Rapier holds it: principal moments and axes about the centre of mass, by their
//! inverses.

use crate::error;
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::{BackendError, Body, Vec3};
use rapier3d_f64::math::{Matrix, Rotation, Vector};
use rapier3d_f64::na::{Matrix3, SymmetricEigen};
use rapier3d_f64::prelude::MassProperties;

/// Smallest principal moment, over the largest, that inverting twice leaves with ten digits.
const SLENDEREST: f64 = 1e-6;

/// Centre of mass in the body's frame; its origin for a body without mass.
pub(crate) fn center_of_mass(body: &Body) -> Vec3<f64> {
    let Inertia { mass, moment, .. } = Inertia::from_parameters(&body.inertial);
    if mass > 0.0 { moment.scale(1.0 / mass) } else { Vec3::zero() }
}

/// The body's mass properties, its centre of mass at `center` of the rigid body's frame.
///
/// The principal axes come from an iterative decomposition: Rapier's own solves a cubic and then for one axis
/// after the other, and where two moments are close the tensor that it keeps is another one (by 39 % in the
/// test below).
pub(crate) fn mass_properties(body: &Body, center: Vec3<f64>) -> Result<MassProperties, BackendError> {
    let inertia = Inertia::from_parameters(&body.inertial);
    let [x, y, z] = center.0;
    if inertia.mass < 0.0 {
        return Err(error(format!(
            "{} has the mass {} kg: it must not be negative",
            body.link, inertia.mass
        )));
    }
    let tensor = inertia.tensor_about_center_of_mass(center_of_mass(body)).0;
    let SymmetricEigen { eigenvalues, mut eigenvectors } =
        Matrix3::from_fn(|row, column| tensor[row][column]).symmetric_eigen();
    let largest = eigenvalues.amax();
    let origin_scale = inertia.tensor.0.iter().flatten().fold(0.0_f64, |scale, x| scale.max(x.abs()));
    // What rounding leaves of a point mass, or of no mass.
    if largest <= 1e-14 * origin_scale {
        return Ok(MassProperties::with_principal_inertia_frame(
            Vector::new(x, y, z),
            inertia.mass,
            Vector::ZERO,
            Rotation::IDENTITY,
        ));
    }
    if eigenvalues.min() < SLENDEREST * largest {
        return Err(error(format!(
            "the principal moments of inertia of {} are {:.3e}, {:.3e} and {:.3e} kg·m²: Rapier needs all to be positive, \
             and the smallest not below a millionth of the largest",
            body.link, eigenvalues[0], eigenvalues[1], eigenvalues[2]
        )));
    }
    if eigenvectors.determinant() < 0.0 {
        eigenvectors = -eigenvectors;
    }
    let axis = |column: usize| {
        Vector::new(eigenvectors[(0, column)], eigenvectors[(1, column)], eigenvectors[(2, column)])
    };
    Ok(MassProperties::with_principal_inertia_frame(
        Vector::new(x, y, z),
        inertia.mass,
        Vector::new(eigenvalues[0], eigenvalues[1], eigenvalues[2]),
        Rotation::from_mat3(&Matrix::from_cols(axis(0), axis(1), axis(2))).normalize(),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
    use phiw_dynamics::{Mat3, Placement};

    /// Largest element of the difference, over the largest of `tensor`.
    fn error_of(properties: &MassProperties, tensor: &[[f64; 3]; 3]) -> f64 {
        let found = properties.reconstruct_inertia_matrix();
        let (mut error, mut scale) = (0.0_f64, 0.0_f64);
        for row in 0..3 {
            for column in 0..3 {
                error = error.max((found.col(column)[row] - tensor[row][column]).abs());
                scale = scale.max(tensor[row][column].abs());
            }
        }
        error / scale
    }

    /// A body with two principal moments that differ in the ninth digit, turned by some angles.
    #[test]
    fn close_principal_moments_keep_their_digits() {
        let mut worst: [f64; 2] = [0.0; 2];
        let mut body = random_tree(1, &RandomTreeOptions::default()).unwrap().bodies()[0].clone();
        for step in 0..200 {
            let half = 0.01 * step as f64;
            let (sine, cosine) = half.sin_cos();
            let rotation = Mat3::from_quaternion([0.6 * sine, 0.0, 0.8 * sine, cosine]);
            let tensor = Mat3([[0.1, 0.0, 0.0], [0.0, 0.1 + 1e-10, 0.0], [0.0, 0.0, 0.17]]);
            let inertia = Inertia::from_center_of_mass(2.0, Vec3::zero(), tensor)
                .moved(Placement { rotation, translation: Vec3::zero() });
            body.inertial = inertia.parameters();
            let ours = mass_properties(&body, Vec3::zero()).unwrap();
            worst[0] = worst[0].max(error_of(&ours, &inertia.tensor.0));
            let [a, b, c] = inertia.tensor.transpose().0.map(Vector::from_array);
            let theirs = MassProperties::with_inertia_matrix(Vector::ZERO, 2.0, Matrix::from_cols(a, b, c));
            worst[1] = worst[1].max(error_of(&theirs, &inertia.tensor.0));
        }
        println!("relative error {:.1e}, Rapier's own decomposition {:.1e}", worst[0], worst[1]);
        assert!(worst[0] < 1e-14, "{:e}", worst[0]);
    }
}
