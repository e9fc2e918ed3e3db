//! Two bodies that are mirror images of each other.

use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::{Mat3, Placement, Tree, Vec3};

/// Where each body is in the configuration of zeros, in the world.
fn placements(tree: &Tree) -> Vec<Placement<f64>> {
    let mut placements: Vec<Placement<f64>> = Vec::with_capacity(tree.bodies().len());
    for body in tree.bodies() {
        let own = body.placement(body.offset);
        let outer = body.parent.map(|parent| placements[parent]);
        placements.push(outer.map_or(own, |outer| outer.compose(own)));
    }
    placements
}

/// The matrix that makes a body's standard parameters those of its mirror image in another body's frame, by
/// the plane y = 0 of the world through the middle between the two, with the robot at zero: mirrored limbs
/// stand opposite each other there.
///
/// A reflection p' = R·p + t takes mass m, first moment h and second moment Σ = ∫ p·pᵀ dm to m, R·h + m·t and
/// R·Σ·Rᵀ + (R·h)·tᵀ + t·(R·h)ᵀ + m·t·tᵀ; the inertia tensor is tr(Σ)·1 − Σ.
pub(crate) fn mirror_map(tree: &Tree, body: usize, image: usize) -> Vec<[f64; PARAMETERS_PER_BODY]> {
    let places = placements(tree);
    let (from, to) = (places[body], places[image]);
    let reflect = |v: Vec3<f64>| Vec3([v.0[0], -v.0[1], v.0[2]]);
    let columns = from.rotation.transpose().0.map(|axis| to.rotation.transpose_mul(reflect(Vec3(axis))).0);
    let rotation = Mat3(columns).transpose();
    // The plane goes through the middle: only y is mirrored about it.
    let middle = 0.5 * (from.translation.0[1] + to.translation.0[1]);
    let [x, y, z] = from.translation.0;
    let reflected = Vec3([x, 2.0 * middle - y, z]);
    let shift = to.rotation.transpose_mul(reflected - to.translation);
    let mut rows = vec![[0.0; PARAMETERS_PER_BODY]; PARAMETERS_PER_BODY];
    for column in 0..PARAMETERS_PER_BODY {
        let mut unit = [0.0; PARAMETERS_PER_BODY];
        unit[column] = 1.0;
        let image = reflected_parameters(&unit, rotation, shift);
        rows.iter_mut().zip(image).for_each(|(row, value)| row[column] = value);
    }
    rows
}

fn reflected_parameters(
    parameters: &[f64; PARAMETERS_PER_BODY],
    rotation: Mat3<f64>,
    shift: Vec3<f64>,
) -> [f64; PARAMETERS_PER_BODY] {
    let [mass, hx, hy, hz, xx, xy, yy, xz, yz, zz] = *parameters;
    let inertia = Mat3([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]);
    let second = complement(inertia, 0.5);
    let moment = rotation * Vec3([hx, hy, hz]);
    let outer = |a: Vec3<f64>, b: Vec3<f64>| Mat3(a.0.map(|a| b.0.map(|b| a * b)));
    let turned = rotation * second * rotation.transpose();
    let moved = turned + outer(moment, shift) + outer(shift, moment) + outer(shift, shift).scale(mass);
    let i = complement(moved, 1.0).0;
    let h = (moment + shift.scale(mass)).0;
    [mass, h[0], h[1], h[2], i[0][0], i[0][1], i[1][1], i[0][2], i[1][2], i[2][2]]
}

/// factor·tr(A)·1 − A: an inertia tensor from the second moment (factor 1) and back (½).
fn complement(matrix: Mat3<f64>, factor: f64) -> Mat3<f64> {
    let trace = (0..3).map(|axis| matrix.0[axis][axis]).sum::<f64>();
    Mat3::identity().scale(factor * trace) - matrix
}

#[cfg(test)]
mod tests {
    use super::mirror_map;
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
    use phiw_dynamics::{Tree, Workspace};

    /// Two arms on a torso; the right one's frames are turned, so that no sign alone makes one of the other.
    fn robot() -> Tree {
        let arm = |side: &str, y: f64, rpy: &str, axis: &str| {
            format!(
                r#"<link name="{side}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
                <joint name="{side}_arm" type="continuous"><parent link="base"/><child link="{side}"/><origin xyz="0.1 {y} 0.3" rpy="{rpy}"/><axis xyz="{axis}"/></joint>"#
            )
        };
        let (left, right) =
            (arm("left", 0.2, "0 0 0", "1 0 0"), arm("right", -0.2, "0 0 3.14159265358979323846", "1 0 0"));
        let urdf = format!(r#"<robot name="two"><link name="base"/>{left}{right}</robot>"#);
        read_urdf(&urdf, &UrdfOptions::default()).unwrap().tree
    }

    /// The mirror image of a motion needs the mirror image of the torques: of two arms that turn about x, one
    /// the other way round, and the right one's axis points back.
    #[test]
    fn mirrored_bodies_need_mirrored_torques() {
        let mut tree = robot();
        let left = [2.0, 0.1, 0.3, -0.4, 0.5, 0.02, 0.6, 0.03, -0.04, 0.7];
        let map = mirror_map(&tree, 0, 1);
        let right: Vec<f64> = map.iter().map(|row| row.iter().zip(&left).map(|(a, b)| a * b).sum()).collect();
        assert_eq!(right[0], 2.0);
        tree.set_inertial_parameters(&[&left[..], &right].concat()).unwrap();
        let mut torque = [0.0; 2];
        for (q, v, a) in [(0.4, 0.0, 0.0), (1.3, -0.7, 2.0), (-2.0, 1.5, -1.0)] {
            tree.inverse_dynamics(&[q, q], &[v, v], &[a, a], &mut Workspace::new(&tree), &mut torque)
                .unwrap();
            assert!((torque[0] - torque[1]).abs() < 1e-12, "{torque:?}");
        }
        // Back again is the body itself.
        let back = mirror_map(&tree, 1, 0);
        for (row, left) in back.iter().zip(left) {
            let found: f64 = row.iter().zip(&right).map(|(a, b)| a * b).sum();
            assert!((found - left).abs() < 1e-12);
        }
    }
}
