//! What stands beside the bodies: motors, tendons, equalities, gravity.

use super::MjcfReadError;
use super::element::{Element, line};
use super::robot::Robot;
use roxmltree::Node;
use std::collections::BTreeMap;

/// The largest torque of a joint is its own, else its motors'.
pub(super) fn efforts(root: Node<'_, '_>, robot: &mut Robot) -> Result<(), MjcfReadError> {
    let mut by_joint: BTreeMap<String, f64> = BTreeMap::new();
    for section in root.children().filter(|node| node.has_tag_name("actuator")) {
        for motor in section.children().filter(Node::is_element) {
            let element = Element::new(motor, None);
            let force =
                element.numbers::<2>("forcerange")?.filter(|_| element.text("forcelimited") != Some("false"));
            let gear = element.number("gear")?.unwrap_or(1.0);
            if let (Some(joint), Some([lower, upper])) = (motor.attribute("joint"), force) {
                *by_joint.entry(joint.to_owned()).or_default() += (lower.abs().max(upper.abs()) * gear).abs();
            }
        }
    }
    for joint in &mut robot.joints {
        let motors = by_joint.get(&joint.name).copied().filter(|force| *force > 0.0);
        joint.effort = joint.effort.or(motors);
    }
    Ok(())
}

/// Makes joints follow others, and names what else joins bodies.
pub(super) fn equalities(root: Node<'_, '_>, robot: &mut Robot) -> Result<(), MjcfReadError> {
    for section in root.children() {
        if section.has_tag_name("tendon") {
            let tendons = section.children().filter(Node::is_element);
            robot.left_out.extend(tendons.map(|tendon| {
                format!(
                    "{} tendon {}",
                    tendon.tag_name().name(),
                    tendon.attribute("name").unwrap_or_default()
                )
            }));
        }
        if !section.has_tag_name("equality") {
            continue;
        }
        for equality in section.children().filter(Node::is_element) {
            if equality.attribute("active") == Some("false") || follow(equality, robot)? {
                continue;
            }
            let tag = equality.tag_name().name();
            let name = equality.attribute("name").unwrap_or_default();
            robot.left_out.push(format!("{tag} equality {name}").trim_end().to_owned());
        }
    }
    Ok(())
}

/// Makes a joint follow another; whether the equality says so.
fn follow(node: Node<'_, '_>, robot: &mut Robot) -> Result<bool, MjcfReadError> {
    let both = [node.attribute("joint1"), node.attribute("joint2")];
    let ([Some(first), Some(second)], true) = (both, node.has_tag_name("joint")) else {
        return Ok(false);
    };
    let place = |name: &str| {
        let place = robot.joints.iter().position(|joint| joint.name == name);
        let what = format!("no joint is called `{name}`");
        place.ok_or_else(|| MjcfReadError::Name { line: line(node), what })
    };
    let (first, second) = (place(first)?, place(second)?);
    let polynomial = Element::new(node, None).list("polycoef")?.unwrap_or_else(|| vec![0.0, 1.0]);
    let coefficient = |order: usize| polynomial.get(order).copied().unwrap_or_default();
    if polynomial.iter().skip(2).any(|higher| *higher != 0.0) || robot.joints[second].follows.is_some() {
        return Ok(false);
    }
    // Both are told from the file's pose.
    let (own, leader) = (robot.joints[first].reference, &robot.joints[second]);
    let offset = own + coefficient(0) - coefficient(1) * leader.reference;
    robot.joints[first].follows = Some((leader.name.clone(), coefficient(1), offset));
    Ok(true)
}

/// Names gravity that is not the usual.
pub(super) fn gravity(root: Node<'_, '_>, robot: &mut Robot) -> Result<(), MjcfReadError> {
    for option in root.children().filter(|node| node.has_tag_name("option")) {
        let gravity = Element::new(option, None).numbers::<3>("gravity")?;
        if let Some([x, y, z]) = gravity.filter(|gravity| *gravity != [0.0, 0.0, -9.81]) {
            robot.left_out.push(format!("gravity {x} {y} {z}, taken as 0 0 -9.81"));
        }
    }
    Ok(())
}
