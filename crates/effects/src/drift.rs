//! Friction that changes with time or temperature.

use crate::bristles::{Bristles, DEFLECTION, bristles_near, with_bristles};
use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{
    Constants, EffectKind, Refinement, Signal, SignalRanges, SpecialCase, around, constant, product, values,
};
use crate::sign::Sign;
use crate::viscous_and_dry::{BOTH, DRY, PART, VISCOUS, ViscousAndDry, of_part};
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::Sample;

/// Viscous and Coulomb friction times a factor that falls from one to zero: exp(−t / `time_constant`), or
/// with the temperature where the log has one (`time_constant` zero).
///
/// t counts from `cold_at`, a time of the session, whose logs were recorded one after the other; it is no
/// less than zero. Where `from_log_start` is one it counts from the start of each log: the robot was cold
/// again before each. `part` says which of the two frictions it is that falls, or both.
pub struct ThermalDrift;

const TIME_CONSTANT: &str = "time_constant";
const COLD_AT: &str = "cold_at";
const FROM_LOG_START: &str = "from_log_start";
/// Shortest time constant, in longest logs: what is over sooner is how a log begins, and no warming.
const SHORTEST: f64 = 0.2;
/// Longest time constant that a refined one may have, in sessions or logs: an exponential falls by 28 % in
/// one then.
const LONGEST: f64 = 3.0;
/// Time constants to try, as shares of the session, or of the longest log.
const SHARES: [f64; 4] = [1.0, 0.5, 0.25, 0.125];
/// Temperatures enter over this span \[K\], so that the parameters are torques at a change that is usual.
const TEMPERATURE_SPAN: f64 = 10.0;
const ROOM_TEMPERATURE: f64 = 20.0;

impl EffectKind for ThermalDrift {
    fn name(&self) -> &str {
        "thermal_drift"
    }
    fn scan(&self, _site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        // Stamps may count from anywhere; long before the session all would be warm.
        let of_session = product(
            &values(TIME_CONSTANT, SHARES.map(|share| share * session(ranges))),
            &values(COLD_AT, [ranges.session.0]),
        );
        let of_logs = product(
            &values(TIME_CONSTANT, SHARES.map(|share| share * ranges.longest_log)),
            &values(FROM_LOG_START, [1.0]),
        );
        let mut variants = of_session;
        // A single log is the session.
        if ranges.logs > 1 {
            variants.extend(of_logs);
        }
        if ranges.temperature {
            variants.extend(values(TIME_CONSTANT, [0.0]));
        }
        variants.retain(|constants| constants[TIME_CONSTANT] == 0.0 || is_warming(constants, ranges));
        product(&values(PART, [VISCOUS, DRY, BOTH]), &variants)
    }
    fn declared_constants(&self) -> Option<Constants> {
        Some(Constants::from([(PART.to_owned(), BOTH)]))
    }
    fn refine(&self, &Refinement { found, step, ranges, .. }: &Refinement<'_>) -> Vec<Constants> {
        let mut near = around(found, TIME_CONSTANT, step);
        // Over many times the session it is no drift any more but a friction that stays.
        let of_log = counts_from_log_start(found);
        let longest = LONGEST * if of_log { ranges.longest_log } else { session(ranges) };
        near.retain(|constants| constants[TIME_CONSTANT] <= longest && is_warming(constants, ranges));
        near.extend(bristles_near(found, step));
        near
    }
    fn alike_within_one_log(&self, found: &Constants, ranges: &SignalRanges) -> Option<Constants> {
        if constant(found, TIME_CONSTANT, 0.0) == 0.0 {
            return None;
        }
        let mut other = found.clone();
        if other.remove(FROM_LOG_START).is_some() {
            other.insert(COLD_AT.to_owned(), ranges.session.0);
        } else {
            other.remove(COLD_AT);
            other.insert(FROM_LOG_START.to_owned(), 1.0);
        }
        Some(other)
    }
    fn turned_over_a_way(&self, found: &Constants, way: Option<f64>) -> Option<Constants> {
        Some(with_bristles(found, way))
    }
    fn telling_motion(&self) -> &'static str {
        "the same motion cold and warm"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, time) = (found.joints(), found.constant(TIME_CONSTANT));
        let from = if found.constant(FROM_LOG_START) == 1.0 { " from the start of each log" } else { "" };
        format!("The friction of {joint} falls as it warms up, over {time:.0} s{from}.")
    }
    /// Over many times the session it is a friction that stays.
    fn special_case(&self) -> Option<SpecialCase> {
        Some(SpecialCase { kind: "viscous_friction", parameter: Some("fv_cold") })
    }
    fn seen_against(&self) -> Signal {
        Signal::Time
    }
    fn needs_session_time(&self, constants: &Constants) -> bool {
        !counts_from_log_start(constants)
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let time_constant = constant(constants, TIME_CONSTANT, 60.0);
        let sign = Sign::of(constants);
        let of_log = counts_from_log_start(constants);
        let cold_at = constant(constants, COLD_AT, 0.0);
        let falling = move |sample: &Sample<'_>| {
            if time_constant > 0.0 {
                let time = if of_log { sample.time_in_log() } else { sample.time() - cold_at };
                return (-time.max(0.0) / time_constant).exp();
            }
            let temperature = sample.temperature().get(joint).copied().unwrap_or(f64::NAN);
            let cold = (ROOM_TEMPERATURE - temperature) / TEMPERATURE_SPAN;
            if cold.is_finite() { cold } else { 0.0 }
        };
        let steady = move |sample: &Sample<'_>| falling(sample) * sign.of_joint(sample, joint);
        let dry = Bristles { joint, deflection: constant(constants, DEFLECTION, 0.0), steady };
        let viscous = move |sample: &Sample<'_>| falling(sample) * sample.qd()[joint];
        let part = constant(constants, PART, BOTH);
        let columns = ViscousAndDry { part, viscous, dry };
        let both = [("fv_cold", ParameterKind::PerVelocity, 0.0), ("fc_cold", ParameterKind::Torque, 0.0)];
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, of_part(part, &both), columns))
    }
}

