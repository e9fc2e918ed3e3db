//! The directions in which a robot can move while some of its bodies stand still.

use faer::Mat;
use phiw_dynamics::{DimensionError, Placement, Tree, Vec3, check_index};

/// An orthonormal basis of the velocities at `q` that do not move `bodies`, as columns: the null space of
/// their Jacobians, from a QR decomposition.
pub(crate) fn free_directions(tree: &Tree, bodies: &[usize], q: &[f64]) -> Result<Mat<f64>, DimensionError> {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements)?;
    let size = tree.velocity_size();
    let mut rows = vec![0.0; 6 * size];
    let mut jacobian = Mat::zeros(6 * bodies.len(), size);
    for (place, &body) in bodies.iter().enumerate() {
        check_index("body", body, placements.len())?;
        tree.point_jacobian(&placements, body, Vec3::zero(), &mut rows)?;
        for row in 0..6 {
            for column in 0..size {
                jacobian[(6 * place + row, column)] = rows[row * size + column];
            }
        }
    }
    let basis = jacobian.transpose().qr().compute_Q();
    let held = jacobian.nrows().min(basis.ncols());
    Ok(Mat::from_fn(basis.nrows(), basis.ncols() - held, |row, column| basis[(row, held + column)]))
}
