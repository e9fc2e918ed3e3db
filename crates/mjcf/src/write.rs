//! The text of an MJCF file.

use crate::turning::{Mobility, turning};
use crate::{FixedTendon, RobotModel};
use phiw_dynamics::check::check_size;
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::{Body, DimensionError, JointType, Mat3, Tree, Vec3};
use std::fmt::{self, Display, Write};

/// Why a robot cannot be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MjcfError {
    /// Not one joint model for each joint.
    #[error(transparent)]
    Size(#[from] DimensionError),
    /// A number that is none.
    #[error("{what} of `{name}` is not a finite number")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// Of which joint or link.
        name: String,
    },
    /// A tendon of a joint that is not there.
    #[error("the tendon `{name}` names joint {joint}, but the robot has {joints} joints")]
    NoSuchJoint {
        /// The tendon.
        name: String,
        /// The joint.
        joint: usize,
        /// Joints of the robot.
        joints: usize,
    },
}

/// Time step of the file \[s\], MuJoCo's own default.
pub(crate) const TIMESTEP: f64 = 0.002;
/// Steps may be as short as this before a motor's memory of its commands is too short for its delay \[s\].
const SHORTEST_TIMESTEP: f64 = 1e-4;
/// A limit where a joint has one on its other side only \[rad, m\].
const FAR: f64 = 1e9;

/// The robot as MJCF. Its bodies, joints and motors have the names of links and joints.
///
/// # Errors
/// The lists do not fit the robot, or a number is not finite.
pub fn write_mjcf(robot: &RobotModel<'_>) -> Result<String, MjcfError> {
    check(robot)?;
    let mut file = File { robot, mobility: Mobility::of(robot)?, text: String::new() };
    file.write();
    Ok(file.text)
}

fn check(robot: &RobotModel<'_>) -> Result<(), MjcfError> {
    let tree = robot.tree;
    check_size("joint models", robot.joints.len(), tree.joint_count())?;
    let not_finite = |what, name: &str| MjcfError::NotFinite { what, name: name.to_owned() };
    if let Some(body) = tree.bodies().iter().find(|body| !body.inertial.iter().all(|x| x.is_finite())) {
        return Err(not_finite("an inertial parameter", &body.link));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let numbers = [
            ("the armature", joint.armature),
            ("the damping", joint.damping),
            ("the friction", joint.friction),
            ("the friction's width", joint.friction_width),
            ("the stiffness", joint.stiffness),
            ("the spring's reference", joint.spring_reference),
            ("the motor's gain", joint.motor_gain),
            ("the motor's bias", joint.motor_bias),
            ("the motor's delay", joint.motor_delay),
        ];
        if let Some((what, _)) = numbers.iter().find(|(_, number)| !number.is_finite()) {
            return Err(not_finite(what, &tree.joint(index).joint));
        }
    }
    for tendon in &robot.tendons {
        let numbers = [
            tendon.armature,
            tendon.damping,
            tendon.friction,
            tendon.friction_width,
            tendon.joints[0].1,
            tendon.joints[1].1,
        ];
        if !numbers.iter().all(|number| number.is_finite()) {
            return Err(not_finite("a number", &tendon.name));
        }
        let joints = tree.joint_count();
        if let Some(&(joint, _)) = tendon.joints.iter().find(|(joint, _)| *joint >= joints) {
            return Err(MjcfError::NoSuchJoint { name: tendon.name.clone(), joint, joints });
        }
    }
    Ok(())
}

struct File<'a> {
    robot: &'a RobotModel<'a>,
    mobility: Mobility,
    text: String,
}

