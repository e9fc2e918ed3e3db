//! From the document to the robot that it describes.
//!
//! Only what the dynamics need is read: a `<visual>` or a `<transmission>` may hold anything. What the format
//! lets a file leave out has the format's default.

use super::UrdfError;
use super::robot::{Inertial, Joint, JointKind, Limit, Link, Mimic, Pose, Robot, TENSOR};
use super::source::{child, children, children_with_lines, line, name};
use roxmltree::{Document, Node};

/// The axis of a joint that gives none.
const DEFAULT_AXIS: [f64; 3] = [1.0, 0.0, 0.0];

/// Above this sine of the pitch, roll and yaw turn about the same axis, and roll is taken as zero; as urdfdom
/// does.
const VERTICAL_PITCH: f64 = 0.99999;

/// Reads the robot's links and joints.
///
/// # Errors
/// A part is missing or is there twice, or an attribute is not a number.
pub(super) fn read(document: &Document) -> Result<Robot, UrdfError> {
    let root = document.root_element();
    let version = Version::of(root);
    let links = children_with_lines(root, "link").map(|(node, line)| link(Part::owner(node, version), line));
    let joints =
        children_with_lines(root, "joint").map(|(node, line)| joint(Part::owner(node, version), line));
    Ok(Robot {
        name: name(root),
        links: links.collect::<Result<_, _>>()?,
        joints: joints.collect::<Result<_, _>>()?,
    })
}

/// The `version` of a `<robot>`: major and minor.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Version(u32, u32);

impl Version {
    /// From here on an `<origin>` may have a `quat_xyzw`.
    const QUATERNIONS: Version = Version(1, 1);
    /// From here on a limit that is left out is none; before, it is zero.
    const OPEN_LIMITS: Version = Version(1, 2);

    /// 1.0 where it is left out or not a version, as in urdfdom.
    fn of(robot: Node) -> Self {
        let numbers = robot.attribute("version").and_then(|text| {
            let (major, minor) = text.trim().split_once('.')?;
            Some(Version(major.parse().ok()?, minor.parse().ok()?))
        });
        numbers.unwrap_or(Version(1, 0))
    }
}

/// A link or joint, or an element inside of it.
#[derive(Clone, Copy)]
struct Part<'a, 'input> {
    node: Node<'a, 'input>,
    /// The link or joint.
    owner: Node<'a, 'input>,
    version: Version,
}

impl<'a, 'input> Part<'a, 'input> {
    fn owner(node: Node<'a, 'input>, version: Version) -> Self {
        Part { node, owner: node, version }
    }

    /// The child of that tag, which may be there once.
    fn child(self, tag: &'static str) -> Result<Option<Self>, UrdfError> {
        match children(self.node, tag).nth(1) {
            Some(second) => Err(UrdfError::Repeated { line: line(second), element: title(self.owner), tag }),
            None => Ok(child(self.node, tag).map(|node| Part { node, ..self })),
        }
    }

    /// An attribute of text; `lacks` says what is missing where it is not there.
    fn text(self, attribute: &str, lacks: &'static str) -> Result<String, UrdfError> {
        self.node.attribute(attribute).map(str::to_owned).ok_or_else(|| self.lacks(lacks))
    }

    fn lacks(self, lacks: &'static str) -> UrdfError {
        UrdfError::Incomplete { line: line(self.node), element: title(self.owner), lacks }
    }

    /// An attribute that holds a number, if it is there.
    fn number(self, attribute: &'static str) -> Result<Option<f64>, UrdfError> {
        Ok(self.numbers(attribute, ("a number", "0.5"))?.map(|[number]| number))
    }

    /// An attribute that holds three numbers, if it is there.
    fn vector(self, attribute: &'static str) -> Result<Option<[f64; 3]>, UrdfError> {
        self.numbers(attribute, ("three numbers", "0 0 1"))
    }

    /// An attribute that holds `N` numbers with white space between them, if it is there.
    fn numbers<const N: usize>(
        self,
        attribute: &'static str,
        (expected, example): (&'static str, &'static str),
    ) -> Result<Option<[f64; N]>, UrdfError> {
        let Some(value) = self.node.attribute(attribute) else { return Ok(None) };
        let numbers: Result<Vec<f64>, _> = value.split_whitespace().map(str::parse).collect();
        match numbers.ok().and_then(|numbers| <[f64; N]>::try_from(numbers).ok()) {
            Some(numbers) => Ok(Some(numbers)),
            None => Err(UrdfError::NotANumber {
                line: line(self.node),
                element: title(self.owner),
                attribute,
                value: value.to_owned(),
                expected,
                example: format!("<{} {attribute}=\"{example}\">", self.node.tag_name().name()),
            }),
        }
    }
}

/// The element's tag and name, for messages.
fn title(element: Node) -> String {
    format!("{} `{}`", element.tag_name().name(), name(element))
}

fn link(link: Part, line: u32) -> Result<Link, UrdfError> {
    let name = link.text("name", "a name")?;
    let inertial = link.child("inertial")?.map(inertial).transpose()?;
    Ok(Link { name, line, inertial })
}

