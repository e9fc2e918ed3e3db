//! An effect as a fit sees it: columns beside those of the rigid body.
//!
//! This crate knows no effect by name. A catalogue (`phiw-effects` is one) or a user brings them.

pub use crate::effect_selector::EffectSelector;
pub use crate::reference::ReferenceModel;
pub use crate::sample::{BlockReference, Needs, Sample, second_rate};

use phiw_dynamics::Tree;
use phiw_telemetry::Block;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Names an effect: its kind, the joints that it acts on, and the constants in which it is not linear.
///
/// Enough to build the effect again, so it is what a model file holds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectSpec {
    /// Kind, as in the catalogue (`viscous_friction`, …).
    pub kind: String,
    /// Names of the joints that it acts on.
    pub joints: Vec<String>,
    /// Non-linear constants by name (SI units), such as the width of a smoothed sign \[rad/s\].
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub constants: BTreeMap<String, f64>,
}

impl EffectSpec {
    /// An effect without constants.
    pub fn new(kind: &str, joints: &[&str]) -> Self {
        let joints = joints.iter().map(|joint| (*joint).to_owned()).collect();
        EffectSpec { kind: kind.to_owned(), joints, constants: BTreeMap::new() }
    }

    /// The same with a constant set.
    pub fn with(mut self, constant: &str, value: f64) -> Self {
        self.constants.insert(constant.to_owned(), value);
        self
    }
}

/// A parameter that an effect adds to the fit.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectParameter {
    /// The joint that it is reported under.
    pub joint: String,
    /// Its name (`fv`, `fc`, …).
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Physical bounds: a friction is not negative.
    pub bounds: (f64, f64),
}

/// One column of an effect: the numbers of `parameter` in the torque of coordinate `row`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entry {
    /// Velocity coordinate of the tree.
    pub row: usize,
    /// Index into [`Effect::parameters`].
    pub parameter: usize,
}

/// A form over the joints' velocities or accelerations that no motion of a real robot makes negative.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum QuadraticForm {
    /// Σ v_i·D_ij·v_j, what viscous friction takes from the motion \[W\].
    Power,
    /// Σ v_i·J_ij·v_j, twice the kinetic energy of rotors \[J\].
    KineticEnergy,
}

/// What one unit of a parameter adds to the symmetric matrix of a quadratic form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QuadraticTerm {
    /// Index into [`Effect::parameters`].
    pub parameter: usize,
    /// The form.
    pub form: QuadraticForm,
    /// Velocity coordinates of the tree: row and column; the mirrored entry gets the same.
    pub coordinates: [usize; 2],
    /// What one unit adds.
    pub factor: f64,
}

/// The velocity of one joint, or a sum of several joints' that one shaft turns with \[rad/s, m/s\]. A torque
/// on that shaft is one on each of the joints, times its factor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VelocitySum {
    /// Velocity coordinates of the tree, each with its factor, which is not zero.
    pub terms: Vec<(usize, f64)>,
}

impl VelocitySum {
    /// That of one joint.
    pub fn of_joint(joint: usize) -> Self {
        VelocitySum { terms: vec![(joint, 1.0)] }
    }

    /// The joint whose own velocity it is; none for a sum of several.
    pub fn joint(&self) -> Option<usize> {
        match self.terms.as_slice() {
            [(joint, factor)] if *factor == 1.0 => Some(*joint),
            _ => None,
        }
    }

    /// The sum of what each joint has, times its factor.
    pub fn of(&self, joints: &[f64]) -> f64 {
        self.terms.iter().map(|&(joint, factor)| factor * joints[joint]).sum()
    }
}

/// A physical effect beside the rigid body: linear in its parameters, once its constants are fixed.
pub trait Effect: Send + Sync {
    /// What builds the effect again.
    fn spec(&self) -> EffectSpec;
    /// The parameters that it adds.
    fn parameters(&self) -> Vec<EffectParameter>;
    /// Its columns; each (row, parameter) at most once.
    fn entries(&self) -> Vec<Entry>;
    /// What its columns need beside the signals.
    fn needs(&self) -> Needs {
        Needs::default()
    }
    /// Whether the columns of a parameter (an index into [`Effect::parameters`]) are linear in the motion: at
    /// a given position they change with the velocities or the accelerations of the same sample, they are
    /// affine in both, and they depend on nothing else (time, torque, what was before). Viscous friction and
    /// rotor inertia are.
    ///
    /// No is always safe. It costs a little of what noisy logs tell: such a column is then taken of the
    /// motion at the beginning of a control period.
    fn is_linear_in_motion(&self, _parameter: usize) -> bool {
        false
    }
    /// The velocity with which the columns of a parameter (an index into [`Effect::parameters`]) turn, if
    /// they are functions of that of the same sample and of nothing else that changes within a control
    /// period: in the torque of each of its joints the same function, times the joint's factor. Coulomb
    /// friction is one: what it takes of a period in which the joint reverses is its mean on the way from one
    /// velocity to the next.
    ///
    /// None is always safe.
    fn turns_with(&self, _parameter: usize) -> Option<VelocitySum> {
        None
    }
    /// Whether the columns of a sample depend on that sample and earlier ones alone. A rate of change of the
    /// torque depends on later samples too.
    fn is_causal(&self) -> bool {
        true
    }
    /// What its parameters add to quadratic forms that are never negative: friction takes energy in every
    /// motion, also where it is coupled between joints.
    fn quadratic_terms(&self) -> Vec<QuadraticTerm> {
        Vec::new()
    }
    /// A new evaluator of its columns.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;
    /// Corrects the signals before any column is evaluated: how an encoder offset or a delay, fitted by
    /// linearisation, comes into force.
    fn correct(&self, _block: &mut Block) {}
    /// The joint whose link lags behind its encoder, and by how much for each unit of torque \[rad/(N·m),
    /// m/N\]: rigid body and gravity are then evaluated at the link's position, by the reference model's
    /// torque; all other columns at the encoder's.
    fn compliance(&self) -> Option<(usize, f64)> {
        None
    }
    /// The torque that is logged as a multiple of what it is, and the factor: all columns of that torque are
    /// multiplied by it, so that the model says what the log does.
    fn logged_factor(&self) -> Option<(usize, f64)> {
        None
    }
    /// The effect with what was fitted as its [`logged_factor`](Self::logged_factor); `None` where it has
    /// none.
    fn with_logged_factor(&self, _fitted: &[f64]) -> Option<Box<dyn Effect>> {
        None
    }
    /// The effect linearised anew at fitted parameters; `None` where it is linear anyway.
    fn relinearised(&self, _fitted: &[f64]) -> Option<Box<dyn Effect>> {
        None
    }
}

