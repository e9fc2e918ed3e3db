//! The URDF's text: what it declares and what it leaves out, which `urdf-rs` either fails on or fills in silently.

use super::splice::Splices;
use super::{Finding, UrdfError};
use roxmltree::{Document, Node};
use std::collections::{HashMap, HashSet};

const TENSOR: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
const LIMITS: [&str; 4] = ["lower", "upper", "velocity", "effort"];

/// What a URDF's text declares.
pub(super) struct Declared {
    /// Links with an `<inertial>`.
    pub(super) inertials: HashSet<String>,
    /// For each joint with a `<limit>`, those of [`LIMITS`] that it gives.
    pub(super) limits: HashMap<String, Vec<&'static str>>,
    /// Incomplete `<inertial>`s.
    pub(super) findings: Vec<Finding>,
}

const TYPES: [&str; 7] = ["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

/// Elements that tell nothing of the dynamics.
const UNNEEDED: [&str; 6] = ["visual", "collision", "material", "gazebo", "transmission", "sensor"];

/// Attributes that hold numbers: element, attribute, how many.
const NUMBERS: [(&str, &[&str], usize); 7] = [
    ("origin", &["xyz", "rpy"], 3),
    ("axis", &["xyz"], 3),
    ("mass", &["value"], 1),
    ("inertia", &TENSOR, 1),
    ("limit", &LIMITS, 1),
    ("dynamics", &["damping", "friction"], 1),
    ("mimic", &["multiplier", "offset"], 1),
];

/// Parses the text as a `<robot>`.
pub(super) fn parse(xml: &str) -> Result<Document<'_>, UrdfError> {
    let options = roxmltree::ParsingOptions { allow_dtd: true, ..Default::default() };
    let document = Document::parse_with_options(xml.trim_start_matches('\u{feff}'), options)?;
    let root = document.root_element();
    if root.tag_name().name() != "robot" {
        return Err(UrdfError::NotRobot { root: root.tag_name().name().to_owned() });
    }
    let is_xacro = |node: Node| node.tag_name().namespace().is_some_and(|uri| uri.ends_with("/xacro"));
    if root.descendants().any(is_xacro) {
        return Err(UrdfError::Xacro);
    }
    Ok(document)
}

/// Reads the text with `urdf-rs`, after putting in the parts that it insists on and that real files leave out.
pub(super) fn read(xml: &str) -> Result<(urdf_rs::Robot, Declared), UrdfError> {
    let document = parse(xml)?;
    let mut declared = Declared { inertials: HashSet::new(), limits: HashMap::new(), findings: Vec::new() };
    let mut splices = Splices::new(document.input_text());
    // What no fit needs is not parsed: a mesh that is missing a part does not stop an identification.
    unneeded(document.root_element()).for_each(|part| splices.remove(part));
    for link in children(document.root_element(), "link") {
        unneeded(link).for_each(|part| splices.remove(part));
        check_parts(link, &[("a name", link.has_attribute("name"))])?;
        check_numbers(link)?;
        if let Some(inertial) = child(link, "inertial") {
            let name = name(link);
            let missing = complete_inertial(inertial, &mut splices);
            if !missing.is_empty() {
                declared.findings.push(Finding::IncompleteInertial { link: name.clone(), missing });
            }
            declared.inertials.insert(name);
        }
    }
    for joint in children(document.root_element(), "joint") {
        check_joint(joint)?;
        check_numbers(joint)?;
        if let Some(limit) = child(joint, "limit") {
            let given: Vec<_> = LIMITS.into_iter().filter(|&key| limit.has_attribute(key)).collect();
            if !given.contains(&"velocity") {
                splices.set_attribute(limit, "velocity", "0");
            }
            declared.limits.insert(name(joint), given);
        }
    }
    Ok((urdf_rs::read_from_string(&splices.finish())?, declared))
}

