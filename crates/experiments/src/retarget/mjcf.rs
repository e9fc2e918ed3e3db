//! The human model as an MJCF file, for MuJoCo and what is built on it.

use phiw_bspline_retarget::human::{HumanBody, HumanJoint};
use std::fmt::Write;

/// Every joint and length of the body as a body of its own, `joint_<index>`, and the markers as sites,
/// `marker_<index>`.
pub fn human(body: &HumanBody, parameters: &[f64]) -> String {
    let joints = body.joints(parameters);
    let mut children: Vec<Vec<usize>> = vec![Vec::new(); joints.len()];
    let mut roots = Vec::new();
    for (index, joint) in joints.iter().enumerate() {
        match joint.parent {
            Some(parent) => children[parent].push(index),
            None => roots.push(index),
        }
    }
    let mut sites: Vec<String> = vec![String::new(); joints.len()];
    for (index, marker) in body.markers().iter().enumerate() {
        // Writing to a string does not fail.
        let _ =
            write!(sites[marker.joint], "<site name=\"marker_{index}\" pos=\"{}\"/>", words(marker.local_m));
    }
    let mut text =
        String::from("<mujoco><compiler angle=\"radian\"/><option gravity=\"0 0 0\"/>\n<worldbody>\n");
    for root in roots {
        write_body(root, &joints, &children, &sites, &mut text);
    }
    text.push_str("</worldbody></mujoco>\n");
    text
}

fn write_body(
    index: usize,
    joints: &[HumanJoint],
    children: &[Vec<usize>],
    sites: &[String],
    text: &mut String,
) {
    let joint = &joints[index];
    let axis = words(joint.axis);
    let place = match (joint.coordinate, joint.turns) {
        (Some(_), _) => String::new(),
        (None, true) => format!(" axisangle=\"{axis} {}\"", joint.value),
        (None, false) => format!(" pos=\"{}\"", words(joint.axis.map(|along| along * joint.value))),
    };
    let _ = write!(text, "<body name=\"joint_{index}\"{place}>");
    if let Some(coordinate) = joint.coordinate {
        let kind = if joint.turns { "hinge" } else { "slide" };
        let _ = write!(text, "<joint name=\"coordinate_{coordinate}\" type=\"{kind}\" axis=\"{axis}\"/>");
    }
    // What moves has to have a mass; nothing here asks for it.
    let _ = writeln!(text, "<inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"1 1 1\"/>{}", sites[index]);
    for &child in &children[index] {
        write_body(child, joints, children, sites, text);
    }
    text.push_str("</body>\n");
}

fn words(vector: [f64; 3]) -> String {
    vector.map(|value| value.to_string()).join(" ")
}
