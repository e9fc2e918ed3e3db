//! Dry friction that depends on where the joint is: a bent shaft, a gear that runs out, a tight spot.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{
    Constants, EffectKind, Refinement, Signal, SignalRanges, around, constant, product, values,
};
use crate::sign::{Sign, WIDTH, few_sign_widths};
use phiw_codegen::{Expression, Function, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::Sample;
use std::f64::consts::{PI, TAU};

/// f·((1 + cos(N·(q − q₁)))/2)ᵖ·sign(q̇): on top of Coulomb friction, f at q₁ and nothing half a wave away.
///
/// With f ≥ 0 and p = 1 beside a Coulomb friction it is every friction that is a wave of the position and
/// never drives; the larger p, the narrower the spots at which it is high. Gears' frictions vary so with the
/// angle of their parts (Armstrong 1988, on the PUMA 560).
pub struct FrictionOverPosition;

/// N \[1/rad, 1/m\].
const FREQUENCY: &str = "periods";
/// q₁ \[rad, m\].
const HIGHEST: &str = "highest_at";
/// p; 1 where nothing is said of it.
const SHARPNESS: &str = "sharpness";
/// The largest p that is tried: a spot that is an eighth of the wave wide.
const SHARPEST: f64 = 16.0;
/// Half waves over the joint's travel that are tried at first, from one up to these: beside the residual's
/// frequencies, and where it has none.
const HALF_WAVES_BESIDE_PEAKS: u32 = 2;
const HALF_WAVES: u32 = 12;
/// Frequencies of the residual that are tried.
const PEAKS: usize = 2;
/// Places of the highest friction that are tried at first, in waves from the middle of the travel.
const PLACES: [f64; 4] = [0.0, 0.25, 0.5, 0.75];
/// A travel that is shorter counts as this long \[rad, m\].
const SHORTEST_TRAVEL: f64 = 1e-3;

impl EffectKind for FrictionOverPosition {
    fn name(&self) -> &str {
        "position_dependent_friction"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let (lower, upper) = ranges.joints[site[0]].position;
        let peaks = ranges.friction_frequencies.get(site[0]).into_iter().flatten().copied().take(PEAKS);
        let of_frequency = |frequency: f64| {
            let places = PLACES.map(|place| 0.5 * (lower + upper) + place * TAU / frequency);
            product(&values(FREQUENCY, [frequency]), &values(HIGHEST, places))
        };
        let peaks: Vec<f64> = peaks.collect();
        let most = if peaks.is_empty() { HALF_WAVES } else { HALF_WAVES_BESIDE_PEAKS };
        let long = (1..=most).map(|half_waves| f64::from(half_waves) * PI / travel(ranges, site[0]));
        let waves: Vec<Constants> = long.chain(peaks).flat_map(of_frequency).collect();
        let widths: Vec<Constants> = few_sign_widths(site[0], ranges).into_iter().skip(1).take(1).collect();
        if widths.is_empty() { product(&waves, &values(WIDTH, [0.0])) } else { product(&waves, &widths) }
    }
    fn refine(&self, &Refinement { found, step, site, ranges }: &Refinement<'_>) -> Vec<Constants> {
        let Some(frequency) = found.get(FREQUENCY).copied().filter(|frequency| *frequency > 0.0) else {
            return Vec::new();
        };
        let highest = constant(found, HIGHEST, 0.0);
        let share = 0.5_f64.powi(step as i32);
        // A wave over the travel more or less is another friction.
        let slip = (0.5 * share * PI / travel(ranges, site[0])).min(0.3 * frequency);
        let shift = 0.125 * share * TAU / frequency;
        let with = |name: &str, value: f64| product(std::slice::from_ref(found), &values(name, [value]));
        let near = [
            with(FREQUENCY, frequency - slip),
            with(FREQUENCY, frequency + slip),
            with(HIGHEST, highest - shift),
            with(HIGHEST, highest + shift),
        ];
        let sharpness = constant(found, SHARPNESS, 1.0);
        let factor = 1.0 + share;
        let spots = [sharpness / factor, sharpness * factor].map(|other| other.clamp(1.0, SHARPEST));
        let spots = spots.into_iter().filter(|other| *other != sharpness);
        let spots = spots.flat_map(|sharpness| with(SHARPNESS, sharpness));
        near.into_iter().flatten().chain(spots).chain(around(found, WIDTH, step)).collect()
    }
    fn telling_motion(&self) -> &'static str {
        "slow motion over the whole range, forth and back"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let frequency = constant(found.constants(), FREQUENCY, 1.0);
        let wave = match found.unit_of_position() {
            "m" => format!("once in {:.2} mm", 1e3 * TAU / frequency),
            _ => format!("{frequency:.2} times a turn"),
        };
        format!(
            "The dry friction of {} depends on its position: {} more at {:.3} {} than where it is lowest, {wave}.",
            found.joints(),
            found.quantity(0),
            found.constant(HIGHEST),
            found.unit_of_position(),
        )
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let frequency = constant(found.constants(), FREQUENCY, 1.0);
        let highest = Expression::Constant(-found.constant(HIGHEST));
        let sharpness = constant(found.constants(), SHARPNESS, 1.0);
        found.own_torque(|joint| {
            let angle = frequency * (Expression::position(joint) + highest.clone());
            let wave = 0.5 * (Expression::Constant(1.0) + angle.of(Function::Cosine));
            let wave = if sharpness == 1.0 { wave } else { wave.of(Function::Power(sharpness)) };
            found.value(0) * (wave * found.sign_of_velocity(joint))
        })
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn dissipates(&self) -> bool {
        true
    }
    fn varies(&self) -> Option<&'static str> {
        Some("coulomb_friction")
    }
    fn form_of(&self) -> &'static [&'static str] {
        &["viscous_friction", "coulomb_friction"]
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let (joint, sign) = (site[0], Sign::of(constants));
        let (frequency, highest) = (constant(constants, FREQUENCY, 1.0), constant(constants, HIGHEST, 0.0));
        let sharpness = constant(constants, SHARPNESS, 1.0);
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            let wave = 0.5 + 0.5 * (frequency * (sample.q()[joint] - highest)).cos();
            let wave = if sharpness == 1.0 { wave } else { wave.powf(sharpness) };
            out[0] = wave * sign.of_joint(sample, joint);
        };
        let parameters = [("fc_variation", ParameterKind::Torque, 0.0)];
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns))
    }
}

/// How far the joint moves \[rad, m\].
fn travel(ranges: &SignalRanges, joint: usize) -> f64 {
    ranges.joints.get(joint).map_or(1.0, |joint| joint.position.1 - joint.position.0).max(SHORTEST_TRAVEL)
}
