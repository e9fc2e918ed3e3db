//! Most effects are a formula for some columns in one joint's own torque.

use crate::Constants;
use phiw_dynamics::{JointType, Tree};
use phiw_identification::effect::{
    EffectParameter, Entry, Evaluator, Needs, QuadraticForm, QuadraticTerm, Sample, VelocitySum,
};
use phiw_identification::{Effect, EffectSpec};

/// The dimension of a parameter over the joint's torque or force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParameterKind {
    /// Torque \[N·m, N\].
    Torque,
    /// Torque over velocity \[N·m·s/rad, N·s/m\].
    PerVelocity,
    /// Torque over squared velocity \[N·m·s²/rad², N·s²/m²\].
    PerSquaredVelocity,
    /// Inertia \[kg·m², kg\].
    Inertia,
    /// Stiffness \[N·m/rad, N/m\].
    Stiffness,
    /// Without dimension.
    Ratio,
    /// One over velocity \[s/rad, s/m\].
    RatioPerVelocity,
}

impl ParameterKind {
    /// The unit on a joint of `tree`.
    pub fn unit(self, tree: &Tree, joint: usize) -> &'static str {
        let prismatic = tree.joint(joint).joint_type == JointType::Prismatic;
        match (self, prismatic) {
            (Self::Torque, false) => "N·m",
            (Self::Torque, true) => "N",
            (Self::PerVelocity, false) => "N·m·s/rad",
            (Self::PerVelocity, true) => "N·s/m",
            (Self::PerSquaredVelocity, false) => "N·m·s²/rad²",
            (Self::PerSquaredVelocity, true) => "N·s²/m²",
            (Self::Inertia, false) => "kg·m²",
            (Self::Inertia, true) => "kg",
            (Self::Stiffness, false) => "N·m/rad",
            (Self::Stiffness, true) => "N/m",
            (Self::Ratio, _) => "1",
            (Self::RatioPerVelocity, false) => "s/rad",
            (Self::RatioPerVelocity, true) => "s/m",
        }
    }
}

/// Columns computed from a sample, perhaps with memory.
pub trait Formula: Send + Sync {
    /// Its memory.
    type Memory: Default;
    /// Writes the columns of one sample.
    fn columns(&self, memory: &mut Self::Memory, sample: &Sample<'_>, columns: &mut [f64]);
}

/// A formula without memory.
impl<F: Fn(&Sample<'_>, &mut [f64]) + Send + Sync> Formula for F {
    type Memory = ();
    fn columns(&self, (): &mut (), sample: &Sample<'_>, columns: &mut [f64]) {
        self(sample, columns);
    }
}

/// An effect in one joint's own torque.
pub struct OwnTorque<F> {
    spec: EffectSpec,
    joint: usize,
    parameters: Vec<EffectParameter>,
    needs: Needs,
    linear_in_motion: bool,
    turns_with_velocity: bool,
    quadratic: Option<QuadraticForm>,
    formula: F,
}

impl<F: Formula> OwnTorque<F> {
    /// The effect `kind` on `joint`; `parameters` are name, dimension and lower bound of each column.
    pub fn new(
        kind: &str,
        tree: &Tree,
        joint: usize,
        constants: &Constants,
        parameters: &[(&str, ParameterKind, f64)],
        formula: F,
    ) -> Self {
        let name = tree.joint(joint).joint.clone();
        let describe = |&(parameter, dimension, lower): &(&str, ParameterKind, f64)| EffectParameter {
            joint: name.clone(),
            name: parameter.to_owned(),
            unit: dimension.unit(tree, joint).to_owned(),
            bounds: (lower, f64::INFINITY),
        };
        OwnTorque {
            parameters: parameters.iter().map(describe).collect(),
            spec: EffectSpec {
                kind: kind.to_owned(),
                joints: vec![name.clone()],
                constants: constants.clone(),
            },
            joint,
            needs: Needs::default(),
            linear_in_motion: false,
            turns_with_velocity: false,
            quadratic: None,
            formula,
        }
    }

    /// The same with what its columns need beside the signals.
    pub fn needing(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }

    /// The same with parameters that are `highest` at most.
    pub fn at_most(mut self, highest: f64) -> Self {
        self.parameters.iter_mut().for_each(|parameter| parameter.bounds.1 = highest);
        self
    }

    /// The same with a first parameter that is the joint's entry of a quadratic form.
    pub fn in_form(mut self, form: QuadraticForm) -> Self {
        self.quadratic = Some(form);
        self
    }

    /// The same with columns that turn with the joint's velocity and with nothing else
    /// ([`Effect::turns_with`]), if `they_do`.
    pub fn turning_with_velocity(mut self, they_do: bool) -> Self {
        self.turns_with_velocity = they_do;
        self
    }

    /// The same with columns that are all linear in the motion ([`Effect::is_linear_in_motion`]).
    pub fn linear_in_motion(mut self) -> Self {
        self.linear_in_motion = true;
        self
    }
}

impl<F: Formula> Effect for OwnTorque<F> {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        self.parameters.clone()
    }
    fn entries(&self) -> Vec<Entry> {
        (0..self.parameters.len()).map(|parameter| Entry { row: self.joint, parameter }).collect()
    }
    fn needs(&self) -> Needs {
        self.needs
    }
    fn is_linear_in_motion(&self, _parameter: usize) -> bool {
        self.linear_in_motion
    }
    fn turns_with(&self, _parameter: usize) -> Option<VelocitySum> {
        self.turns_with_velocity.then(|| VelocitySum::of_joint(self.joint))
    }
    fn quadratic_terms(&self) -> Vec<QuadraticTerm> {
        let coordinates = [self.joint; 2];
        let term = |form| QuadraticTerm { parameter: 0, form, coordinates, factor: 1.0 };
        self.quadratic.map(term).into_iter().collect()
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(FormulaEvaluator { formula: &self.formula, memory: F::Memory::default() })
    }
}

/// Runs a formula with its memory.
pub(crate) struct FormulaEvaluator<'a, F: Formula> {
    pub formula: &'a F,
    pub memory: F::Memory,
}

impl<F: Formula> Evaluator for FormulaEvaluator<'_, F> {
    fn restart(&mut self) {
        self.memory = F::Memory::default();
    }
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        self.formula.columns(&mut self.memory, sample, columns);
    }
}
