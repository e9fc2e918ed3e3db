//! Torques that depend on the position alone: springs, balancers, ripple, end stops.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{
    Constants, EffectKind, Refinement, Signal, SignalRanges, SpecialCase, constant, product, values,
};
use crate::mechanism::{Mechanism, Mechanisms};
use phiw_codegen::{Expression, Function, JointTorque};
use phiw_dynamics::{JointType, Tree};
use phiw_identification::Effect;
use phiw_identification::effect::Sample;

/// k·(q − q0).
pub struct JointSpring;

impl EffectKind for JointSpring {
    fn name(&self) -> &str {
        "joint_spring"
    }
    fn special_case(&self) -> Option<SpecialCase> {
        Some(SpecialCase { kind: "torque_offset", parameter: Some("k_q0") })
    }
    fn telling_motion(&self) -> &'static str {
        "slow motion over the whole range of the joint"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        format!("A spring pulls {} back: {}.", found.joints(), found.quantity(0))
    }
    fn mechanisms(&self, found: &FittedEffect<'_>) -> Mechanisms {
        let (stiffness, torque) = (found.value(0), found.value(1));
        let joint = found.joint_names().first().cloned().unwrap_or_default();
        if stiffness > 0.0 {
            Mechanisms::of(Mechanism::Spring { joint, stiffness, reference: torque / stiffness })
        } else if stiffness == 0.0 {
            // A constant torque is left of it.
            Mechanisms::of(Mechanism::Motor { joint, gain: 1.0, bias: torque })
        } else {
            Mechanisms::default()
        }
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let slack = Expression::Constant(-found.value(1));
        found.own_torque(|joint| found.value(0) * Expression::position(joint) + slack.clone())
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            out[0] = sample.q()[joint];
            out[1] = -1.0;
        };
        let parameters =
            [("k", ParameterKind::Stiffness, 0.0), ("k_q0", ParameterKind::Torque, f64::NEG_INFINITY)];
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns))
    }
}

/// k·sin(q − q0), as k·cos q0·sin q − k·sin q0·cos q, with one or two `harmonics` of it.
///
/// A spring between two levers of lengths a and r, q − q0 between them, makes
/// k·a·r·sin(q − q0)·(1 − l/√(a² + r² − 2·a·r·cos(q − q0))): a sine where its rest length l is nought, and
/// where it is not about −½·k·l·r²/a·sin 2(q − q0) more. The rigid body takes up the sine where the joint
/// carries weight, but not the second harmonic. With a third one it would fit curves of other origin, too.
pub struct GravityBalancer;

impl EffectKind for GravityBalancer {
    fn name(&self) -> &str {
        "gravity_balancer"
    }
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        (0..tree.joint_count())
            .filter(|&joint| tree.joint(joint).joint_type != JointType::Prismatic)
            .map(|joint| vec![joint])
            .collect()
    }
    fn acts_on(&self) -> &'static str {
        "one joint that turns"
    }
    fn scan(&self, _site: &[usize], _ranges: &SignalRanges) -> Vec<Constants> {
        [vec![Constants::new()], values(HARMONICS, [2.0])].concat()
    }
    fn telling_motion(&self) -> &'static str {
        "slow motion over the whole range, in several poses of the joints behind"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, amplitude) = (found.joints(), found.amplitude());
        let sine = format!("{joint} is counterbalanced: up to {amplitude} as a sine of its angle");
        if found.named_values().count() == 2 {
            return format!("{sine}.");
        }
        let second = found.in_unit_of(2, found.value(2).hypot(found.value(3)));
        format!("{sine}, and {second} as a sine of twice it, as by a spring that has a length at rest.")
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        waves(found, 1.0)
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let harmonics = constant(constants, HARMONICS, 1.0).clamp(1.0, 2.0) as usize;
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| sines(sample.q()[joint], harmonics, out);
        let free = |name: &'static str| (name, ParameterKind::Torque, f64::NEG_INFINITY);
        let parameters = ["sine", "cosine", "second_sine", "second_cosine"].map(free);
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters[..2 * harmonics], columns))
    }
}

/// a·sin(N·q) + b·cos(N·q), with `harmonics` of it.
pub struct TorqueRipple;

const FREQUENCY: &str = "periods";
const HARMONICS: &str = "harmonics";

impl EffectKind for TorqueRipple {
    fn name(&self) -> &str {
        "torque_ripple"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let peaks = ranges.ripple_frequencies.get(site[0]).cloned().unwrap_or_default();
        product(&values(FREQUENCY, peaks), &values(HARMONICS, [1.0, 2.0]))
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        // The scan knows N to a hundredth; a phase slip over the range is what decides.
        let Some(&frequency) = found.get(FREQUENCY) else { return Vec::new() };
        let spread = 0.01 * 0.4_f64.powi(step as i32);
        let near = |factor: f64| {
            let mut near = found.clone();
            near.insert(FREQUENCY.to_owned(), frequency * factor);
            near
        };
        vec![near(1.0 - spread), near(1.0 + spread)]
    }
    fn telling_motion(&self) -> &'static str {
        "slow motion at constant speed"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joints, amplitude, frequency) = (found.joints(), found.amplitude(), found.constant(FREQUENCY));
        if found.unit_of_position() == "m" {
            let period = 1e3 * std::f64::consts::TAU / frequency;
            return format!("The force of {joints} ripples by {amplitude}, once in {period:.2} mm.");
        }
        format!("The torque of {joints} ripples by {amplitude}, {frequency:.1} times a turn.")
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        waves(found, constant(found.constants(), FREQUENCY, 1.0))
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let frequency = constant(constants, FREQUENCY, 1.0);
        let harmonics = constant(constants, HARMONICS, 1.0).clamp(1.0, 3.0) as usize;
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            sines(frequency * sample.q()[joint], harmonics, out);
        };
        let free = |name: &'static str| (name, ParameterKind::Torque, f64::NEG_INFINITY);
        let parameters = [free("a1"), free("b1"), free("a2"), free("b2"), free("a3"), free("b3")];
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters[..2 * harmonics], columns))
    }
}

