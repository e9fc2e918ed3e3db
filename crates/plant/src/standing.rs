//! A robot that stands: where its base is when its soles lie on the floor, and how far it leans.

use phiw_dynamics::{Placement, Tree, Vec3, World};

use crate::PlantError;

/// The configuration with these joint positions and an upright base: at the origin, or so high that the
/// lowest corner of the soles touches the floor.
pub(crate) fn standing_configuration(
    tree: &Tree,
    world: &World,
    joints: &[f64],
) -> Result<Vec<f64>, PlantError> {
    let mut q = tree.neutral_configuration();
    let first_joint = q.len() - joints.len();
    q[first_joint..].copy_from_slice(joints);
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(&q, &mut placements)?;
    let corners = world.feet.iter().flat_map(|foot| {
        let placement = placements[foot.body];
        foot.sole.iter().map(move |&corner| placement.point(Vec3(corner)).0[2])
    });
    let lowest = corners.fold(f64::INFINITY, f64::min);
    if lowest.is_finite() {
        q[2] = -lowest;
    }
    Ok(q)
}

/// Angle between the base's z axis and the world's \[rad\], of a floating base's seven coordinates.
pub(crate) fn tilt(base: &[f64]) -> f64 {
    let [x, y] = [base[3], base[4]];
    // The zz element of the rotation matrix, by half angles so that small tilts keep their digits.
    2.0 * x.hypot(y).min(1.0).asin()
}

#[cfg(test)]
mod tests {
    use super::tilt;

    #[test]
    fn tilt_ignores_the_heading() {
        for (heading, lean) in [(0.0_f64, 0.0_f64), (1.0, 0.3), (-2.5, 1.2), (0.4, 1e-7)] {
            let (sh, ch) = (0.5 * heading).sin_cos();
            let (sl, cl) = (0.5 * lean).sin_cos();
            // Heading about z, then leaning about y.
            let base = [0.0, 0.0, 0.9, -sh * sl, ch * sl, sh * cl, ch * cl];
            assert!((tilt(&base) - lean).abs() < 1e-12, "{lean}");
        }
    }
}