/// How long the session is \[s\].
fn session(ranges: &SignalRanges) -> f64 {
    ranges.session.1 - ranges.session.0
}

/// Whether it takes longer than the beginning of a log.
fn is_warming(constants: &Constants, ranges: &SignalRanges) -> bool {
    constant(constants, TIME_CONSTANT, 0.0) >= SHORTEST * ranges.longest_log
}

fn counts_from_log_start(constants: &Constants) -> bool {
    constant(constants, FROM_LOG_START, 0.0) == 1.0
}

#[cfg(test)]
mod tests {
    use super::ThermalDrift;
    use crate::kind::{EffectKind, Refinement, SignalRanges};
    use phiw_identification::EffectSpec;

    /// A drift over 0.27 s was refined from one over 1.25 s: the first moments of a log of ten seconds.
    /// Drifts over 1 to 2.5 s from the start of each log of twenty were named on five joints of a robot.
    #[test]
    fn a_drift_is_not_refined_to_the_first_moments_of_a_log() {
        let found = EffectSpec::new("thermal_drift", &["elbow"]).with("time_constant", 2.5).constants;
        let ranges = SignalRanges { session: (0.0, 10.0), longest_log: 10.0, ..SignalRanges::default() };
        for step in 0..6 {
            let near = ThermalDrift.refine(&Refinement { found: &found, site: &[0], ranges: &ranges, step });
            assert!(!near.is_empty() && near.iter().all(|near| near["time_constant"] >= 2.0), "{near:?}");
        }
    }

    /// Logs of 20 s had a viscous friction that was called a drift over 7000 s.
    #[test]
    fn a_drift_is_not_refined_to_a_friction_that_stays() {
        let mut found = EffectSpec::new("thermal_drift", &["elbow"]).with("time_constant", 80.0).constants;
        let ranges = SignalRanges { session: (0.0, 80.0), ..SignalRanges::default() };
        for step in [0; 20] {
            let near = ThermalDrift.refine(&Refinement { found: &found, site: &[0], ranges: &ranges, step });
            let longest = near.into_iter().max_by(|a, b| a["time_constant"].total_cmp(&b["time_constant"]));
            found = longest.unwrap();
        }
        assert!((150.0..=240.0).contains(&found["time_constant"]), "{found:?}");
    }
}
