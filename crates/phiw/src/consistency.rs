//! Whether inertial parameters can belong to a real body.

use phiw_dynamics::InertialParameters;

/// Whether a distribution of positive mass has these parameters: the pseudo-inertia \[½tr(I)·1 − I, h; hᵀ, m\] is positive definite
/// (Wensing, Kim & Slotine 2018).
pub fn is_consistent(parameters: &InertialParameters) -> bool {
    let [m, hx, hy, hz, xx, xy, yy, xz, yz, zz] = *parameters;
    let half = 0.5 * (xx + yy + zz);
    let mut matrix =
        [[half - xx, -xy, -xz, hx], [-xy, half - yy, -yz, hy], [-xz, -yz, half - zz, hz], [hx, hy, hz, m]];
    // Cholesky: every pivot is positive, or the matrix is not positive definite.
    for pivot in 0..4 {
        // Not `<= 0.0`: a pivot that is not a number is not positive either.
        if matrix[pivot][pivot].partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater) {
            return false;
        }
        for row in pivot + 1..4 {
            let factor = matrix[row][pivot] / matrix[pivot][pivot];
            for column in pivot..4 {
                matrix[row][column] -= factor * matrix[pivot][column];
            }
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::is_consistent;
    use phiw_dynamics::{Inertia, Mat3, Vec3};

    #[test]
    fn real_bodies_are_consistent_and_others_are_not() {
        let body = |mass, center, moments: [f64; 3]| {
            let [x, y, z] = moments;
            let tensor = Mat3([[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]);
            Inertia::from_center_of_mass(mass, Vec3(center), tensor).parameters()
        };
        for (parameters, consistent) in [
            (body(2.0, [0.3, -1.0, 0.5], [0.1, 0.1, 0.1]), true),
            (body(2.0, [0.0; 3], [0.1, 0.1, 0.1999]), true),
            // One principal moment above the sum of the others.
            (body(2.0, [0.3, -1.0, 0.5], [0.1, 0.1, 0.21]), false),
            (body(-2.0, [0.0; 3], [0.1, 0.1, 0.1]), false),
            (body(2.0, [0.0; 3], [-0.1, 0.1, 0.1]), false),
            ([0.0; 10], false),
        ] {
            assert_eq!(is_consistent(&parameters), consistent, "{parameters:?}");
        }
    }
}
