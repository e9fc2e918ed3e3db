//! What of an identified model goes into the files that other programs read, and what does not.

use crate::analysis::Analysis;
use phiw_dynamics::Tree;
use phiw_effects::{Catalogue, Mechanism};
use phiw_identification::effect::{EffectParameter, JointProperty};
use phiw_identification::model::EffectParameters;
use phiw_identification::{EffectCatalogue, Model};
use phiw_mjcf::{FixedTendon, JointModel};

/// How far below zero what is left of a property may be by rounding.
const ROUNDING: f64 = 1e-9;

/// An identified model and the robot that it is of.
#[derive(Clone, Copy)]
pub struct Carried<'a> {
    /// The robot, with the URDF's inertial parameters.
    pub tree: &'a Tree,
    /// The URDF's text.
    pub xml: &'a str,
    /// The model.
    pub model: &'a Model,
    /// What its effects are.
    pub catalogue: &'a Catalogue,
}

impl<'a> Carried<'a> {
    /// Of an analysis.
    pub fn of(analysis: &'a Analysis<'_>) -> Self {
        let session = analysis.session;
        Carried {
            tree: &session.tree,
            xml: &session.xml,
            model: &analysis.model,
            catalogue: &session.catalogue,
        }
    }

    /// Each effect with what its parameters are and their values over possible bodies.
    pub fn effects(self) -> impl Iterator<Item = (&'a EffectParameters, Vec<EffectParameter>, Vec<f64>)> {
        self.model.effects.iter().enumerate().map(move |(index, effect)| {
            let built = self.catalogue.build(&effect.spec, self.tree);
            let parameters = built.map(|built| built.parameters()).unwrap_or_default();
            let value =
                |at: usize| self.model.consistent_effect(index, at).unwrap_or(effect.parameters[at].value);
            (effect, parameters, (0..effect.parameters.len()).map(value).collect())
        })
    }
}

/// The model beside its bodies, as MJCF has it.
pub struct Exported {
    /// What each joint has.
    pub joints: Vec<JointModel>,
    /// What joints share.
    pub tendons: Vec<FixedTendon>,
    /// What MJCF cannot express, in words.
    pub left_out: Vec<String>,
}

impl Exported {
    /// Of a model's effects; friction that was not identified stays as the URDF declares it.
    pub fn of(carried: Carried<'_>) -> Self {
        let tree = carried.tree;
        let of_urdf = |joint: usize| {
            let body = tree.joint(joint);
            let identified = |property| fitted(carried, property, &body.joint).is_some();
            let declared = |property, value: f64| if identified(property) { 0.0 } else { value.max(0.0) };
            JointModel {
                damping: declared(JointProperty::Damping, body.damping),
                friction: declared(JointProperty::Friction, body.friction),
                ..JointModel::default()
            }
        };
        let joints = (0..tree.joint_count()).map(of_urdf).collect();
        let mut exported = Exported { joints, tendons: Vec::new(), left_out: Vec::new() };
        let mut left_out = LeftOut::default();
        let mut shared = Vec::new();
        for (effect, parameters, values) in carried.effects() {
            let mechanisms = carried.catalogue.mechanisms(&effect.spec, &parameters, &values);
            let (kind, joints) = (&effect.spec.kind, &effect.spec.joints);
            if mechanisms.parts.is_empty() && mechanisms.left_out.is_empty() {
                left_out.add(kind.clone(), joints);
            }
            mechanisms.left_out.iter().for_each(|name| left_out.add(format!("{kind} ({name})"), joints));
            for part in mechanisms.parts {
                match part {
                    Mechanism::Transmission { .. } => shared.push((kind, part)),
                    part => {
                        if !exported.of_joint(carried, &part) {
                            left_out.add(format!("{kind} (negative)"), joints);
                        }
                    }
                }
            }
        }
        // What crosses over takes a part of the joints' own, so it comes after all of that.
        for (kind, part) in shared {
            if let Err((why, joints)) = exported.of_transmission(carried, &part) {
                left_out.add(format!("{kind} ({why})"), &joints);
            }
        }
        exported.left_out = left_out.in_words();
        exported
    }

    /// What MJCF can express but a table of drives cannot, in words: springs, motors that do not deliver
    /// their command, shared transmissions.
    pub fn beyond_a_drive(&self, carried: Carried<'_>) -> Vec<String> {
        let mut beyond = LeftOut::default();
        for (index, joint) in self.joints.iter().enumerate() {
            let name = std::slice::from_ref(&carried.tree.joint(index).joint);
            if joint.stiffness != 0.0 {
                beyond.add("spring".to_owned(), name);
            }
            if joint.motor_gain != 1.0 || joint.motor_bias != 0.0 {
                beyond.add("gain and bias of the motor".to_owned(), name);
            }
        }
        for tendon in &self.tendons {
            let names = tendon.joints.map(|(joint, _)| carried.tree.joint(joint).joint.clone());
            beyond.add("shared transmission".to_owned(), &names);
        }
        beyond.in_words()
    }

