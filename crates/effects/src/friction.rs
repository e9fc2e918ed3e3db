//! Friction that depends on the velocity alone.

use crate::bristles::{Bristles, DEFLECTION, bristles_near, with_bristles};
use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{
    Constants, EffectKind, Refinement, SignalRanges, SpecialCase, around, constant, product, values,
};
use crate::mechanism::ServoFriction;
use crate::sign::{LEAD, POWER, Sign, WIDTH, few_sign_widths, sign_widths, signs_near};
use crate::viscous_and_dry::{BOTH, DRY, PART, VISCOUS as VISCOUS_PART, of_part};
use phiw_codegen::{Expression, Function, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::{JointProperty, QuadraticForm, Sample};

const VISCOUS: &str = "viscous_friction";

/// fv·q̇.
pub struct Viscous;

impl EffectKind for Viscous {
    fn name(&self) -> &str {
        VISCOUS
    }
    fn may_change(&self) -> bool {
        true
    }
    fn telling_motion(&self) -> &'static str {
        "a motion at several constant speeds"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        format!("{} has viscous friction of {}.", found.joints(), found.quantity(0))
    }
    fn joint_property(&self) -> Option<JointProperty> {
        Some(JointProperty::Damping)
    }
    fn dissipates(&self) -> bool {
        true
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| out[0] = sample.qd()[joint];
        let parameters = [("fv", ParameterKind::PerVelocity, 0.0)];
        let effect = OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns);
        Box::new(effect.linear_in_motion().in_form(QuadraticForm::Power))
    }
}

/// fc·sign(q̇), where the sign turns over a speed, or over a way.
pub struct Coulomb;

impl EffectKind for Coulomb {
    fn name(&self) -> &str {
        "coulomb_friction"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        sign_widths(site[0], ranges)
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        signs_near(found, step).into_iter().chain(bristles_near(found, step)).collect()
    }
    fn turned_over_a_way(&self, found: &Constants, way: Option<f64>) -> Option<Constants> {
        Some(with_bristles(found, way))
    }
    fn may_change(&self) -> bool {
        true
    }
    fn telling_motion(&self) -> &'static str {
        "a motion that reverses often, at low and at high speed"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        format!("{} has Coulomb friction of {}.", found.joints(), found.quantity(0))
    }
    fn joint_property(&self) -> Option<JointProperty> {
        Some(JointProperty::Friction)
    }
    fn goes_with(&self) -> &'static [&'static str] {
        &[VISCOUS]
    }
    fn constants_of_the_site(&self) -> &'static [&'static str] {
        &[WIDTH, POWER, LEAD, DEFLECTION]
    }
    fn dissipates(&self) -> bool {
        true
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, sign) = (site[0], Sign::of(constants));
        let steady = move |sample: &Sample<'_>| sign.of_joint(sample, joint);
        let columns = Bristles { joint, deflection: constant(constants, DEFLECTION, 0.0), steady };
        let turns_at_once = sign.lead == 0.0 && columns.deflection == 0.0;
        let parameters = [("fc", ParameterKind::Torque, 0.0)];
        let effect = OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns);
        Box::new(effect.turning_with_velocity(turns_at_once))
    }
}

/// Half the difference between the two directions, of the viscous part, the Coulomb part, or both (`part` 0,
/// 1, 2).
pub struct Asymmetric;

