//! What a robot stands on while the joints of its legs are held.

use crate::CurriculumError;
use phiw_dynamics::{Foot, Placement, Tree, Vec3};
use phiw_zmp::{Stance, SupportError, SupportPolygon};

/// Why feet give no support.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StanceError {
    /// A foot that joints move.
    #[error(
        "the foot `{link}` is moved by the joint `{joint}`, but motions are planned for a robot whose base stands still; hold its legs with --hold {joint},…"
    )]
    FootMoves {
        /// The foot's link.
        link: String,
        /// A joint between it and the base.
        joint: String,
    },
    /// Soles that carry nothing.
    #[error(transparent)]
    Support(#[from] SupportError),
    /// The kinematics of the robot.
    #[error(transparent)]
    Curriculum(#[from] CurriculumError),
}

/// How the floor is found under a robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StanceSettings {
    /// Corners of soles that are less than this above the lowest touch the floor \[m\]. Default: 2·10⁻³, the
    /// give of a rubber sole; not calibrated.
    pub contact_height: f64,
}

impl Default for StanceSettings {
    fn default() -> Self {
        StanceSettings { contact_height: 2e-3 }
    }
}

impl StanceSettings {
    /// The support polygon of the soles, seen from the base. `whole` is the robot with a floating base and no
    /// joint held, so that every link has its name; `held` are joints and their positions \[rad, m\].
    ///
    /// # Errors
    /// A joint that is not held moves a foot, or the soles have no area.
    pub fn stance(&self, whole: &Tree, feet: &[Foot], held: &[(String, f64)]) -> Result<Stance, StanceError> {
        for foot in feet {
            check_still(foot, whole, held)?;
        }
        let mut q = whole.neutral_configuration();
        let base = q.len() - whole.joint_count();
        for (joint, position) in held {
            if let Some(index) = whole.joint_index(joint) {
                q[base + index] = *position;
            }
        }
        let mut placements = vec![Placement::identity(); whole.bodies().len()];
        whole.forward_kinematics(&q, &mut placements).map_err(CurriculumError::from)?;
        let heights = feet
            .iter()
            .flat_map(|foot| foot.sole.iter().map(|&corner| placements[foot.body].point(Vec3(corner)).0[2]));
        let floor = heights.fold(f64::INFINITY, f64::min);
        let polygon = SupportPolygon::from_feet(feet, &placements, floor, self.contact_height)?;
        // Equation (10) shrinks to the origin; a base that does not stand over it has no use for that.
        let about = if polygon.contains([0.0; 2]) { [0.0; 2] } else { polygon.centroid() };
        Ok(Stance::new(polygon, about, floor)?)
    }
}

/// An error if a joint that is not held moves the foot.
fn check_still(foot: &Foot, whole: &Tree, held: &[(String, f64)]) -> Result<(), StanceError> {
    let mut next = Some(foot.body);
    while let Some(index) = next.filter(|&index| index > 0) {
        let body = &whole.bodies()[index];
        if !held.iter().any(|(joint, _)| *joint == body.joint) {
            let link = whole.bodies()[foot.body].link.clone();
            return Err(StanceError::FootMoves { link, joint: body.joint.clone() });
        }
        next = body.parent;
    }
    Ok(())
}
