//! Friction that changes with time or temperature.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal, SignalRanges, around, constant, product, values};
use crate::sign::Sign;
use phiw_dynamics::Tree;
use phiw_identification::Effect;
use phiw_identification::effect::Sample;

/// Viscous friction, Coulomb friction or both (`part` 0, 1, 2) times a factor that falls from one to zero:
/// exp(−t / `time_constant`), or with the temperature where the log has one (`time_constant` zero). Neither
/// is negative: friction that grows as the joint warms up is something else.
pub struct ThermalDrift;

const TIME_CONSTANT: &str = "time_constant";
/// Shortest time in which a drive's grease warms up \[s\]: what falls sooner is a transient of something else.
const SHORTEST_S: f64 = 5.0;
const PART: &str = "part";
const VISCOUS: f64 = 0.0;
const COULOMB: f64 = 1.0;
const BOTH: f64 = 2.0;
/// Temperatures enter over this span \[K\], so that the parameters are torques at a change that is usual.
const TEMPERATURE_SPAN: f64 = 10.0;
const ROOM_TEMPERATURE: f64 = 20.0;

impl EffectKind for ThermalDrift {
    fn name(&self) -> &str {
        "thermal_drift"
    }
    fn scan(&self, _site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        let duration = ranges.session.1 - ranges.session.0;
        let times = [1.0, 0.5, 0.25, 0.125].map(|share| share * duration);
        let mut variants =
            values(TIME_CONSTANT, times.into_iter().filter(|time| *time >= SHORTEST_S || *time == duration));
        if ranges.temperature {
            variants.extend(values(TIME_CONSTANT, [0.0]));
        }
        product(&values(PART, [VISCOUS, COULOMB, BOTH]), &variants)
    }
    fn declared_constants(&self) -> Option<Constants> {
        Some(Constants::from([(PART.to_owned(), BOTH)]))
    }
    fn refine(&self, found: &Constants, step: usize) -> Vec<Constants> {
        let mut near = around(found, TIME_CONSTANT, step);
        near.retain(|constants| constants.get(TIME_CONSTANT).is_some_and(|time| *time >= SHORTEST_S));
        near
    }
    fn telling_motion(&self) -> &'static str {
        "the same motion cold and warm"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joint, time) = (found.joints(), found.constant(TIME_CONSTANT));
        format!("The friction of {joint} falls as it warms up, over {time:.0} s.")
    }
    fn seen_against(&self) -> Signal {
        Signal::Time
    }
    fn needs_session_time(&self) -> bool {
        true
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let time_constant = constant(constants, TIME_CONSTANT, 60.0);
        let sign = Sign::of(constants);
        let part = constant(constants, PART, BOTH);
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            let factor = if time_constant > 0.0 {
                (-sample.time() / time_constant).exp()
            } else {
                let temperature = sample.temperature().get(joint).copied().unwrap_or(f64::NAN);
                if temperature.is_finite() {
                    (ROOM_TEMPERATURE - temperature) / TEMPERATURE_SPAN
                } else {
                    0.0
                }
            };
            let velocity = sample.qd()[joint];
            let both = [factor * velocity, factor * sign.at(velocity)];
            let of_part = if part == COULOMB { &both[1..] } else { &both[..out.len()] };
            out.copy_from_slice(of_part);
        };
        let both = [("fv_cold", ParameterKind::PerVelocity, 0.0), ("fc_cold", ParameterKind::Torque, 0.0)];
        let parameters = match part {
            VISCOUS => &both[..1],
            COULOMB => &both[1..],
            _ => &both[..],
        };
        Box::new(OwnTorque::new(self.name(), tree, joint, constants, parameters, columns))
    }
}

#[cfg(test)]
mod tests {
    use super::{PART, ThermalDrift};
    use crate::kind::{Constants, EffectKind};
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};

    /// "Falls as it warms up" was said of friction that grew, with a negative excess when cold.
    #[test]
    fn friction_that_falls_as_it_warms_up_is_never_less_when_cold() {
        let tree = random_tree(3, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
        for (part, names) in [(0.0, &["fv_cold"][..]), (1.0, &["fc_cold"]), (2.0, &["fv_cold", "fc_cold"])] {
            let constants = Constants::from([(PART.to_owned(), part)]);
            let parameters = ThermalDrift.build(&tree, &[1], &constants).parameters().to_vec();
            assert!(parameters.iter().map(|parameter| parameter.name.as_str()).eq(names.iter().copied()));
            assert!(parameters.iter().all(|parameter| parameter.bounds.0 == 0.0));
        }
    }
}
