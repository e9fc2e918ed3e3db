//! The identified robot as MJCF.

use crate::Error;
use crate::exported::{Carried, Exported, header};
use phiw_mjcf::{RobotModel, impossible_bodies, write_mjcf};

/// Name of the file.
pub const FILE: &str = "identified.xml";

/// The robot with the identified inertial parameters, and what of the effects MuJoCo has: armature, damping,
/// friction loss, springs, motors and their delay, fixed tendons for couplings.
///
/// # Errors
/// A parameter is not finite.
pub fn identified_mjcf(carried: Carried<'_>) -> Result<String, Error> {
    let tree = carried.model.consistent_tree(carried.tree)?;
    let exported = Exported::of(carried);
    let mut lines = header(carried, FILE, &exported.left_out);
    lines.push("At rest friction loss is a soft constraint, as wide as the model's friction turns (0.001 rad/s at least)".to_owned());
    lines.push("with the time step of this file; geometry is in identified.urdf.".to_owned());
    if exported.joints.iter().any(|joint| joint.motor_delay > 0.0) {
        lines.push(
            "Its motors are late: a MuJoCo that knows no delay of an actuator refuses the file.".to_owned(),
        );
    }
    lines.extend(refusal(carried)?);
    let robot = RobotModel { tree: &tree, joints: exported.joints, tendons: exported.tendons, header: lines };
    write_mjcf(&robot).map_err(Error::IdentifiedMjcf)
}

/// What of the model MJCF lacks, in words.
pub fn not_expressed(carried: Carried<'_>) -> Vec<String> {
    Exported::of(carried).left_out
}

/// Why MuJoCo will not read the file, if it will not.
///
/// # Errors
/// The model is of another robot.
pub fn refusal(carried: Carried<'_>) -> Result<Option<String>, Error> {
    let links = impossible_bodies(&carried.model.consistent_tree(carried.tree)?);
    Ok((!links.is_empty()).then(|| {
        format!(
            "MuJoCo will refuse {FILE}: no real body has the inertial parameters of {} (its pseudo-inertia is not positive definite).",
            links.join(", ")
        )
    }))
}
