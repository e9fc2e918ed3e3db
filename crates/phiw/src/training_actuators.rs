//! Actuators for libraries in which controllers are trained: mjlab and Isaac Lab.
//!
//! Both make an actuator of a configuration whose gains are the trainer's own; what a joint has is the same
//! for every kind of it. So the files hold a table of the joints' values by the libraries' names, and one
//! function that makes configurations of whatever class is wanted.

use crate::exported::{Carried, Exported, header};
use phiw_mjcf::JointModel;
use std::fmt::Write;

/// Name of the file for mjlab, after `mjlab.actuator.ActuatorCfg`.
pub const MJLAB_FILE: &str = "mjlab_actuators.py";
/// Name of the file for Isaac Lab, after `isaaclab.actuators.ActuatorBaseCfg`.
pub const ISAAC_LAB_FILE: &str = "isaaclab_actuators.py";

/// A library's name for a value of a joint; an absent value is left to the library.
type Field = (&'static str, fn(&JointModel, Limits) -> Option<f64>);

/// Effort \[N·m, N\] and velocity \[rad/s, m/s\] that the URDF allows, where it says.
#[derive(Clone, Copy)]
struct Limits {
    effort: Option<f64>,
    velocity: Option<f64>,
}

const MJLAB_FIELDS: [Field; 5] = [
    ("armature", |joint, _| Some(joint.armature)),
    ("frictionloss", |joint, _| Some(joint.friction)),
    ("viscous_damping", |joint, _| Some(joint.damping)),
    ("effort_limit", |_, limits| limits.effort),
    ("velocity_limit", |_, limits| limits.velocity),
];

/// Limits are the solver's, whose names 2.x and 3.0 both take.
const ISAAC_LAB_FIELDS: [Field; 6] = [
    ("armature", |joint, _| Some(joint.armature)),
    ("friction", |joint, _| Some(joint.friction)),
    ("dynamic_friction", |joint, _| Some(joint.friction)),
    ("viscous_friction", |joint, _| Some(joint.damping)),
    ("effort_limit_sim", |_, limits| limits.effort),
    ("velocity_limit_sim", |_, limits| limits.velocity),
];

const MJLAB_FUNCTION: &str = r#"

def configurations(kind, timestep, **gains):
    """A configuration of `kind` (such as BuiltinPositionActuatorCfg) for each joint, with the trainer's own `gains`.

    `timestep` is that of the physics (s), in whole numbers of which mjlab delays commands.
    """
    def lag(joint):
        steps = round(DELAY.get(joint, 0.0) / timestep)
        return {"delay_min_lag": steps, "delay_max_lag": steps} if steps else {}

    return tuple(
        kind(target_names_expr=(re.escape(joint),), **values, **lag(joint), **gains) for joint, values in JOINTS.items()
    )
"#;

const ISAAC_LAB_FUNCTION: &str = r#"

def configurations(kind, physics_dt, **gains):
    """A configuration of `kind` for each joint by its name, with the trainer's own `gains`.

    A `kind` that has `max_delay` (DelayedPDActuatorCfg) is given the delay of commands, in whole steps of `physics_dt`
    (s); others (ImplicitActuatorCfg) know none.
    """
    def lag(joint):
        steps = round(DELAY.get(joint, 0.0) / physics_dt)
        return {"min_delay": steps, "max_delay": steps} if steps and hasattr(kind, "max_delay") else {}

    return {
        joint: kind(joint_names_expr=[re.escape(joint)], **values, **lag(joint), **gains)
        for joint, values in JOINTS.items()
    }
"#;

/// The joints as Python for mjlab.
pub fn mjlab(carried: Carried<'_>) -> String {
    text(carried, MJLAB_FILE, &MJLAB_FIELDS, MJLAB_FUNCTION)
}

/// The joints as Python for Isaac Lab.
pub fn isaac_lab(carried: Carried<'_>) -> String {
    text(carried, ISAAC_LAB_FILE, &ISAAC_LAB_FIELDS, ISAAC_LAB_FUNCTION)
}

fn text(carried: Carried<'_>, file: &str, fields: &[Field], function: &str) -> String {
    let exported = Exported::of(carried);
    let mut text = String::new();
    // Writing to a string does not fail.
    for line in header(carried, file, &not_expressed(carried)) {
        let _ = writeln!(text, "# {}", line.replace(['\n', '\r'], " "));
    }
    text.push_str("\nimport re\n\n# SI units, at the joint.\nJOINTS = {\n");
    for (index, joint) in exported.joints.iter().enumerate() {
        let body = carried.tree.joint(index);
        let positive = |value: f64| Some(value).filter(|value| value.is_finite() && *value > 0.0);
        let limits =
            Limits { effort: positive(body.limits.effort), velocity: positive(body.limits.velocity) };
        let values = fields.iter().filter_map(|(name, value)| Some((name, value(joint, limits)?)));
        let values: Vec<String> = values.map(|(name, value)| format!("\"{name}\": {value:?}")).collect();
        let _ = writeln!(text, "    {}: {{{}}},", quoted(&body.joint), values.join(", "));
    }
    text.push_str("}\n# From a command to its torque (s).\nDELAY = {\n");
    for (index, joint) in exported.joints.iter().enumerate().filter(|(_, joint)| joint.motor_delay > 0.0) {
        let name = quoted(&carried.tree.joint(index).joint);
        let _ = writeln!(text, "    {name}: {:?},", joint.motor_delay);
    }
    text.push_str("}\n");
    text + function
}

/// A string of Python's: that of JSON is one.
fn quoted(name: &str) -> String {
    serde_json::Value::from(name).to_string()
}

/// What of the model neither has a field for, in words.
pub fn not_expressed(carried: Carried<'_>) -> Vec<String> {
    let exported = Exported::of(carried);
    let beyond = exported.beyond_a_drive(carried);
    [exported.left_out, beyond].concat()
}