impl EffectKind for Asymmetric {
    fn name(&self) -> &str {
        "asymmetric_friction"
    }
    fn special_case(&self) -> Option<SpecialCase> {
        Some(SpecialCase { kind: "torque_offset", parameter: Some("fc_difference") })
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let widths = few_sign_widths(site[0], ranges);
        let mut variants = values(PART, [VISCOUS_PART]);
        variants.extend(product(&values(PART, [DRY, BOTH]), &widths));
        variants
    }
    fn declared_constants(&self) -> Option<Constants> {
        Some(Constants::from([(PART.to_owned(), BOTH)]))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        around(found, WIDTH, step)
    }
    fn telling_motion(&self) -> &'static str {
        "the same path forth and back at several speeds, with rests"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let halves: Vec<String> = found.quantities().map(|(_, half)| half).collect();
        let (joint, halves) = (found.joints(), halves.join(" and "));
        format!("{joint} rubs differently in its two directions: half the difference is {halves}.")
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let part = |joint: &str, name: &str, value: f64| match name {
            "fv_difference" => value * Expression::velocity(joint).magnitude(),
            _ => value * found.sign_of_velocity(joint).magnitude(),
        };
        let named = found.named_values();
        named.flat_map(|(name, value)| found.own_torque(|joint| part(joint, name, value))).collect()
    }
    fn form_of(&self) -> &'static [&'static str] {
        &["viscous_friction", "coulomb_friction"]
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, sign) = (site[0], Sign::of(constants));
        let viscous = ("fv_difference", ParameterKind::PerVelocity, f64::NEG_INFINITY);
        let coulomb = ("fc_difference", ParameterKind::Torque, f64::NEG_INFINITY);
        let part = constant(constants, PART, BOTH);
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            if part != DRY {
                out[0] = sample.qd()[joint].abs();
            }
            if part != VISCOUS_PART {
                out[out.len() - 1] = sign.of_joint(sample, joint).abs();
            }
        };
        let parameters = [viscous, coulomb];
        let parameters = of_part(part, &parameters);
        let effect = OwnTorque::new(self.name(), tree, joint, constants, parameters, columns);
        Box::new(effect.turning_with_velocity(part == DRY && sign.lead == 0.0))
    }
}

/// f2·q̇·|q̇|.
pub struct Quadratic;

impl EffectKind for Quadratic {
    fn name(&self) -> &str {
        "quadratic_friction"
    }
    fn telling_motion(&self) -> &'static str {
        "a fast motion beside a slow one"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, coefficient) = (found.joints(), found.quantity(0));
        format!("The friction of {joint} bends with the square of the speed: {coefficient}.")
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let velocity = Expression::velocity;
        found.own_torque(|joint| found.value(0) * (velocity(joint) * velocity(joint).magnitude()))
    }
    /// It grows faster than the speed. One that takes from a viscous friction bends that.
    fn is_itself_beside(&self, own: &FittedEffect<'_>, _simpler: &[FittedEffect<'_>]) -> bool {
        own.value(0) > 0.0
    }
    fn form_of(&self) -> &'static [&'static str] {
        &["viscous_friction", "coulomb_friction"]
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            let velocity = sample.qd()[joint];
            out[0] = velocity * velocity.abs();
        };
        let parameters = [("f2", ParameterKind::PerSquaredVelocity, f64::NEG_INFINITY)];
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns))
    }
}

/// fs·exp(−|q̇/vs|^δ)·sign(q̇), on top of Coulomb friction.
pub struct Stribeck;

const STRIBECK_VELOCITY: &str = "stribeck_velocity";
const EXPONENT: &str = "exponent";
/// Speed \[rad/s, m/s\] and exponent where a model says nothing of them.
const STRIBECK_DEFAULTS: (f64, f64) = (0.1, 2.0);

