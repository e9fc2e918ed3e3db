//! Each joint as a servo of BAM (Better Actuator Models, Duclusaud & Passault 2024).
//!
//! BAM's model m1 has Coulomb and viscous friction, m2 Stribeck's besides, m3 friction of the load, m4 both;
//! m5 and m6 tell the directions of power apart, for which a log of torques has no counterpart here.

use crate::Error;
use crate::exported::{Carried, Exported, LeftOut};
use phiw_effects::ServoFriction;
use serde_json::{Map, Value, json};

/// Name of the file.
pub const FILE: &str = "bam.json";

/// One object for each joint, by its name, with BAM's names of the values. BAM needs the servo's own name as
/// `actuator`, and its `kt` and `R`, which torques do not tell: they are null.
///
/// # Errors
/// None is known: numbers of a model are finite.
pub fn servo_file(carried: Carried<'_>) -> Result<String, Error> {
    let exported = Exported::of(carried);
    let mut joints = Map::new();
    for (index, joint) in exported.joints.iter().enumerate() {
        let name = &carried.tree.joint(index).joint;
        let mut values = json!({
            "actuator": null,
            "kt": null,
            "R": null,
            "armature": joint.armature,
            "friction_base": joint.friction,
            "friction_viscous": joint.damping,
            "command_delay": joint.motor_delay,
        });
        let (mut stribeck, mut load) = (None, 0.0);
        for friction in frictions(carried, name) {
            match friction {
                ServoFriction::Stribeck { .. } if stribeck.is_none() => stribeck = Some(friction),
                ServoFriction::Stribeck { .. } => {}
                ServoFriction::Load { share } => load += share,
            }
        }
        values["model"] = match (stribeck.is_some(), load > 0.0) {
            (false, false) => "m1",
            (true, false) => "m2",
            (false, true) => "m3",
            (true, true) => "m4",
        }
        .into();
        if let Some(ServoFriction::Stribeck { torque, speed, exponent }) = stribeck {
            values["friction_stribeck"] = torque.into();
            values["dtheta_stribeck"] = speed.into();
            values["alpha"] = exponent.into();
        }
        if load > 0.0 {
            // BAM's load is the difference of the torques on both sides of the gear, which at a steady speed
            // is twice the torque that goes through it.
            values["load_friction_base"] = (0.5 * load).into();
            if stribeck.is_some() {
                values["load_friction_stribeck"] = 0.0.into();
            }
        }
        joints.insert(name.clone(), values);
    }
    let file = json!({
        "joints": Value::Object(joints),
        "not_expressed": not_expressed(carried),
    });
    serde_json::to_string_pretty(&file)
        .map(|text| text + "\n")
        .map_err(|source| Error::Json { file: FILE, source })
}

fn frictions(carried: Carried<'_>, joint: &str) -> Vec<ServoFriction> {
    let own = carried.effects().filter(|(effect, ..)| effect.spec.joints == [joint]);
    own.flat_map(|(effect, parameters, values)| {
        carried.catalogue.servo_friction(&effect.spec, &parameters, &values)
    })
    .collect()
}

/// What of the model BAM has no field for, in words, and what it asks for that a log of torques does not
/// tell.
pub fn not_expressed(carried: Carried<'_>) -> Vec<String> {
    let exported = Exported::of(carried);
    let mut left_out = LeftOut::default();
    for (effect, parameters, values) in carried.effects() {
        let joints = &effect.spec.joints;
        let mechanisms = carried.catalogue.mechanisms(&effect.spec, &parameters, &values);
        let is_servo = carried.catalogue.servo_friction(&effect.spec, &parameters, &values).is_some();
        if mechanisms.parts.is_empty() && mechanisms.left_out.is_empty() && !is_servo {
            left_out.add(effect.spec.kind.clone(), joints);
        }
        mechanisms
            .left_out
            .iter()
            .for_each(|name| left_out.add(format!("{} ({name})", effect.spec.kind), joints));
    }
    let mut words = [left_out.in_words(), exported.beyond_a_drive(carried)].concat();
    words.push("actuator, kt and R of every servo, which torques do not tell (null in the file)".to_owned());
    words
}
