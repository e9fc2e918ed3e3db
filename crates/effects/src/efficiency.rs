//! Losses of a transmission that depend on the direction of power.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{
    Constants, EffectKind, Refinement, Signal, SignalRanges, SpecialCase, around, constant, product, values,
};
use crate::sign::{Sign, WIDTH, few_sign_widths};
use phiw_codegen::{Expression, Function, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::{Needs, Sample};

/// What a transmission loses of the torque that it carries: one share where it drives its load, another where
/// the load drives it (Hamon, Gautier, Garrec 2010).
///
/// With τ the torque of the rigid body, the motor delivers τ/η where τ·q̇ > 0: (1/η − 1)·|τ|·sign(q̇) more.
/// Where τ·q̇ < 0 it delivers τ·η′: (1 − η′)·|τ|·sign(q̇) more. Of equal shares it is friction of the load.
pub struct DriveEfficiency;

/// Which of the two shares there are.
const PART: &str = "part";
const DRIVING: f64 = 0.0;
const DRIVEN: f64 = 1.0;
const BOTH: f64 = 2.0;

/// Names of the shares.
const LOSS_DRIVING: &str = "loss_driving";
const LOSS_DRIVEN: &str = "loss_driven";

impl EffectKind for DriveEfficiency {
    fn name(&self) -> &str {
        "drive_efficiency"
    }
    fn special_case(&self) -> Option<SpecialCase> {
        Some(SpecialCase { kind: "load_dependent_friction", parameter: None })
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let widths: Vec<Constants> = few_sign_widths(site[0], ranges).into_iter().step_by(2).collect();
        product(&values(PART, [DRIVING, DRIVEN, BOTH]), &widths)
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        around(found, WIDTH, step)
    }
    fn declared_constants(&self) -> Option<Constants> {
        Some(Constants::from([(PART.to_owned(), BOTH)]))
    }
    fn telling_motion(&self) -> &'static str {
        "lifting and lowering a known load at the same speeds"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let share = |(name, loss): (&str, f64)| match name {
            LOSS_DRIVING => format!("{:.2} where it drives its load", 1.0 / (1.0 + loss)),
            _ => format!("{:.2} where its load drives it", 1.0 - loss),
        };
        let shares: Vec<String> = found.named_values().map(share).collect();
        format!("The transmission of {} has an efficiency of {}.", found.joints(), shares.join(" and "))
    }
    fn seen_against(&self) -> Signal {
        Signal::Torque
    }
    fn dissipates(&self) -> bool {
        true
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        // |τ|·sign(q̇) where τ·q̇ has this sign, and zero elsewhere.
        let loss = |joint: &str, side: f64| {
            let power = Expression::BodyTorque(joint.to_owned()) * found.sign_of_velocity(joint);
            Expression::velocity(joint).sign(0.0) * (side * power).of(Function::PositivePart)
        };
        let side = |name: &str| if name == LOSS_DRIVING { 1.0 } else { -1.0 };
        let named = found.named_values();
        named.flat_map(|(name, value)| found.own_torque(|joint| value * loss(joint, side(name)))).collect()
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, sign) = (site[0], Sign::of(constants));
        let part = constant(constants, PART, BOTH);
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            let load = sample.reference_torque().get(joint).copied().unwrap_or_default();
            let velocity = sample.qd()[joint];
            let loss = load.abs() * sign.of_joint(sample, joint);
            let drives = load * velocity > 0.0;
            if part == BOTH {
                (out[0], out[1]) = if drives { (loss, 0.0) } else { (0.0, loss) };
            } else {
                out[0] = if drives == (part == DRIVING) { loss } else { 0.0 };
            }
        };
        let shares = [(LOSS_DRIVING, ParameterKind::Ratio, 0.0), (LOSS_DRIVEN, ParameterKind::Ratio, 0.0)];
        let parameters = if part == BOTH {
            &shares[..]
        } else if part == DRIVING {
            &shares[..1]
        } else {
            &shares[1..]
        };
        let needs = Needs { torque: true, ..Needs::default() };
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, parameters, columns).needing(needs))
    }
}