/// Sine and cosine of an angle, of twice it, and so on.
fn sines(angle: f64, harmonics: usize, out: &mut [f64]) {
    for harmonic in 0..harmonics {
        (out[2 * harmonic], out[2 * harmonic + 1]) = ((harmonic + 1) as f64 * angle).sin_cos();
    }
}

/// The torque of sines and cosines of `frequency` times the position and its multiples.
fn waves(found: &FittedEffect<'_>, frequency: f64) -> Vec<JointTorque> {
    let wave = |harmonic: usize, joint: &str| {
        let angle = ((harmonic + 1) as f64 * frequency) * Expression::position(joint);
        let sine = found.value(2 * harmonic) * angle.clone().of(Function::Sine);
        sine + found.value(2 * harmonic + 1) * angle.of(Function::Cosine)
    };
    let harmonics = found.named_values().count() / 2;
    (0..harmonics).flat_map(|harmonic| found.own_torque(|joint| wave(harmonic, joint))).collect()
}

/// A stiff torque that sets in near a limit: k·d^`exponent` at the depth d = q − `stop` beyond it, on the
/// `side` +1 or −1; k is the torque at a depth of one \[rad, m\]. Without the exponent it is that of a
/// spring, 1; rubber stiffens as it is pressed (1.5 for a ball, Hertz 1881).
pub struct EndStop;

const STOP: &str = "stop";
const SIDE: &str = "side";
const EXPONENT: &str = "exponent";
/// Largest exponent that is tried: what stiffens more has no place at which it begins.
const LARGEST_EXPONENT: f64 = 2.5;
/// Where a stop of another exponent may begin, in steps of the stop's own refinement.
const BEGINNINGS: [f64; 7] = [-15.0, -10.0, -5.0, -2.0, 0.0, 2.0, 5.0];

impl EffectKind for EndStop {
    fn name(&self) -> &str {
        "end_stop"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let (lower, upper) = ranges.joints[site[0]].position;
        let shares = [0.01, 0.03, 0.06, 0.1, 0.15, 0.2, 0.3];
        let side = |side: f64, edge: f64| {
            let stops = shares.map(|share| edge - side * share * (upper - lower));
            product(&values(SIDE, [side]), &values(STOP, stops))
        };
        [side(1.0, upper), side(-1.0, lower)].concat()
    }
    fn refine(&self, &Refinement { found, step, site, ranges }: &Refinement<'_>) -> Vec<Constants> {
        let Some(&stop) = found.get(STOP) else { return Vec::new() };
        let exponent = constant(found, EXPONENT, 1.0);
        // A share of the joint's travel, as the scan's are: a slide of 0.1 m knows no steps of 0.02.
        let travel = ranges.joints.get(site[0]).map_or(1.0, |joint| joint.position.1 - joint.position.0);
        let spread = 0.02 * travel * 0.5_f64.powi(step as i32);
        let with = |stop: f64, exponent: f64| {
            let mut near = found.clone();
            near.insert(STOP.to_owned(), stop);
            match exponent > 1.0 {
                true => near.insert(EXPONENT.to_owned(), exponent),
                false => near.remove(EXPONENT),
            };
            near
        };
        let mut near = vec![with(stop - spread, exponent), with(stop + spread, exponent)];
        let factor = 1.5_f64.powf(0.5_f64.powi(step as i32));
        for other in [exponent / factor, exponent * factor].map(|other| other.clamp(1.0, LARGEST_EXPONENT)) {
            if other != exponent {
                near.extend(BEGINNINGS.map(|steps| with(stop + steps * spread, other)));
            }
        }
        near
    }
    fn telling_motion(&self) -> &'static str {
        "slow motion up to the limit and back"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, stiffness) = (found.joints(), found.quantity(0));
        let exponent = constant(found.constants(), EXPONENT, 1.0);
        let stiffens = match exponent > 1.0 {
            true => format!(" at a depth of one, growing with the power {exponent:.2} of the depth"),
            false => String::new(),
        };
        format!("{joint} runs into something stiff at {:.3}: {stiffness}{stiffens}.", found.constant(STOP))
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let (stop, side) = (found.constant(STOP), constant(found.constants(), SIDE, 1.0));
        let beyond = |joint: &str| side * (Expression::position(joint) + Expression::Constant(-stop));
        let exponent = constant(found.constants(), EXPONENT, 1.0);
        found.own_torque(|joint| {
            let depth = beyond(joint).of(Function::PositivePart);
            let depth = if exponent > 1.0 { depth.of(Function::Power(exponent)) } else { depth };
            (found.value(0) * side) * depth
        })
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let (stop, side) = (constant(constants, STOP, 0.0), constant(constants, SIDE, 1.0));
        let exponent = constant(constants, EXPONENT, 1.0);
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            let depth = (side * (sample.q()[joint] - stop)).max(0.0);
            out[0] = side * if exponent == 1.0 { depth } else { depth.powf(exponent) };
        };
        let parameters = [("k", ParameterKind::Stiffness, 0.0)];
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns))
    }
}