/// Computes an effect's columns sample by sample, in order of time; may have memory.
pub trait Evaluator {
    /// Forgets: what comes next is not the continuation of what was before.
    fn restart(&mut self) {}
    /// Writes one number for each of [`Effect::entries`].
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]);
}

/// A property of a joint by which simulators express an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointProperty {
    /// Torque against the velocity, over it \[N·m·s/rad, N·s/m\]; `damping` of a URDF.
    Damping,
    /// Torque against the direction of motion \[N·m, N\]; `friction` of a URDF.
    Friction,
    /// Inertia that the joint's own motion alone feels \[kg·m², kg\]; a URDF has no place for it.
    Armature,
}

/// Builds effects by name.
pub trait EffectCatalogue: Sync {
    /// Builds an effect.
    ///
    /// # Errors
    /// The kind, a joint or a constant is unknown.
    fn build(&self, spec: &EffectSpec, tree: &Tree) -> Result<Box<dyn Effect>, EffectError>;
    /// The property of a joint that expresses an effect; none if its kind is unknown or has none.
    fn joint_property(&self, _spec: &EffectSpec) -> Option<JointProperty> {
        None
    }
}

/// An effect that cannot be built.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EffectError {
    /// No such kind.
    #[error(
        "there is no effect `{kind}`{}; known are: {}",
        nearest.as_ref().map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default(),
        known.join(", ")
    )]
    UnknownKind {
        /// What was asked for.
        kind: String,
        /// The nearest known kind.
        nearest: Option<String>,
        /// All known kinds.
        known: Vec<String>,
    },
    /// A kind that is only ever found.
    #[error(
        "effect `{kind}` belongs to the training logs and cannot be declared; `phiw explain` seeks it by itself"
    )]
    NotDeclared {
        /// What was asked for.
        kind: String,
    },
    /// No such joint.
    #[error(
        "effect `{kind}` names the joint `{joint}`, which the robot does not have or which does not move{}; \
         moving joints are: {}",
        nearest.as_ref().map(|name| format!(" (did you mean `{name}`?)")).unwrap_or_default(),
        known.join(", ")
    )]
    UnknownJoint {
        /// The effect.
        kind: String,
        /// The joint.
        joint: String,
        /// The nearest joint that moves.
        nearest: Option<String>,
        /// All joints that move.
        known: Vec<String>,
    },
    /// Joints on which the kind cannot act.
    #[error("effect `{kind}` acts on {needed} and cannot act on {}; {}", quoted(joints), possible(sites))]
    CannotActThere {
        /// The effect.
        kind: String,
        /// What it acts on, in words.
        needed: &'static str,
        /// The joints that were named.
        joints: Vec<String>,
        /// Where it can act on this robot.
        sites: Vec<Vec<String>>,
    },
}

/// Names in a message; a robot can have hundreds.
const NAMED: usize = 20;

fn quoted(joints: &[String]) -> String {
    let names: Vec<String> = joints.iter().map(|joint| format!("`{joint}`")).collect();
    if names.is_empty() { "this robot".to_owned() } else { names.join(" and ") }
}

fn possible(sites: &[Vec<String>]) -> String {
    let sites: Vec<String> = sites.iter().map(|joints| joints.join("+")).collect();
    match sites.as_slice() {
        [] => "leave it out: this robot has no joint for it".to_owned(),
        [whole] if whole.is_empty() => "name it without a joint".to_owned(),
        sites if sites.len() > NAMED => {
            format!("it can on {} and {} more", sites[..NAMED].join(", "), sites.len() - NAMED)
        }
        sites => format!("it can on {}", sites.join(", ")),
    }
}
