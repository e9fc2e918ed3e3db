//! Writing identified parameters into the URDF that the robot was read from.

use super::UrdfError;
use super::source::{child, children, name, parse};
use super::splice::Splices;
use crate::inertia::Inertia;
use crate::{Body, JointType, Tree, Vec3};
use roxmltree::Node;
use std::collections::HashMap;

/// A mass below this \[kg\] is none.
const NO_MASS: f64 = 1e-12;

/// Friction of one joint, as URDF's `<dynamics>` declares it.
#[derive(Clone, Debug, PartialEq)]
pub struct JointFriction {
    /// The joint's name.
    pub joint: String,
    /// Viscous friction \[N·m·s/rad, N·s/m\].
    pub damping: f64,
    /// Coulomb friction \[N·m, N\].
    pub friction: f64,
}

/// The URDF with the tree's parameters in the place of its own, and with the frictions given.
///
/// The parameters of a body go to the link that its joint carries. Links merged into it, behind fixed or held
/// joints, lose their `<inertial>`, as they are counted there. Everything else (comments, meshes, white
/// space) stays as it is. Read again with the same options, the result gives the same tree.
///
/// # Errors
/// The text is not the URDF that the tree was read from, a number is not finite, or a body has a first moment
/// but no mass: URDF has a centre of mass instead, and cannot express that.
pub fn write_identified_urdf(
    original_xml: &str,
    tree: &Tree,
    declared: &[JointFriction],
) -> Result<String, UrdfError> {
    let document = parse(original_xml)?;
    let robot = document.root_element();
    let links: HashMap<String, Node> = children(robot, "link").map(|link| (name(link), link)).collect();
    let joints: HashMap<String, Node> = children(robot, "joint").map(|joint| (name(joint), joint)).collect();
    let mut splices = Splices::new(document.input_text());
    for body in tree.bodies() {
        if body.joint_type != JointType::Floating {
            find(&joints, "joint", &body.joint)?;
        }
        let link = find(&links, "link", &body.link)?;
        match (child(link, "inertial"), inertial_elements(body)?) {
            (Some(inertial), elements) => splices.replace_element(inertial, "inertial", &elements),
            (None, _) if body.inertial.iter().all(|&x| x == 0.0) => {}
            (None, elements) => splices.append_element(link, "inertial", &elements),
        }
    }
    for link in merged_links(robot, tree) {
        if let Some(inertial) = links.get(&link).and_then(|&link| child(link, "inertial")) {
            splices.remove(inertial);
        }
    }
    for friction in declared {
        write_friction(find(&joints, "joint", &friction.joint)?, friction, &mut splices)?;
    }
    Ok(splices.finish())
}

fn find<'a, 'input>(
    nodes: &HashMap<String, Node<'a, 'input>>,
    kind: &'static str,
    name: &str,
) -> Result<Node<'a, 'input>, UrdfError> {
    nodes.get(name).copied().ok_or_else(|| UrdfError::OtherRobot { kind, name: name.to_owned() })
}

/// Links that are part of a body without being the one that its joint carries.
fn merged_links(robot: Node, tree: &Tree) -> Vec<String> {
    let moving = |joint: &str| tree.bodies().iter().any(|body| body.joint == joint);
    let mut fixed_children: HashMap<String, Vec<String>> = HashMap::new();
    for joint in children(robot, "joint").filter(|&joint| !moving(&name(joint))) {
        let end =
            |tag| child(joint, tag).and_then(|end| end.attribute("link")).unwrap_or_default().to_owned();
        fixed_children.entry(end("parent")).or_default().push(end("child"));
    }
    let mut pending: Vec<String> = tree.bodies().iter().map(|body| body.link.clone()).collect();
    let mut merged = Vec::new();
    while let Some(link) = pending.pop() {
        // Removed, so that a circle in the file ends.
        if let Some(children) = fixed_children.remove(&link) {
            merged.extend_from_slice(&children);
            pending.extend(children);
        }
    }
    merged
}

/// The children of the body's `<inertial>`.
fn inertial_elements(body: &Body) -> Result<[String; 3], UrdfError> {
    let not_finite =
        |field| UrdfError::NotFinite { line: None, kind: "link", name: body.link.clone(), field };
    if !body.inertial.iter().all(|x| x.is_finite()) {
        return Err(not_finite("one of its inertial parameters"));
    }
    let inertia = Inertia::<f64>::from_parameters(&body.inertial);
    let has_mass = inertia.mass.abs() > NO_MASS;
    if !has_mass && inertia.moment.0.iter().any(|x| x.abs() > NO_MASS) {
        return Err(UrdfError::MomentWithoutMass { link: body.link.clone() });
    }
    let center = if has_mass { inertia.moment.scale(1.0 / inertia.mass) } else { Vec3::zero() };
    let [x, y, z] = center.0;
    let i = inertia.tensor_about_center_of_mass(center).0;
    Ok([
        format!("<origin xyz=\"{x} {y} {z}\" rpy=\"0 0 0\"/>"),
        format!("<mass value=\"{}\"/>", inertia.mass),
        format!(
            "<inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>",
            i[0][0], i[0][1], i[0][2], i[1][1], i[1][2], i[2][2]
        ),
    ])
}

fn write_friction(joint: Node, friction: &JointFriction, splices: &mut Splices) -> Result<(), UrdfError> {
    let JointFriction { damping, friction: coulomb, joint: joint_name } = friction;
    if !(damping.is_finite() && coulomb.is_finite()) {
        return Err(UrdfError::NotFinite {
            line: None,
            kind: "joint",
            name: joint_name.clone(),
            field: "its friction",
        });
    }
    let values = [("damping", damping), ("friction", coulomb)];
    match child(joint, "dynamics") {
        Some(dynamics) => values.into_iter().for_each(|(key, value)| {
            splices.set_attribute(dynamics, key, &value.to_string());
        }),
        None => {
            splices.append_child(joint, &format!("<dynamics damping=\"{damping}\" friction=\"{coulomb}\"/>"))
        }
    }
    Ok(())
}
