//! A torque that depends on the position in no simple form: a cable, a hose, cogging of unknown period.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Refinement, Signal, SignalRanges, constant};
use crate::trigonometric_spline::TrigonometricSpline;
use phiw_dynamics::{JointType, Tree};
use phiw_identification::Effect;
use phiw_identification::effect::Sample;
use std::f64::consts::TAU;

/// A smooth curve through a few knots over the arc that the training logs show, around the whole turn where
/// they show all of it. Its parameters are the torques at the knots.
///
/// Between two knots it is a constant, a slope, and a sine and a cosine of the position
/// ([`TrigonometricSpline`]), so what an offset, a spring, a balancer's first sine or gravity adds is in it
/// exactly and never twice in a model. Beyond the arc the torque at its end goes on.
pub struct PositionMap;

/// Number of knots.
const KNOTS: &str = "knots";
/// Ends of the arc \[rad, m\]: the first and the last knot, or a whole turn.
const LOWER: &str = "lower";
const UPPER: &str = "upper";
/// Number of knots that a map is sought with: few enough to be cheap for every joint.
const SCANNED: f64 = 9.0;
/// Number of knots of a declared map.
const DECLARED: f64 = 12.0;
/// Numbers between which the data choose, once a map was found.
const FEWEST: usize = 6;
const MOST: usize = 24;
/// By which factor the number of knots goes from the one found, step by step; by one at least.
const FACTORS: [f64; 3] = [1.5, 1.2, 1.1];
/// An arc that is shorter counts as this long \[rad, m\]: no torque changes over it.
const SHORTEST_ARC: f64 = 1e-3;
/// Points at which the size of a map is taken.
const POINTS: usize = 200;

/// Names of the torques at the knots, in the order of the position.
const NAMES: [&str; MOST] = [
    "knot_1", "knot_2", "knot_3", "knot_4", "knot_5", "knot_6", "knot_7", "knot_8", "knot_9", "knot_10",
    "knot_11", "knot_12", "knot_13", "knot_14", "knot_15", "knot_16", "knot_17", "knot_18", "knot_19",
    "knot_20", "knot_21", "knot_22", "knot_23", "knot_24",
];

impl EffectKind for PositionMap {
    fn name(&self) -> &str {
        "position_map"
    }
    fn scan(&self, site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let (lower, upper) = ranges.joints[site[0]].position;
        let ends = [(LOWER.to_owned(), lower), (UPPER.to_owned(), upper.max(lower + SHORTEST_ARC))];
        let with = |knots: f64| ends.into_iter().chain([(KNOTS.to_owned(), knots)]).collect();
        vec![with(SCANNED)]
    }
    fn refine(&self, &Refinement { found, step, .. }: &Refinement<'_>) -> Vec<Constants> {
        let (Some(&knots), Some(factor)) = (found.get(KNOTS), FACTORS.get(step)) else { return Vec::new() };
        let near = [(knots / factor).floor(), (knots * factor).ceil()].into_iter();
        let near = near.map(|knots| knots.clamp(FEWEST as f64, MOST as f64)).filter(|near| *near != knots);
        near.map(|knots| found.clone().into_iter().chain([(KNOTS.to_owned(), knots)]).collect()).collect()
    }
    fn declared_constants(&self) -> Option<Constants> {
        Some(Constants::from([(KNOTS.to_owned(), DECLARED)]))
    }
    fn telling_motion(&self) -> &'static str {
        "slow motion over the whole range of the joint, several times and in both directions"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (lower, upper) = (found.constant(LOWER), found.constant(UPPER));
        let size = found.in_unit_of(0, variation(found));
        format!(
            "The torque of {} depends on its position in no simple form (a cable, a hose, cogging): it varies by {size} RMS from {lower:.3} to {upper:.3} {}.",
            found.joints(),
            found.unit_of_position(),
        )
    }
    fn seen_against(&self) -> Signal {
        Signal::Position
    }
    fn is_general_form(&self) -> bool {
        true
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let turns = tree.joint(joint).joint_type != JointType::Prismatic;
        let spline = spline(constants, turns);
        let order = order(spline.knots());
        let columns = {
            let order = order.clone();
            move |sample: &Sample<'_>, out: &mut [f64]| {
                let at = spline.weights(sample.q()[joint]);
                out.iter_mut().zip(&order).for_each(|(column, &knot)| *column = at.of(knot));
            }
        };
        let parameters: Vec<(&str, ParameterKind, f64)> =
            order.iter().map(|&knot| (NAMES[knot], ParameterKind::Torque, f64::NEG_INFINITY)).collect();
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, &parameters, columns))
    }
}

/// The curve of these constants.
fn spline(constants: &Constants, turns: bool) -> TrigonometricSpline {
    let knots = (constant(constants, KNOTS, SCANNED) as usize).clamp(FEWEST, MOST);
    let lower = constant(constants, LOWER, -1.0);
    let length = (constant(constants, UPPER, 1.0) - lower).max(SHORTEST_ARC);
    if turns && length >= TAU {
        TrigonometricSpline::around(lower, knots)
    } else {
        TrigonometricSpline::over(lower, length, knots)
    }
}

/// The knots in the order of their parameters: the inner ones, then both ends.
///
/// Where the rigid body has a sine and a cosine of the position already, two of the map's torques say nothing
/// and are zero: the last ones. Ends that are zero leave the rest as small as the map is.
fn order(knots: usize) -> Vec<usize> {
    (1..knots - 1).chain([0, knots - 1]).collect()
}

/// RMS of a fitted map about its mean over its arc \[its parameters' unit\].
fn variation(found: &FittedEffect<'_>) -> f64 {
    let constants = [KNOTS, LOWER, UPPER].map(|name| (name.to_owned(), found.constant(name)));
    let spline = spline(&constants.into(), found.unit_of_position() == "rad");
    let order = order(spline.knots());
    let at = |point: usize| {
        let place = (point as f64 + 0.5) / POINTS as f64;
        let weights = spline.weights(spline.lower() + place * spline.length());
        order.iter().enumerate().map(|(parameter, &knot)| weights.of(knot) * found.value(parameter)).sum()
    };
    let torques: Vec<f64> = (0..POINTS).map(at).collect();
    let mean = torques.iter().sum::<f64>() / POINTS as f64;
    (torques.iter().map(|torque| (torque - mean).powi(2)).sum::<f64>() / POINTS as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_identification::EffectSpec;
    use phiw_identification::effect::EffectParameter;

    #[test]
    fn the_variation_of_a_sine_is_its_amplitude_over_the_root_of_two() {
        let spec = EffectSpec::new("position_map", &["pivot"])
            .with(KNOTS, 9.0)
            .with(LOWER, 0.5)
            .with(UPPER, 0.5 + TAU);
        let parameter = |&knot: &usize| EffectParameter {
            joint: "pivot".to_owned(),
            name: NAMES[knot].to_owned(),
            unit: "N·m".to_owned(),
            bounds: (f64::NEG_INFINITY, f64::INFINITY),
        };
        let order = order(9);
        let parameters: Vec<EffectParameter> = order.iter().map(parameter).collect();
        let torque = |&knot: &usize| 7.0 + 2.0 * (0.5 + TAU * knot as f64 / 9.0).sin();
        let values: Vec<f64> = order.iter().map(torque).collect();
        let found = FittedEffect::new(&spec, &parameters, &values);
        assert!((variation(&found) - 2.0_f64.sqrt()).abs() < 1e-9, "{}", variation(&found));
    }
}
