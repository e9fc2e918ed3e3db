//! What each joint's drive has, as a table: what libraries for training controllers set joint by joint.

use crate::Error;
use crate::exported::{Carried, Exported, LeftOut};
use std::fmt::Write;

/// Name of the file.
pub const FILE: &str = "actuators.csv";

/// One line for each joint: armature, damping, friction loss, spring, motor, and the URDF's limits. An empty
/// cell is a limit that the URDF does not give.
///
/// # Errors
/// None is known: writing to a string does not fail.
pub fn actuator_table(carried: Carried<'_>) -> Result<String, Error> {
    let mut text = String::from(
        "joint,armature,damping,frictionloss,stiffness,springref,motor_gain,motor_bias,motor_delay,effort_limit,velocity_limit\n",
    );
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
            "{name},{},{},{},{},{},{},{},{},{},{}",
            joint.armature,
            joint.damping,
            joint.friction,
            joint.stiffness,
            joint.spring_reference,
            joint.motor_gain,
            joint.motor_bias,
            joint.motor_delay,
            limit(body.limits.effort),
            limit(body.limits.velocity)
        );
    }
    Ok(text)
}

/// What of the model the table lacks, in words: what MJCF lacks, and what joints share.
pub fn not_expressed(carried: Carried<'_>) -> Vec<String> {
    let exported = Exported::of(carried);
    let mut shared = LeftOut::default();
    for tendon in &exported.tendons {
        let names = tendon.joints.map(|(joint, _)| carried.tree.joint(joint).joint.clone());
        shared.add("shared transmission".to_owned(), &names);
    }
    [exported.left_out, shared.in_words()].concat()
}
