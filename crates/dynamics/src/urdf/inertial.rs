//! `<inertial>`: to standard parameters, and whether a real body can have it.

use super::joint::{is_usable, is_usable_pose, pose};
use super::{Finding, UrdfError};
use crate::{Inertia, Mat3, Placement};
use urdf_rs::Link;

/// Share of the trace by which rounding in the file may break positivity or the triangle inequality.
const ROUNDING: f64 = 1e-6;

/// An error if any number of the link's inertial is NaN, infinite or larger than any robot's.
pub(super) fn check_finite(link: &Link) -> Result<(), UrdfError> {
    let i = &link.inertial.inertia;
    let fields = [
        ("its mass", is_usable(link.inertial.mass.value)),
        ("its inertia", [i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz].iter().all(|&x| is_usable(x))),
        ("the origin of its inertial", is_usable_pose(&link.inertial.origin)),
    ];
    match fields.into_iter().find(|(_, fine)| !fine) {
        Some((field, _)) => Err(UrdfError::NotFinite { kind: "link", name: link.name.clone(), field }),
        None => Ok(()),
    }
}

/// The link's inertia in its own frame.
pub(super) fn inertia(link: &Link) -> Inertia<f64> {
    let Placement { rotation, translation } = pose(&link.inertial.origin);
    Inertia::from_center_of_mass(
        link.inertial.mass.value,
        translation,
        rotation * tensor(link) * rotation.transpose(),
    )
}

/// What is wrong with an `<inertial>`.
pub(super) fn inspect(link: &Link) -> Vec<Finding> {
    let (mass, tensor) = (link.inertial.mass.value, tensor(link));
    let link = link.name.clone();
    let mut findings = Vec::new();
    let zero = tensor.0.as_flattened().iter().all(|&x| x == 0.0);
    if mass < 0.0 {
        findings.push(Finding::NegativeMass { link: link.clone(), mass });
    } else if mass == 0.0 {
        findings.push(Finding::ZeroMass { link: link.clone() });
    } else if zero {
        findings.push(Finding::ZeroInertia { link: link.clone(), mass });
    }
    let mut principal: [f64; 3] = nalgebra::Matrix3::from(tensor.0).symmetric_eigenvalues().into();
    principal.sort_by(f64::total_cmp);
    let [a, b, c] = principal;
    let tolerance = ROUNDING * principal.iter().map(|x| x.abs()).sum::<f64>();
    if a < -tolerance {
        findings.push(Finding::IndefiniteInertia { link, smallest: a });
    } else if c > a + b + tolerance {
        findings.push(Finding::TriangleInequality { link, principal });
    }
    findings
}

fn tensor(link: &Link) -> Mat3<f64> {
    let i = &link.inertial.inertia;
    Mat3([[i.ixx, i.ixy, i.ixz], [i.ixy, i.iyy, i.iyz], [i.ixz, i.iyz, i.izz]])
}
