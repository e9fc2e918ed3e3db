//! A robot as the text of a URDF.

use super::MjcfReading;
use super::orientation::roll_pitch_yaw;
use super::robot::{Motion, Robot};
use crate::write::{Escaped, Numbers};
use phiw_dynamics::Placement;
use std::fmt::Write;

/// The robot and what a URDF cannot say of it.
pub(super) fn reading(robot: Robot) -> MjcfReading {
    let mut text = format!("<robot name=\"{}\">\n", Escaped(&robot.name));
    for link in &robot.links {
        // Writing to a string does not fail.
        let _ = write!(text, "  <link name=\"{}\">", Escaped(&link.name));
        let inertia = &link.inertia;
        let i = inertia.tensor.0;
        if inertia.mass != 0.0 || i.iter().flatten().any(|moment| *moment != 0.0) {
            let _ = write!(
                text,
                "<inertial><origin xyz=\"{}\"/><mass value=\"{}\"/><inertia ixx=\"{}\" ixy=\"{}\" \
                 ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial>",
                Numbers(&inertia.center.0),
                inertia.mass,
                i[0][0],
                i[0][1],
                i[0][2],
                i[1][1],
                i[1][2],
                i[2][2]
            );
        }
        for (placement, shape) in &link.shapes {
            let Placement { rotation, translation } = *placement;
            let _ = write!(
                text,
                "<visual><origin xyz=\"{}\" rpy=\"{}\"/><geometry>{shape}</geometry></visual>",
                Numbers(&translation.0),
                Numbers(&roll_pitch_yaw(rotation))
            );
        }
        text.push_str("</link>\n");
    }
    for joint in &robot.joints {
        let kind = match (joint.motion, joint.range) {
            (Motion::Fixed, _) => "fixed",
            (Motion::Free, _) => "floating",
            (Motion::Slide, _) => "prismatic",
            (Motion::Hinge, Some(_)) => "revolute",
            (Motion::Hinge, None) => "continuous",
        };
        let [parent, child] = joint.links.map(|link| &robot.links[link].name);
        let Placement { rotation, translation } = joint.origin;
        let _ = write!(
            text,
            "  <joint name=\"{}\" type=\"{kind}\"><parent link=\"{}\"/><child link=\"{}\"/><origin xyz=\"{}\" rpy=\"{}\"/>",
            Escaped(&joint.name),
            Escaped(parent),
            Escaped(child),
            Numbers(&translation.0),
            Numbers(&roll_pitch_yaw(rotation))
        );
        if matches!(joint.motion, Motion::Hinge | Motion::Slide) {
            let _ = write!(text, "<axis xyz=\"{}\"/>", Numbers(&joint.axis.0));
            if joint.range.is_some() || joint.effort.is_some() {
                text.push_str("<limit");
                if let Some([lower, upper]) = joint.range {
                    let _ = write!(text, " lower=\"{lower}\" upper=\"{upper}\"");
                }
                if let Some(effort) = joint.effort {
                    let _ = write!(text, " effort=\"{effort}\"");
                }
                text.push_str("/>");
            }
            if joint.damping != 0.0 || joint.friction != 0.0 {
                let (damping, friction) = (joint.damping, joint.friction);
                let _ = write!(text, "<dynamics damping=\"{damping}\" friction=\"{friction}\"/>");
            }
            if let Some((leader, ratio, offset)) = &joint.follows {
                let leader = Escaped(leader);
                let _ =
                    write!(text, "<mimic joint=\"{leader}\" multiplier=\"{ratio}\" offset=\"{offset}\"/>");
            }
        }
        text.push_str("</joint>\n");
    }
    text.push_str("</robot>\n");
    let moves = |motion| matches!(motion, Motion::Hinge | Motion::Slide);
    let armature: Vec<(String, f64)> = robot
        .joints
        .iter()
        .filter(|joint| moves(joint.motion) && joint.armature != 0.0)
        .map(|joint| (joint.name.clone(), joint.armature))
        .collect();
    let mut left_out = robot.left_out;
    if !armature.is_empty() {
        let joints: Vec<&str> = armature.iter().map(|(joint, _)| joint.as_str()).collect();
        left_out.push(format!("armature of {} (declare rotor_inertia)", joints.join(", ")));
    }
    MjcfReading { urdf: text, armature, left_out }
}
