//! `<inertial>`: to standard parameters, and whether a real body can have it.

use super::joint::{is_usable, is_usable_pose, pose};
use super::robot::{Inertial, Link};
use super::{Finding, UrdfError};
use crate::inertia::Inertia;
use crate::{Mat3, Placement};

/// Share of the trace by which rounding in the file may break positivity or the triangle inequality.
const ROUNDING: f64 = 1e-6;

/// An error if any number of the link's inertial is NaN, infinite or larger than any robot's.
pub(super) fn check_finite(link: &Link) -> Result<(), UrdfError> {
    let Some(inertial) = &link.inertial else { return Ok(()) };
    let fields = [
        ("its mass", is_usable(inertial.mass)),
        ("its inertia", inertial.inertia.iter().all(|&x| is_usable(x))),
        ("the origin of its inertial", is_usable_pose(&inertial.origin)),
    ];
    match fields.into_iter().find(|(_, fine)| !fine) {
        Some((field, _)) => {
            Err(UrdfError::NotFinite { line: Some(link.line), kind: "link", name: link.name.clone(), field })
        }
        None => Ok(()),
    }
}

/// The inertia in the link's own frame.
pub(super) fn inertia(inertial: &Inertial) -> Inertia<f64> {
    let Placement { rotation, translation } = pose(&inertial.origin);
    Inertia::from_center_of_mass(
        inertial.mass,
        translation,
        rotation * tensor(inertial) * rotation.transpose(),
    )
}

/// What is wrong with a link's `<inertial>`.
pub(super) fn inspect(link: &str, inertial: &Inertial) -> Vec<Finding> {
    let (mass, tensor, link) = (inertial.mass, tensor(inertial), link.to_owned());
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

fn tensor(inertial: &Inertial) -> Mat3<f64> {
    let [xx, xy, xz, yy, yz, zz] = inertial.inertia;
    Mat3([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
}
