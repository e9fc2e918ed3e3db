//! What is true of a case, for the scorer and for whoever debugs the tracer; never in the folder that the
//! tracer sees.

use super::case::Case;
use super::family::Shape;
use super::friction::Friction;
use super::kind::{Kind, Name};
use super::mechanism::Mechanism;
use super::secret::{Form, Secret};
use super::situation::Situation;
use super::suite::NewForm;
use phiw_dynamics::{JointType, Tree, Vec3};
use serde::Serialize;

/// The truth of one case.
#[derive(Clone, Debug, Serialize)]
pub struct Truth {
    /// Its seed: everything follows from it.
    pub seed: u64,
    /// Its family.
    pub suite: super::suite::Suite,
    /// The robot's name.
    pub robot: &'static str,
    /// Whether the secrets set in after the clean robot was identified, whose model is held.
    pub held_model: bool,
    /// Effects to be declared.
    pub declared: Vec<String>,
    /// What nobody declared.
    pub secrets: Vec<TrueSecret>,
    /// What is particular about the case, in the wide suites.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub situation: Option<Situation>,
    /// Names that are not false though they are no secret: the situation makes them true.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub allowed: Vec<Kind>,
    /// Speed over which signs are smoothed \[rad/s\].
    pub sign_width: f64,
    /// Sensors and sampling.
    pub sensors: super::sensors::Sensors,
    /// Draws thrown away before this one.
    pub rejected: u64,
}

/// One undeclared effect.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrueSecret {
    /// What it is called.
    pub kind: Name,
    /// Names of its joints; none for a tilt of the base.
    pub joints: Vec<String>,
    /// Those of them where it is too small or too uncertain to be missed if it is not named.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub optional: Vec<String>,
    /// Other names, with their joints, for literally the same torques.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub equivalents: Vec<(Kind, Vec<String>)>,
    /// Its form, spelled out.
    pub form: String,
    /// Its size in the form's unit.
    pub scale: f64,
    /// RMS of its torque over that of the joint without it, for the joint that feels it most.
    pub size: f64,
    /// RMS of what the declared model cannot absorb, in units of the torque noise.
    pub visible: f64,
}

impl Truth {
    /// Of a drawn case.
    pub fn of(case: &Case) -> Self {
        let secret = |drawn: &super::case::Drawn| {
            let in_common = in_common(case, &drawn.secret);
            let and_those = |joints: &[usize]| case.robot.names(&[joints, &in_common].concat());
            TrueSecret {
                kind: drawn.secret.name,
                joints: and_those(&drawn.secret.joints),
                optional: and_those(&optional(drawn)),
                equivalents: equivalents(case, &drawn.secret),
                form: shortened(format!("{:?}", drawn.secret.form)),
                scale: drawn.secret.scale,
                size: drawn.size,
                visible: drawn.visible,
            }
        };
        Truth {
            seed: case.spec.seed,
            suite: case.spec.suite,
            robot: case.robot.name,
            held_model: case.spec.held,
            declared: case.declared.iter().map(|kind| kind.name()).collect(),
            secrets: case.secrets.iter().map(secret).collect(),
            situation: case.spec.situation,
            allowed: allowed(case),
            sign_width: case.ordinary.width,
            sensors: case.sensors.clone(),
            rejected: case.rejected,
        }
    }
}

/// Names that the situation, or the form of a friction, makes true.
fn allowed(case: &Case) -> Vec<Kind> {
    let mut allowed = Vec::new();
    if matches!(case.spec.situation, Some(Situation::LateFilter | Situation::HeldTorque)) {
        allowed.push(Kind::TimeDelay);
    }
    if case.spec.situation == Some(Situation::ShiftingZeros) {
        allowed.push(Kind::TorqueOffset);
    }
    // A spring over two joints is one of each of them, and a stiffness that crosses over.
    if case.spec.new_form() == Some(NewForm::OverTwoJoints) {
        allowed.extend([Kind::JointSpring, Kind::TorqueOffset]);
    }
    // Bristles are presliding: their torque depends on the way since the last reversal. Where all friction is
    // of long ones that is what is asked: a friction with its way, and nothing beside it.
    let mut secrets = case.plant.iter().chain(case.secrets.iter().map(|drawn| &drawn.secret));
    let bristles = |secret: &Secret| matches!(&secret.form, Form::Family(family) if matches!(family.shape, Shape::Bristles { .. }));
    if case.spec.situation != Some(Situation::SoftBristles) && secrets.any(bristles) {
        allowed.push(Kind::Hysteresis);
    }
    allowed
}

