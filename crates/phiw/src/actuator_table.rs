//! What each joint's drive has, as a table: what libraries for training controllers set joint by joint.

use crate::Error;
use crate::exported::{Carried, Exported};
use std::fmt::Write;

/// Name of the file.
pub const FILE: &str = "actuators.csv";

/// One line for each joint: armature, damping, friction loss, spring, and the URDF's limits. An empty cell is
/// a limit that the URDF does not give.
///
/// # Errors
/// None is known: writing to a string does not fail.
pub fn actuator_table(carried: Carried<'_>) -> Result<String, Error> {
    let mut text =
        String::from("joint,armature,damping,frictionloss,stiffness,springref,effort_limit,velocity_limit\n");
    let exported = Exported::of(carried);
    for (index, joint) in exported.joints.iter().enumerate() {
        let body = carried.tree.joint(index);
        let limit =
            |value: f64| if value.is_finite() && value > 0.0 { value.to_string() } else { String::new() };
        let name = if body.joint.contains([',', '"', '\n', '\r']) {
            format!("\"{}\"", body.joint.replace('"', "\"\""))
        } else {
            body.joint.clone()
        };
        let _ = writeln!(
            text,
            "{name},{},{},{},{},{},{},{}",
            joint.armature,
            joint.damping,
            joint.friction,
            joint.stiffness,
            joint.spring_reference,
            limit(body.limits.effort),
            limit(body.limits.velocity)
        );
    }
    Ok(text)
}
