//! Friction that grows with the load.

use crate::bristles::{Bristles, DEFLECTION, bristles_near, with_bristles};
use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{
    Constants, EffectKind, Refinement, Signal, SignalRanges, around, constant, product, values,
};
use crate::mechanism::ServoFriction;
use crate::sign::{Sign, WIDTH, few_sign_widths};
use crate::viscous_and_dry::{BOTH, DRY, PART, VISCOUS, ViscousAndDry, of_part};
use phiw_codegen::{Expression, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::{Needs, Sample};

/// |τ of the rigid body|·(μ·sign(q̇) + μ_v·q̇): dry friction of the load, viscous friction of it, or both
/// (Hamon, Gautier, Garrec 2010).
///
/// `part` says which of the two there are; where it is not said, the dry one.
pub struct LoadDependent;

/// Names of the shares.
const DRY_SHARE: &str = "mu";
const VISCOUS_SHARE: &str = "mu_v";

impl EffectKind for LoadDependent {
    fn name(&self) -> &str {
        "load_dependent_friction"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let widths = few_sign_widths(site[0], ranges);
        let few: Vec<Constants> = widths.iter().step_by(2).cloned().collect();
        [widths, values(PART, [VISCOUS]), product(&values(PART, [BOTH]), &few)].concat()
    }
    fn declared_constants(&self) -> Option<Constants> {
        Some(Constants::from([(PART.to_owned(), DRY)]))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        around(found, WIDTH, step).into_iter().chain(bristles_near(found, step)).collect()
    }
    fn turned_over_a_way(&self, found: &Constants, way: Option<f64>) -> Option<Constants> {
        (part_of(found) != VISCOUS).then(|| with_bristles(found, way))
    }
    fn telling_motion(&self) -> &'static str {
        "the same motion with the arm stretched out and folded, or with a load"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        // The viscous share comes first, in s/rad or s/m.
        let unit = found.unit(0).strip_prefix("s/").unwrap_or("rad");
        let share = |(name, value): (&str, f64)| match name {
            VISCOUS_SHARE => format!("{value:.3} for each {unit}/s"),
            _ => format!("{value:.3}"),
        };
        let shares: Vec<String> = found.named_values().map(share).collect();
        let (joint, shares) = (found.joints(), shares.join(" and "));
        format!("The friction of {joint} grows with its load: {shares} of the torque that it carries.")
    }
    fn servo_friction(&self, found: &FittedEffect<'_>) -> Option<ServoFriction> {
        (part_of(found.constants()) == DRY).then(|| ServoFriction::Load { share: found.value(0) })
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let load = |joint: &str| Expression::BodyTorque(joint.to_owned()).magnitude();
        let of_speed = |name: &str, joint: &str| match name {
            VISCOUS_SHARE => Expression::velocity(joint),
            _ => found.sign_of_velocity(joint),
        };
        let share = |(name, value): (&str, f64)| {
            found.own_torque(|joint| value * (load(joint) * of_speed(name, joint)))
        };
        found.named_values().flat_map(share).collect()
    }
    fn seen_against(&self) -> Signal {
        Signal::Torque
    }
    fn dissipates(&self) -> bool {
        true
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, sign) = (site[0], Sign::of(constants));
        let part = part_of(constants);
        let load = move |sample: &Sample<'_>| {
            sample.reference_torque().get(joint).copied().unwrap_or_default().abs()
        };
        let steady = move |sample: &Sample<'_>| load(sample) * sign.of_joint(sample, joint);
        let columns = ViscousAndDry {
            part,
            viscous: move |sample: &Sample<'_>| load(sample) * sample.qd()[joint],
            dry: Bristles { joint, deflection: constant(constants, DEFLECTION, 0.0), steady },
        };
        let both =
            [(VISCOUS_SHARE, ParameterKind::RatioPerVelocity, 0.0), (DRY_SHARE, ParameterKind::Ratio, 0.0)];
        let needs = Needs { torque: true, ..Needs::default() };
        let effect = OwnTorque::new(self.name(), tree, joint, constants, of_part(part, &both), columns);
        Box::new(effect.needing(needs))
    }
}

fn part_of(constants: &Constants) -> f64 {
    constant(constants, PART, DRY)
}
