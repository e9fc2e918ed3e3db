//! What the robot stands on.

use crate::Error;
use crate::arguments::NextArguments;
use phiw_curriculum::CurriculumError;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Foot, InertialParameters, Placement, Tree, Vec3};
use phiw_plant::feet_from_toml;
use phiw_zmp::{Stance, SupportPolygon};
use std::path::Path;

/// Corners of soles that are less than this above the lowest touch the floor \[m\].
const CONTACT_HEIGHT: f64 = 2e-3;

/// The link that no joint moves, and the floor under it.
pub struct Standing {
    /// Standard parameters of the base link, in its frame.
    pub base_link: InertialParameters,
    /// The floor and the region that carries; none for a robot that is bolted down.
    pub stance: Option<Stance>,
}

impl Standing {
    /// Reads the URDF once more, as a robot that could fall.
    pub fn read(arguments: &NextArguments, xml: &str) -> Result<Self, Error> {
        let read = |held: &[(String, f64)]| {
            let options = UrdfOptions { floating_base: true, held: held.to_vec() };
            let wrong = |source| Error::Urdf { path: arguments.urdf.clone(), source: Box::new(source) };
            Ok::<Tree, Error>(read_urdf(xml, &options).map_err(wrong)?.tree)
        };
        let base_link = read(&arguments.hold)?.bodies()[0].inertial;
        let stance = match &arguments.support {
            Some(path) => Some(stance(path, &read(&[])?, &arguments.hold)?),
            None => None,
        };
        Ok(Standing { base_link, stance })
    }
}

/// The support polygon of the soles, seen from the base; `whole` is the robot with no joint held, so that every link has its name.
fn stance(path: &Path, whole: &Tree, held: &[(String, f64)]) -> Result<Stance, Error> {
    let text = crate::input::read_text(path, phiw_limits::Limits::default().toml_bytes)?;
    let feet =
        feet_from_toml(&text, whole).map_err(|source| Error::Support { path: path.to_owned(), source })?;
    for foot in &feet {
        check_still(path, foot, whole, held)?;
    }
    let mut q = whole.neutral_configuration();
    for (joint, position) in held {
        if let Some(index) = whole.joint_index(joint) {
            q[7 + index] = *position;
        }
    }
    let mut placements = vec![Placement::identity(); whole.bodies().len()];
    whole.forward_kinematics(&q, &mut placements).map_err(CurriculumError::from)?;
    let corners = feet
        .iter()
        .flat_map(|foot| foot.sole.iter().map(|&corner| placements[foot.body].point(Vec3(corner)).0[2]));
    let floor = corners.fold(f64::INFINITY, f64::min);
    let wrong = |source| Error::SupportPolygon { path: path.to_owned(), source };
    let polygon = SupportPolygon::from_feet(&feet, &placements, floor, CONTACT_HEIGHT).map_err(wrong)?;
    // Equation (10) shrinks to the origin; a base that does not stand over it has no use for that.
    let about = if polygon.contains([0.0; 2]) { [0.0; 2] } else { polygon.centroid() };
    Stance::new(polygon, about, floor).map_err(wrong)
}

/// An error if a joint that is not held moves the foot.
fn check_still(path: &Path, foot: &Foot, whole: &Tree, held: &[(String, f64)]) -> Result<(), Error> {
    let mut next = Some(foot.body);
    while let Some(index) = next.filter(|&index| index > 0) {
        let body = &whole.bodies()[index];
        if !held.iter().any(|(joint, _)| *joint == body.joint) {
            return Err(Error::FootMoves {
                path: path.to_owned(),
                link: whole.bodies()[foot.body].link.clone(),
                joint: body.joint.clone(),
            });
        }
        next = body.parent;
    }
    Ok(())
}