    /// Takes a part of one joint; `false` if MJCF has no such value.
    fn of_joint(&mut self, carried: Carried<'_>, part: &Mechanism) -> bool {
        let tree = carried.tree;
        let (Mechanism::Joint { joint, .. }
        | Mechanism::Spring { joint, .. }
        | Mechanism::Motor { joint, .. }
        | Mechanism::MotorDelay { joint, .. }) = part
        else {
            return false;
        };
        let Some(model) = tree.joint_index(joint).map(|joint| &mut self.joints[joint]) else { return false };
        match *part {
            Mechanism::Joint { property, value, width, .. } if value >= 0.0 => {
                *property_of(model, property) += value;
                model.friction_width = model.friction_width.max(width);
            }
            Mechanism::Spring { stiffness, reference, .. } => {
                // Two springs are one: stiffnesses add, and so do their torques.
                let torque = model.stiffness * model.spring_reference + stiffness * reference;
                model.stiffness += stiffness;
                model.spring_reference = torque / model.stiffness;
            }
            Mechanism::Motor { gain, bias, .. } => {
                model.motor_gain *= gain;
                model.motor_bias += bias;
            }
            Mechanism::MotorDelay { delay, .. } => model.motor_delay += delay,
            _ => return false,
        }
        true
    }

    /// Takes a transmission; else says why not, and of which joints.
    fn of_transmission(
        &mut self,
        carried: Carried<'_>,
        part: &Mechanism,
    ) -> Result<(), (&'static str, Vec<String>)> {
        let tree = carried.tree;
        let Mechanism::Transmission { joints, factors, property, value, crossing_only, width } = part else {
            return Ok(());
        };
        let refused = |why| Err((why, joints.to_vec()));
        let [Some(first), Some(second)] = joints.each_ref().map(|joint| tree.joint_index(joint)) else {
            return refused("of a joint that follows another");
        };
        if *value < 0.0 {
            return refused("negative");
        }
        if *property == JointProperty::Armature && !carries(carried, first, second) {
            return refused("inertia between two branches");
        }
        if *crossing_only {
            let own = [first, second].map(|joint| *property_of(&mut self.joints[joint], *property));
            if own.iter().any(|own| own - value < -ROUNDING * value) {
                return refused("more crosses over than the joints have of their own");
            }
            for (joint, own) in [first, second].into_iter().zip(own) {
                *property_of(&mut self.joints[joint], *property) = (own - value).max(0.0);
            }
        }
        let between = [(first, factors[0]), (second, factors[1])];
        let place = self.tendons.iter().position(|tendon| tendon.joints == between).unwrap_or_else(|| {
            let name = format!("{}_{}_{}", joints[0], joints[1], self.tendons.len() + 1);
            self.tendons.push(FixedTendon {
                name,
                joints: between,
                armature: 0.0,
                damping: 0.0,
                friction: 0.0,
                friction_width: 0.0,
            });
            self.tendons.len() - 1
        });
        let tendon = &mut self.tendons[place];
        match property {
            JointProperty::Armature => tendon.armature += value,
            JointProperty::Damping => tendon.damping += value,
            JointProperty::Friction => {
                tendon.friction += value;
                tendon.friction_width = tendon.friction_width.max(*width);
            }
        }
        Ok(())
    }
}

fn property_of(model: &mut JointModel, property: JointProperty) -> &mut f64 {
    match property {
        JointProperty::Armature => &mut model.armature,
        JointProperty::Damping => &mut model.damping,
        JointProperty::Friction => &mut model.friction,
    }
}

/// Whether one of two joints carries the other.
fn carries(carried: Carried<'_>, first: usize, second: usize) -> bool {
    let bodies = carried.tree.bodies();
    let body = |joint: usize| {
        let name = &carried.tree.joint(joint).joint;
        bodies.iter().position(|body| body.joint == *name)
    };
    let above = |joint: usize, other: usize| {
        let way = std::iter::successors(body(joint), |&body| bodies[body].parent);
        way.into_iter().any(|above| Some(above) == body(other))
    };
    above(first, second) || above(second, first)
}

/// The parameter of the effect on one joint that is this property of it.
pub fn fitted(carried: Carried<'_>, property: JointProperty, joint: &str) -> Option<f64> {
    let catalogue = carried.catalogue;
    let is_it = |spec: &phiw_identification::EffectSpec| {
        spec.joints == [joint] && catalogue.joint_property(spec) == Some(property)
    };
    let effect = carried.model.effects.iter().position(|effect| is_it(&effect.spec))?;
    carried.model.consistent_effect(effect, 0)
}

/// What is left out, each with its joints.
#[derive(Default)]
pub struct LeftOut(Vec<(String, Vec<String>)>);

impl LeftOut {
    /// Adds a thing and the joints that it acts on.
    pub fn add(&mut self, what: String, joints: &[String]) {
        let joints = joints.join("+");
        match self.0.iter_mut().find(|(other, _)| *other == what) {
            Some((_, all)) => all.push(joints),
            None => self.0.push((what, vec![joints])),
        }
    }

    /// `kind of joint_1, joint_2`.
    pub fn in_words(&self) -> Vec<String> {
        self.0.iter().map(|(what, joints)| format!("{what} of {}", joints.join(", "))).collect()
    }
}

/// The first lines of the comment at the head of a file: whose it is, and what it lacks.
pub fn header(carried: Carried<'_>, file: &str, left_out: &[String]) -> Vec<String> {
    let logs: Vec<&str> = carried
        .model
        .data
        .iter()
        .filter(|data| data.role == phiw_identification::model::DataRole::Train)
        .map(|data| data.log.as_str())
        .collect();
    let mut lines = vec![format!("{MARK} from {}.", logs.join(", "))];
    if left_out.is_empty() {
        lines.push(format!("{file} holds all of the model."));
    } else {
        lines.push(format!("The model has more than {file} can express; it is in model.json:"));
        lines.extend(left_out.iter().map(|line| format!("- {line}")));
    }
    lines
}

/// How the comment at the head of a file begins.
pub const MARK: &str = "Identified by phiw";