fn optional(drawn: &super::case::Drawn) -> Vec<usize> {
    drawn.secret.joints.iter().copied().filter(|joint| !drawn.material.contains(joint)).collect()
}

/// Other joints that have a friction of this family, since they rub in one direction only: that is half as
/// much in both directions, and a difference.
fn in_common(case: &Case, secret: &Secret) -> Vec<usize> {
    if !matches!(secret.form, Form::Family(_)) {
        return Vec::new();
    }
    let has = |other: &Secret| match (&other.form, secret.name) {
        (Form::Friction(Friction::Asymmetric { .. }), Name::Catalogue(Kind::ViscousFriction)) => true,
        (Form::Friction(Friction::Asymmetric { coulomb, .. }), Name::Catalogue(Kind::CoulombFriction)) => {
            *coulomb > 0.0
        }
        _ => false,
    };
    let others = case.secrets.iter().map(|drawn| &drawn.secret).filter(|other| has(other));
    let joints = others.flat_map(|other| other.joints.iter().copied());
    joints.filter(|joint| !secret.joints.contains(joint)).collect()
}

impl TrueSecret {
    /// Whether a tracer that does not name it has missed something.
    pub fn is_material(&self) -> bool {
        self.joints.is_empty() || self.optional.len() < self.joints.len()
    }
}

/// Other names for literally the same torques, whatever the motion, given that the declared model's
/// parameters are free.
fn equivalents(case: &Case, secret: &Secret) -> Vec<(Kind, Vec<String>)> {
    let tree = &case.robot.tree;
    let others = |joints: &[usize]| -> Vec<String> { case.robot.names(joints) };
    match (&secret.form, secret.joints.as_slice()) {
        // A balancer whose spring has no rest length pulls the first link with a torque that is a pure
        // sinusoid of its angle: so does a force on that link that keeps its direction.
        (Form::Mechanism(Mechanism::Balancer { rest: 0.0, .. }), joints)
            if joints.iter().all(|&joint| tree.joint(joint).parent.is_none()) =>
        {
            vec![(Kind::ExternalForce, others(joints))]
        }
        // Of two torques, a gain on the one is the inverse gain on the other, all parameters scaled.
        (Form::Gain, &[joint]) if tree.joint_count() == 2 && !case.spec.held => {
            vec![(Kind::TorqueGain, others(&[1 - joint]))]
        }
        // On a slide along gravity a mass is felt as inertia and as weight: more inertia is the same as less
        // weight.
        (Form::Mechanism(Mechanism::Rotor), &[joint]) if slides_along_gravity(tree, joint) => {
            vec![(Kind::TorqueOffset, others(&[joint]))]
        }
        (Form::Mechanism(Mechanism::Offset), &[joint]) if slides_along_gravity(tree, joint) => {
            vec![(Kind::RotorInertia, others(&[joint]))]
        }
        // A slide along gravity carries a force's point up and down: about the joints before it the arm is
        // the same, and along it the force is a weight.
        (Form::Force(_), &[joint]) if joint > 0 && slides_along_gravity(tree, joint) => {
            vec![(Kind::ExternalForce, others(&[joint - 1]))]
        }
        _ => Vec::new(),
    }
}

/// Whether the joint slides along gravity in whatever pose: all the joints before it turn about gravity.
fn slides_along_gravity(tree: &Tree, joint: usize) -> bool {
    let mut body = tree.joint(joint);
    if body.joint_type != JointType::Prismatic {
        return false;
    }
    let mut slide = body.origin.rotation * body.axis;
    while let Some(parent) = body.parent {
        body = &tree.bodies()[parent];
        // In the parent's frame the slide must lie along the parent's own axis, so that turning leaves it
        // where it is.
        if slide.dot(body.axis).abs() < 1.0 - 1e-9 {
            return false;
        }
        slide = body.origin.rotation * slide;
    }
    let gravity = Vec3(tree.gravity);
    slide.dot(gravity).abs() >= (1.0 - 1e-9) * gravity.dot(gravity).sqrt()
}

/// Paths of random walks are long and say nothing.
fn shortened(text: String) -> String {
    match text.char_indices().nth(400) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}
