//! The identified robot as MJCF.

use crate::Error;
use crate::analysis::Analysis;
use crate::exported::{Exported, header};
use phiw_mjcf::{RobotModel, impossible_bodies, write_mjcf};

/// Name of the file.
pub const FILE: &str = "identified.xml";

/// The robot with the identified inertial parameters, and what of the effects MuJoCo has: armature, damping,
/// friction loss, springs, motors, fixed tendons for couplings.
///
/// # Errors
/// A parameter is not finite.
pub fn identified_mjcf(analysis: &Analysis<'_>) -> Result<String, Error> {
    let tree = analysis.model.consistent_tree(&analysis.session.tree)?;
    let exported = Exported::of(analysis);
    let mut lines = header(analysis, FILE, &exported.left_out);
    lines.push("Friction loss turns at rest at once; geometry is in identified.urdf.".to_owned());
    lines.extend(refusal(analysis)?);
    let robot = RobotModel { tree: &tree, joints: exported.joints, tendons: exported.tendons, header: lines };
    write_mjcf(&robot).map_err(Error::IdentifiedMjcf)
}

/// What of the model MJCF lacks, in words.
pub fn not_expressed(analysis: &Analysis<'_>) -> Vec<String> {
    Exported::of(analysis).left_out
}

/// Why MuJoCo will not read the file, if it will not.
///
/// # Errors
/// The model is of another robot.
pub fn refusal(analysis: &Analysis<'_>) -> Result<Option<String>, Error> {
    let links = impossible_bodies(&analysis.model.consistent_tree(&analysis.session.tree)?);
    Ok((!links.is_empty()).then(|| {
        format!(
            "MuJoCo will refuse {FILE}: no real body has the inertial parameters of {} (its pseudo-inertia is not positive definite).",
            links.join(", ")
        )
    }))
}