impl File<'_> {
    /// Appends; writing to a string does not fail.
    fn push(&mut self, text: fmt::Arguments<'_>) {
        let _ = self.text.write_fmt(text);
    }

    fn write(&mut self) {
        let tree = self.robot.tree;
        self.text.push_str(&comment(&self.robot.header));
        self.push(format_args!(
            "<mujoco model=\"{}\">\n  <compiler angle=\"radian\" autolimits=\"false\" inertiafromgeom=\"false\" balanceinertia=\"false\"/>\n  \
             <option timestep=\"{TIMESTEP}\" gravity=\"{}\" integrator=\"implicitfast\"/>\n  <worldbody>\n",
            Escaped(tree.name()),
            Numbers(&tree.gravity)
        ));
        for root in (0..tree.bodies().len()).filter(|&body| tree.bodies()[body].parent.is_none()) {
            self.body(root, 2);
        }
        self.push(format_args!("  </worldbody>\n"));
        self.tendons();
        self.equalities();
        self.motors();
        self.push(format_args!("</mujoco>\n"));
    }

    fn body(&mut self, index: usize, depth: usize) {
        let tree = self.robot.tree;
        let body = &tree.bodies()[index];
        let indent = "  ".repeat(depth);
        self.push(format_args!(
            "{indent}<body name=\"{}\" pos=\"{}\" quat=\"{}\">\n",
            Escaped(&body.link),
            Numbers(&body.origin.translation.0),
            Numbers(&quaternion(body.origin.rotation))
        ));
        let inertia = Inertia::<f64>::from_parameters(&body.inertial);
        let center =
            if inertia.mass == 0.0 { Vec3::zero() } else { inertia.moment.scale(1.0 / inertia.mass) };
        let i = inertia.tensor_about_center_of_mass(center).0;
        self.push(format_args!(
            "{indent}  <inertial pos=\"{}\" mass=\"{}\" fullinertia=\"{}\"/>\n",
            Numbers(&center.0),
            inertia.mass,
            Numbers(&[i[0][0], i[1][1], i[2][2], i[0][1], i[0][2], i[1][2]])
        ));
        self.joint(body, &indent);
        for child in index + 1..tree.bodies().len() {
            if tree.bodies()[child].parent == Some(index) {
                self.body(child, depth + 1);
            }
        }
        self.push(format_args!("{indent}</body>\n"));
    }

    fn joint(&mut self, body: &Body, indent: &str) {
        let kind = match body.joint_type {
            JointType::Floating => return self.push(format_args!("{indent}  <freejoint/>\n")),
            JointType::Revolute | JointType::Continuous => "hinge",
            JointType::Prismatic => "slide",
        };
        let axis = Numbers(&body.axis.0);
        self.push(format_args!(
            "{indent}  <joint name=\"{}\" type=\"{kind}\" axis=\"{axis}\"",
            Escaped(&body.joint)
        ));
        let (lower, upper) = (body.limits.lower, body.limits.upper);
        let limited = body.joint_type != JointType::Continuous && lower < upper;
        if limited && (lower.is_finite() || upper.is_finite()) {
            self.push(format_args!(" limited=\"true\" range=\"{} {}\"", lower.max(-FAR), upper.min(FAR)));
        }
        let joint = self.robot.tree.joint_index(&body.joint).filter(|_| !body.mimic);
        if let Some((joint, model)) = joint.map(|joint| (joint, self.robot.joints[joint])) {
            let attributes =
                [("armature", model.armature), ("damping", model.damping), ("frictionloss", model.friction)];
            for (name, value) in attributes.iter().filter(|(_, value)| *value != 0.0) {
                self.push(format_args!(" {name}=\"{value}\""));
            }
            let mobility = self.mobility.along(&[(joint, 1.0)]);
            self.text.push_str(&turning(model.friction, model.friction_width, mobility));
            if model.stiffness != 0.0 {
                let (stiffness, reference) = (model.stiffness, model.spring_reference);
                self.push(format_args!(" stiffness=\"{stiffness}\" springref=\"{reference}\""));
            }
        }
        self.push(format_args!("/>\n"));
    }

    fn tendons(&mut self) {
        if self.robot.tendons.is_empty() {
            return;
        }
        self.push(format_args!("  <tendon>\n"));
        for FixedTendon { name, joints, armature, damping, friction, friction_width } in &self.robot.tendons {
            self.push(format_args!("    <fixed name=\"{}\"", Escaped(name)));
            let attributes = [("armature", armature), ("damping", damping), ("frictionloss", friction)];
            for (name, value) in attributes.iter().filter(|(_, value)| **value != 0.0) {
                self.push(format_args!(" {name}=\"{value}\""));
            }
            let mobility = self.mobility.along(joints);
            self.text.push_str(&turning(*friction, *friction_width, mobility));
            self.push(format_args!(">\n"));
            for &(joint, factor) in joints {
                let joint = Escaped(&self.robot.tree.joint(joint).joint);
                self.push(format_args!("      <joint joint=\"{joint}\" coef=\"{factor}\"/>\n"));
            }
            self.push(format_args!("    </fixed>\n"));
        }
        self.push(format_args!("  </tendon>\n"));
    }

    /// Joints that follow another.
    fn equalities(&mut self) {
        let tree = self.robot.tree;
        if !tree.has_mimic() {
            return;
        }
        self.push(format_args!("  <equality>\n"));
        for body in tree.bodies().iter().filter(|body| body.mimic) {
            let leader = leader(tree, body).unwrap_or_default();
            self.push(format_args!(
                "    <joint joint1=\"{}\" joint2=\"{}\" polycoef=\"{} {} 0 0 0\"/>\n",
                Escaped(&body.joint),
                Escaped(leader),
                body.offset,
                body.ratio
            ));
        }
        self.push(format_args!("  </equality>\n"));
    }

    fn motors(&mut self) {
        let tree = self.robot.tree;
        self.push(format_args!("  <actuator>\n"));
        for (index, model) in self.robot.joints.iter().enumerate() {
            let body = tree.joint(index);
            let name = Escaped(&body.joint);
            self.push(format_args!(
                "    <general name=\"{name}\" joint=\"{name}\" gainprm=\"{}\"",
                model.motor_gain
            ));
            if model.motor_bias != 0.0 {
                self.push(format_args!(" biastype=\"affine\" biasprm=\"{} 0 0\"", model.motor_bias));
            }
            if model.motor_delay > 0.0 {
                let samples = (model.motor_delay / SHORTEST_TIMESTEP).ceil() + 2.0;
                let delay = model.motor_delay;
                self.push(format_args!(" delay=\"{delay}\" nsample=\"{samples}\" interp=\"linear\""));
            }
            let effort = body.limits.effort;
            if effort.is_finite() && effort > 0.0 {
                self.push(format_args!(" forcelimited=\"true\" forcerange=\"{} {effort}\"", -effort));
            }
            self.push(format_args!("/>\n"));
        }
        self.push(format_args!("  </actuator>\n"));
    }
}