fn check_joint(joint: Node) -> Result<(), UrdfError> {
    let names_link = |tag| child(joint, tag).is_some_and(|end| end.has_attribute("link"));
    check_parts(
        joint,
        &[
            ("a name", joint.has_attribute("name")),
            ("a type", joint.has_attribute("type")),
            ("a <parent link=…>", names_link("parent")),
            ("a <child link=…>", names_link("child")),
        ],
    )?;
    match joint.attribute("type") {
        Some(kind) if !TYPES.contains(&kind) => {
            Err(UrdfError::UnsupportedJoint { joint: name(joint), kind: kind.to_owned() })
        }
        _ => Ok(()),
    }
}

fn check_parts(element: Node, parts: &[(&'static str, bool)]) -> Result<(), UrdfError> {
    match parts.iter().find(|(_, present)| !present) {
        Some(&(lacks, _)) => {
            Err(UrdfError::Incomplete { line: line(element), element: title(element), lacks })
        }
        None => Ok(()),
    }
}

/// `urdf-rs` says of a bad number neither whose it is nor where, and skips words among the numbers of a vector.
fn check_numbers(element: Node) -> Result<(), UrdfError> {
    let needed = element.children().filter(|node| !UNNEEDED.contains(&node.tag_name().name()));
    for node in needed.flat_map(|child| child.descendants()) {
        let tables = NUMBERS.iter().filter(|(tag, ..)| *tag == node.tag_name().name());
        for (_, attributes, count) in tables {
            for attribute in *attributes {
                let Some(value) = node.attribute(*attribute) else { continue };
                let numbers: Vec<_> = value.split_whitespace().map(str::parse::<f64>).collect();
                if numbers.len() != *count || numbers.iter().any(Result::is_err) {
                    return Err(UrdfError::NotANumber {
                        line: line(node),
                        element: title(element),
                        attribute,
                        value: value.to_owned(),
                        expected: if *count == 1 { "a number" } else { "three numbers" },
                    });
                }
            }
        }
    }
    Ok(())
}

fn line(element: Node) -> u32 {
    element.document().text_pos_at(element.range().start).row
}

/// The element's tag and name, for messages.
fn title(element: Node) -> String {
    format!("{} `{}`", element.tag_name().name(), name(element))
}

/// Adds what an `<inertial>` lacks, as zeros; returns what that was.
fn complete_inertial(inertial: Node, splices: &mut Splices) -> Vec<&'static str> {
    let mut missing = Vec::new();
    let mut children = String::new();
    match child(inertial, "mass") {
        Some(mass) if mass.has_attribute("value") => {}
        Some(mass) => {
            missing.push("mass");
            splices.set_attribute(mass, "value", "0");
        }
        None => {
            missing.push("mass");
            children.push_str("<mass value=\"0\"/>");
        }
    }
    match child(inertial, "inertia") {
        Some(tensor) => {
            let absent: Vec<_> = TENSOR.into_iter().filter(|&key| !tensor.has_attribute(key)).collect();
            absent.iter().for_each(|key| splices.set_attribute(tensor, key, "0"));
            missing.extend(absent);
        }
        None => {
            missing.push("inertia");
            children.push_str(&format!("<inertia {}/>", zeros(&TENSOR)));
        }
    }
    if !children.is_empty() {
        splices.append_child(inertial, &children);
    }
    missing
}

fn zeros(attributes: &[&str]) -> String {
    attributes.iter().map(|key| format!("{key}=\"0\"")).collect::<Vec<_>>().join(" ")
}

/// The element's children that tell nothing of its dynamics.
fn unneeded<'a, 'input>(element: Node<'a, 'input>) -> impl Iterator<Item = Node<'a, 'input>> {
    element.children().filter(|node| UNNEEDED.contains(&node.tag_name().name()))
}

/// The element's children of that tag.
pub(super) fn children<'a, 'input>(
    element: Node<'a, 'input>,
    tag: &str,
) -> impl Iterator<Item = Node<'a, 'input>> {
    element.children().filter(move |node| node.tag_name().name() == tag)
}

/// The element's first child of that tag.
pub(super) fn child<'a, 'input>(element: Node<'a, 'input>, tag: &str) -> Option<Node<'a, 'input>> {
    children(element, tag).next()
}

/// The element's `name`.
pub(super) fn name(element: Node) -> String {
    element.attribute("name").unwrap_or_default().to_owned()
}
