//! The robot and its world as MJCF, MuJoCo's own description.

use crate::inertial::quaternion_of;
use phiw_dynamics::{Body, JointType, Tree, World};
use std::fmt::Write;

/// What stands for the inertia of every body in the text; the true one is written into the compiled model,
/// where neither the compiler's rounding nor its idea of a real body get at it.
///
/// The compiler must not think that a body's frame is its inertial frame, or it would never look at the
/// latter again: hence a centre of mass and a turn that are not zero.
pub(crate) mod placeholder {
    pub const CENTER: [f64; 3] = [0.125, 0.25, 0.5];
    pub const AXES: [f64; 4] = [0.5; 4];
    pub const MOMENTS: [f64; 3] = [4.0, 5.0, 6.0];
    /// The time step \[s\].
    pub const TIME_STEP: f64 = 0.001953125;

    /// Masses tell the bodies apart.
    pub fn mass(body: usize) -> f64 {
        1.0 + body as f64
    }
}

/// Radius of the sphere at each corner of a sole \[m\]: nothing, for what stands on it.
const CORNER_RADIUS: f64 = 1e-9;
/// Where a joint has no limit, but has one on its other side \[rad, m\].
const FAR: f64 = 1e9;

/// Contacts and limits as stiff as the time step allows: MuJoCo raises this time constant \[s\] to two steps.
const SOLREF: &str = "0.0002 1";
/// The share of a constraint's force that a full penetration gets, reached at once.
const SOLIMP: &str = "0.99 0.99 0.001";
/// How much stiffer friction is than the floor: a foot under load creeps by less.
const FRICTION_STIFFNESS: f64 = 100.0;
/// MuJoCo takes no smaller coefficient of friction.
const SMALLEST_FRICTION: f64 = 1e-5;

/// The robot in its world.
pub(crate) fn mjcf(tree: &Tree, world: &World) -> String {
    let mut text = Mjcf { tree, world, xml: String::new() };
    text.write();
    text.xml
}

/// The foot of each sole's corner, in the order in which the text has them: that of the bodies.
pub(crate) fn feet_of_corners(tree: &Tree, world: &World) -> Vec<usize> {
    let feet = (0..tree.bodies().len())
        .flat_map(|body| world.feet.iter().enumerate().filter(move |(_, foot)| foot.body == body));
    feet.flat_map(|(index, foot)| vec![index; foot.sole.len()]).collect()
}

struct Mjcf<'a> {
    tree: &'a Tree,
    world: &'a World,
    xml: String,
}

impl Mjcf<'_> {
    /// Appends; writing to a string can not fail.
    fn push(&mut self, text: std::fmt::Arguments<'_>) {
        let _ = self.xml.write_fmt(text);
    }

    fn write(&mut self) {
        let gravity = Numbers(&self.tree.gravity);
        self.push(format_args!(
            "<mujoco>\n<compiler angle=\"radian\" autolimits=\"false\" inertiafromgeom=\"false\" \
             balanceinertia=\"false\" fusestatic=\"false\" alignfree=\"false\"/>\n\
             <option timestep=\"{}\" gravity=\"{gravity}\" integrator=\"RK4\" solver=\"Newton\" tolerance=\"1e-12\" \
             cone=\"elliptic\" impratio=\"{FRICTION_STIFFNESS}\"/>\n<worldbody>\n",
            placeholder::TIME_STEP
        ));
        if !self.world.feet.is_empty() {
            self.contact("plane", "1 1 1", [0.0; 3], (1, 0));
        }
        for root in 0..self.tree.bodies().len() {
            if self.tree.bodies()[root].parent.is_none() {
                self.body(root);
            }
        }
        self.push(format_args!("</worldbody>\n</mujoco>\n"));
    }

    fn body(&mut self, index: usize) {
        let tree = self.tree;
        let body = &tree.bodies()[index];
        self.push(format_args!(
            "<body pos=\"{}\" quat=\"{}\">\n<inertial pos=\"{}\" quat=\"{}\" mass=\"{}\" diaginertia=\"{}\"/>\n",
            Numbers(&body.origin.translation.0),
            Numbers(&quaternion_of(body.origin.rotation)),
            Numbers(&placeholder::CENTER),
            Numbers(&placeholder::AXES),
            placeholder::mass(index),
            Numbers(&placeholder::MOMENTS),
        ));
        self.joint(body);
        self.soles(index);
        for child in index + 1..tree.bodies().len() {
            if tree.bodies()[child].parent == Some(index) {
                self.body(child);
            }
        }
        self.push(format_args!("</body>\n"));
    }

    fn joint(&mut self, body: &Body) {
        let kind = match body.joint_type {
            JointType::Floating => return self.push(format_args!("<freejoint/>\n")),
            JointType::Revolute | JointType::Continuous => "hinge",
            JointType::Prismatic => "slide",
        };
        let first_joint = self.tree.velocity_size() - self.tree.joint_count();
        let rotor = self.world.rotor_inertia.get(body.velocity_index - first_joint).copied().unwrap_or(0.0);
        self.push(format_args!(
            "<joint name=\"{}\" type=\"{kind}\" axis=\"{}\" armature=\"{rotor}\"",
            Escaped(&body.joint),
            Numbers(&body.axis.0)
        ));
        let (lower, upper) = (body.limits.lower, body.limits.upper);
        let limited = body.joint_type != JointType::Continuous && (lower.is_finite() || upper.is_finite());
        if limited && self.world.position_limits {
            self.push(format_args!(
                " limited=\"true\" range=\"{} {}\" solreflimit=\"{SOLREF}\" solimplimit=\"{SOLIMP}\"",
                lower.max(-FAR),
                upper.min(FAR)
            ));
        }
        self.push(format_args!("/>\n"));
    }

    fn soles(&mut self, index: usize) {
        for foot in self.world.feet.iter().filter(|foot| foot.body == index) {
            for &corner in &foot.sole {
                self.contact("sphere", &CORNER_RADIUS.to_string(), corner, (0, 1));
            }
        }
    }

    /// What touches; `bits` let soles touch the floor and nothing else.
    fn contact(&mut self, shape: &str, size: &str, position: [f64; 3], bits: (u8, u8)) {
        let friction = self.world.floor_friction;
        let (dimensions, friction) =
            if friction < SMALLEST_FRICTION { (1, SMALLEST_FRICTION) } else { (3, friction) };
        self.push(format_args!(
            "<geom type=\"{shape}\" size=\"{size}\" pos=\"{}\" contype=\"{}\" conaffinity=\"{}\" \
             condim=\"{dimensions}\" friction=\"{friction}\" solref=\"{SOLREF}\" solimp=\"{SOLIMP}\"/>\n",
            Numbers(&position),
            bits.0,
            bits.1
        ));
    }
}

/// Numbers with all their digits, separated by spaces.
struct Numbers<'a>(&'a [f64]);

impl std::fmt::Display for Numbers<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (index, number) in self.0.iter().enumerate() {
            let space = if index == 0 { "" } else { " " };
            write!(f, "{space}{number}")?;
        }
        Ok(())
    }
}

/// A name inside quotes of XML.
struct Escaped<'a>(&'a str);

impl std::fmt::Display for Escaped<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.chars().try_for_each(|character| match character {
            '&' => f.write_str("&amp;"),
            '<' => f.write_str("&lt;"),
            '"' => f.write_str("&quot;"),
            other => write!(f, "{other}"),
        })
    }
}
