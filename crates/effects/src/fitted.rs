//! An effect with its fitted values, and its description for a user.

use crate::sign::Sign;
use phiw_codegen::{Expression, JointTorque};
use phiw_identification::EffectSpec;
use phiw_identification::effect::EffectParameter;

/// An effect and the values of its parameters, as its kind's sentence needs them
/// ([`crate::EffectKind::sentence`]).
#[derive(Clone, Copy, Debug)]
pub struct FittedEffect<'a> {
    spec: &'a EffectSpec,
    parameters: &'a [EffectParameter],
    values: &'a [f64],
}

impl<'a> FittedEffect<'a> {
    /// `values` are those of `parameters`, in their order and units.
    pub fn new(spec: &'a EffectSpec, parameters: &'a [EffectParameter], values: &'a [f64]) -> Self {
        FittedEffect { spec, parameters, values }
    }

    /// The name of its kind.
    pub fn kind(&self) -> &'a str {
        &self.spec.kind
    }

    /// Its joints, in words.
    pub fn joints(&self) -> String {
        self.spec.joints.join(" and ")
    }

    /// The names of its joints.
    pub fn joint_names(&self) -> &'a [String] {
        &self.spec.joints
    }

    /// Names and values of its parameters, in their own units.
    pub fn named_values(&self) -> impl Iterator<Item = (&'a str, f64)> {
        self.parameters.iter().zip(self.values).map(|(info, value)| (info.name.as_str(), *value))
    }

    /// Its constants by name, SI units.
    pub fn constants(&self) -> &'a crate::Constants {
        &self.spec.constants
    }

    /// One of its constants (SI units), zero if it has none of that name.
    pub fn constant(&self, name: &str) -> f64 {
        self.spec.constants.get(name).copied().unwrap_or_default()
    }

    /// The values of its parameters, in their order and units.
    pub fn values(&self) -> &'a [f64] {
        self.values
    }

    /// The value of the parameter at `place`, in its own unit; zero if there is none.
    pub fn value(&self, place: usize) -> f64 {
        self.values.get(place).copied().unwrap_or_default()
    }

    /// The unit of the parameter at `place`; nothing if there is none.
    pub fn unit(&self, place: usize) -> &str {
        self.parameters.get(place).map_or("", |info| &info.unit)
    }

    /// The unit of its joint's position, where its first parameter is a torque or a force.
    pub(crate) fn unit_of_position(&self) -> &'static str {
        if self.unit(0) == "N" { "m" } else { "rad" }
    }

    /// The parameter at `place` with its unit; nothing if there is none.
    pub fn quantity(&self, place: usize) -> String {
        self.in_unit_of(place, self.value(place))
    }

    /// A value \[the unit of the parameter at `place`\] with that unit; nothing if there is no such
    /// parameter.
    pub fn in_unit_of(&self, place: usize, value: f64) -> String {
        self.parameters.get(place).map(|info| quantity(value, &info.unit)).unwrap_or_default()
    }

    /// All parameters, each by its name and with its unit.
    pub fn quantities(&self) -> impl Iterator<Item = (&str, String)> {
        let named =
            |(info, value): (&'a EffectParameter, &f64)| (info.name.as_str(), quantity(*value, &info.unit));
        self.parameters.iter().zip(self.values).map(named)
    }

    /// The sign of a joint's velocity, as smooth as the effect's own constant says.
    pub(crate) fn sign_of_velocity(&self, joint: &str) -> Expression {
        Sign::of(&self.spec.constants).of_joint_as_formula(joint)
    }

    /// Its torque at its only joint, of the joint's name; none where it has not one joint.
    pub(crate) fn own_torque(&self, torque: impl Fn(&str) -> Expression) -> Vec<JointTorque> {
        match self.spec.joints.as_slice() {
            [joint] => vec![JointTorque::new(joint, torque(joint))],
            _ => Vec::new(),
        }
    }

    /// The amplitude of two parameters that are a sine and a cosine, with their unit.
    pub(crate) fn amplitude(&self) -> String {
        self.in_unit_of(0, self.value(0).hypot(self.value(1)))
    }

    /// Kind, joints and numbers: the sentence of a kind that has none of its own.
    pub fn plainly(&self) -> String {
        let values: Vec<String> =
            self.quantities().map(|(name, value)| format!("{name} = {value}")).collect();
        format!("{} on {}: {}.", self.spec.kind.replace('_', " "), self.joints(), values.join(", "))
    }
}

/// Three significant digits and the unit.
fn quantity(value: f64, unit: &str) -> String {
    let digits = if value == 0.0 { 0 } else { (2 - value.abs().log10().floor() as i32).clamp(0, 8) };
    format!("{value:.*} {unit}", digits as usize)
}