impl EffectKind for Stribeck {
    fn name(&self) -> &str {
        "stribeck_friction"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let speed = ranges.joints[site[0]].velocity_rms;
        let speeds = values(STRIBECK_VELOCITY, (0..5).map(|halvings| speed * 0.5_f64.powi(halvings)));
        let shapes = product(&speeds, &values(EXPONENT, [1.0, 2.0]));
        product(&shapes, &values(WIDTH, [0.02 * speed]))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        let mut near = around(found, STRIBECK_VELOCITY, step);
        near.extend(around(found, WIDTH, step));
        near.extend(around(found, EXPONENT, step));
        near.extend(bristles_near(found, step));
        near
    }
    fn turned_over_a_way(&self, found: &Constants, way: Option<f64>) -> Option<Constants> {
        Some(with_bristles(found, way))
    }
    fn telling_motion(&self) -> &'static str {
        "a slow motion, well below the speed at which friction is lowest"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        format!(
            "{} sticks at low speed: {} on top of Coulomb friction, gone above {:.3} {}/s (Stribeck).",
            found.joints(),
            found.quantity(0),
            found.constant(STRIBECK_VELOCITY),
            found.unit_of_position()
        )
    }
    fn servo_friction(&self, found: &FittedEffect<'_>) -> Option<ServoFriction> {
        Some(ServoFriction::Stribeck {
            torque: found.value(0),
            speed: constant(found.constants(), STRIBECK_VELOCITY, STRIBECK_DEFAULTS.0),
            exponent: constant(found.constants(), EXPONENT, STRIBECK_DEFAULTS.1),
        })
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let speed = constant(found.constants(), STRIBECK_VELOCITY, STRIBECK_DEFAULTS.0);
        let exponent = constant(found.constants(), EXPONENT, STRIBECK_DEFAULTS.1);
        let of = |joint: &str| {
            let power = (speed.recip() * Expression::velocity(joint)).of(Function::Power(exponent));
            found.value(0) * ((-power).of(Function::Exponential) * found.sign_of_velocity(joint))
        };
        found.own_torque(of)
    }
    fn dissipates(&self) -> bool {
        true
    }
    fn is_beyond(&self) -> &'static [&'static str] {
        &["coulomb_friction"]
    }
    /// Friction falls where the speed grows. Where it grows throughout, a viscous friction is bent.
    fn is_itself_beside(&self, own: &FittedEffect<'_>, simpler: &[FittedEffect<'_>]) -> bool {
        let viscous: f64 = simpler
            .iter()
            .filter(|other| other.kind() == "viscous_friction")
            .map(|other| other.value(0))
            .sum();
        let speed = constant(own.constants(), STRIBECK_VELOCITY, STRIBECK_DEFAULTS.0);
        let exponent = constant(own.constants(), EXPONENT, STRIBECK_DEFAULTS.1);
        // Over the speed, where it falls most steeply: at rest if the exponent is no more than 1, and there
        // no steeper than from where the sign has turned.
        let steepest = (1.0 - exponent.recip()).max(0.0).powf(exponent.recip());
        let at = steepest.max(own.constant(WIDTH) / speed);
        let falls_by = own.value(0) / speed * exponent * at.powf(exponent - 1.0) * (-at.powf(exponent)).exp();
        falls_by > viscous
    }
    fn form_of(&self) -> &'static [&'static str] {
        &["viscous_friction", "coulomb_friction"]
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, sign) = (site[0], Sign::of(constants));
        let speed = constant(constants, STRIBECK_VELOCITY, STRIBECK_DEFAULTS.0);
        let exponent = constant(constants, EXPONENT, STRIBECK_DEFAULTS.1);
        let steady = move |sample: &Sample<'_>| {
            let velocity = sample.qd()[joint];
            let relative = (velocity / speed).abs();
            let power = if exponent == 1.0 {
                relative
            } else if exponent == 2.0 {
                relative * relative
            } else {
                relative.powf(exponent)
            };
            // Far above the Stribeck velocity the exponential is below the last digit of one.
            if power > 40.0 { 0.0 } else { (-power).exp() * sign.of_joint(sample, joint) }
        };
        let columns = Bristles { joint, deflection: constant(constants, DEFLECTION, 0.0), steady };
        let turns_at_once = sign.lead == 0.0 && columns.deflection == 0.0;
        let parameters = [("fs", ParameterKind::Torque, 0.0)];
        let effect = OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns);
        Box::new(effect.turning_with_velocity(turns_at_once))
    }
}