fn inertial(inertial: Part) -> Result<Inertial, UrdfError> {
    let mut missing = Vec::new();
    let origin = pose(inertial)?;
    let mass = match inertial.child("mass")? {
        Some(mass) => mass.number("value")?,
        None => None,
    };
    if mass.is_none() {
        missing.push("mass");
    }
    let mut inertia = [0.0; 6];
    match inertial.child("inertia")? {
        Some(tensor) => {
            for (moment, attribute) in inertia.iter_mut().zip(TENSOR) {
                match tensor.number(attribute)? {
                    Some(number) => *moment = number,
                    None => missing.push(attribute),
                }
            }
        }
        None => missing.push("inertia"),
    }
    Ok(Inertial { origin, mass: mass.unwrap_or(0.0), inertia, missing })
}

fn joint(joint: Part, line: u32) -> Result<Joint, UrdfError> {
    let name = joint.text("name", "a name")?;
    let kind = joint.text("type", "a type")?;
    let parent = end(joint, "parent", "a <parent link=…>")?;
    let child = end(joint, "child", "a <child link=…>")?;
    let Some(kind) = JointKind::from_name(&kind) else {
        return Err(UrdfError::UnknownType { line, joint: name, kind });
    };
    let axis = match joint.child("axis")? {
        Some(axis) => axis.vector("xyz")?.ok_or_else(|| axis.lacks("the xyz of its <axis>"))?,
        None => DEFAULT_AXIS,
    };
    let (damping, friction) = match joint.child("dynamics")? {
        Some(dynamics) => (dynamics.number("damping")?, dynamics.number("friction")?),
        None => (None, None),
    };
    Ok(Joint {
        name,
        line,
        kind,
        origin: pose(joint)?,
        parent,
        child,
        axis,
        limit: joint.child("limit")?.map(limit).transpose()?.unwrap_or_default(),
        damping: damping.unwrap_or(0.0),
        friction: friction.unwrap_or(0.0),
        mimic: joint.child("mimic")?.map(mimic).transpose()?,
    })
}

/// The link that a joint's `<parent>` or `<child>` names.
fn end(joint: Part, tag: &'static str, lacks: &'static str) -> Result<String, UrdfError> {
    joint.child(tag)?.ok_or_else(|| joint.lacks(lacks))?.text("link", lacks)
}

fn limit(limit: Part) -> Result<Limit, UrdfError> {
    let (below, above) =
        if limit.version >= Version::OPEN_LIMITS { (f64::NEG_INFINITY, f64::INFINITY) } else { (0.0, 0.0) };
    let range = match (limit.number("lower")?, limit.number("upper")?) {
        (None, None) => None,
        (lower, upper) => Some([lower.unwrap_or(below), upper.unwrap_or(above)]),
    };
    Ok(Limit { range, velocity: limit.number("velocity")?, effort: limit.number("effort")? })
}

fn mimic(mimic: Part) -> Result<Mimic, UrdfError> {
    Ok(Mimic {
        joint: mimic.text("joint", "the joint of its <mimic>")?,
        multiplier: mimic.number("multiplier")?.unwrap_or(1.0),
        offset: mimic.number("offset")?.unwrap_or(0.0),
    })
}

/// The `<origin>` of an `<inertial>` or a joint.
fn pose(element: Part) -> Result<Pose, UrdfError> {
    let Some(origin) = element.child("origin")? else { return Ok(Pose::default()) };
    let xyz = origin.vector("xyz")?.unwrap_or_default();
    let rpy = origin.vector("rpy")?;
    let quaternion = if element.version >= Version::QUATERNIONS {
        origin.numbers("quat_xyzw", ("four numbers", "0 0 0 1"))?
    } else {
        None
    };
    match (rpy, quaternion) {
        (Some(_), Some(_)) => {
            Err(UrdfError::TwoRotations { line: line(origin.node), element: title(origin.owner) })
        }
        (rpy, None) => Ok(Pose { xyz, rpy: rpy.unwrap_or_default() }),
        (None, Some(quaternion)) => Ok(Pose { xyz, rpy: roll_pitch_yaw(quaternion) }),
    }
}

/// The angles of a quaternion (x, y, z, w) of any length, with urdfdom's formulas; zero for a quaternion of
/// zeros.
fn roll_pitch_yaw(quaternion: [f64; 4]) -> [f64; 3] {
    let norm = quaternion.iter().map(|x| x * x).sum::<f64>().sqrt();
    if !norm.is_finite() {
        return [f64::NAN; 3]; // which is refused like any other origin that is not finite
    }
    let [x, y, z, w] = if norm > 0.0 { quaternion.map(|x| x / norm) } else { [0.0, 0.0, 0.0, 1.0] };
    let sin_pitch = -2.0 * (x * z - w * y);
    if sin_pitch <= -VERTICAL_PITCH {
        [0.0, -std::f64::consts::FRAC_PI_2, 2.0 * x.atan2(-y)]
    } else if sin_pitch >= VERTICAL_PITCH {
        [0.0, std::f64::consts::FRAC_PI_2, 2.0 * (-x).atan2(y)]
    } else {
        let (xx, yy, zz, ww) = (x * x, y * y, z * z, w * w);
        [
            (2.0 * (y * z + w * x)).atan2(ww - xx - yy + zz),
            sin_pitch.asin(),
            (2.0 * (x * y + w * z)).atan2(ww + xx - yy - zz),
        ]
    }
}