/// The joint whose coordinate a follower shares.
fn leader<'a>(tree: &'a Tree, follower: &Body) -> Option<&'a str> {
    let leads = |body: &&Body| !body.mimic && body.velocity_index == follower.velocity_index;
    tree.bodies().iter().find(leads).map(|body| body.joint.as_str())
}

/// Lines as a comment of XML, with an end of line behind it; nothing without lines.
pub fn comment(lines: &[String]) -> String {
    if lines.is_empty() {
        return String::new();
    }
    let mut text = String::from("<!--\n");
    for line in lines {
        // Two hyphens would end the comment, and a control character the file.
        let line: String = line.chars().filter(|c| !c.is_control()).collect();
        let _ = writeln!(text, "  {}", line.replace("--", "- -"));
    }
    text.push_str("-->\n");
    text
}

/// MuJoCo's quaternion `(w, x, y, z)` of a rotation (Shepperd 1978: the largest of the four first).
fn quaternion(rotation: Mat3<f64>) -> [f64; 4] {
    let r = rotation.0;
    let squares = [
        1.0 + r[0][0] + r[1][1] + r[2][2],
        1.0 + r[0][0] - r[1][1] - r[2][2],
        1.0 - r[0][0] + r[1][1] - r[2][2],
        1.0 - r[0][0] - r[1][1] + r[2][2],
    ];
    let largest = (0..4).max_by(|&a, &b| squares[a].total_cmp(&squares[b])).unwrap_or_default();
    let twice = squares[largest].max(f64::MIN_POSITIVE).sqrt();
    let (x, y, z) = (r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]);
    let (xy, xz, yz) = (r[1][0] + r[0][1], r[0][2] + r[2][0], r[2][1] + r[1][2]);
    let own = twice * twice;
    [[own, x, y, z], [x, own, xy, xz], [y, xy, own, yz], [z, xz, yz, own]][largest]
        .map(|product| 0.5 * product / twice)
}

/// Numbers with all their digits, separated by spaces.
pub(crate) struct Numbers<'a>(pub &'a [f64]);

impl Display for Numbers<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, number) in self.0.iter().enumerate() {
            write!(f, "{}{number}", if index == 0 { "" } else { " " })?;
        }
        Ok(())
    }
}

/// A name inside quotes of XML.
pub(crate) struct Escaped<'a>(pub &'a str);

impl Display for Escaped<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.chars().try_for_each(|character| match character {
            '&' => f.write_str("&amp;"),
            '<' => f.write_str("&lt;"),
            '>' => f.write_str("&gt;"),
            '"' => f.write_str("&quot;"),
            '\t' | '\n' | '\r' => write!(f, "&#{};", u32::from(character)),
            other => f.write_char(other),
        })
    }
}
