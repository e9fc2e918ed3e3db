//! The zero of a torque that differs from log to log.

use crate::columns::{OwnTorque, ParameterKind};
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal, SignalRanges, constant, product, values};
use crate::mechanism::Mechanisms;
use phiw_dynamics::Tree;
use phiw_identification::effect::Sample;
use phiw_identification::{Effect, EffectSpec};

/// A torque sensor, or a drive, that is zeroed anew before each log.
///
/// Its parameters are the zeros of the training logs; where the model has a torque offset, which is what all
/// of them have in common, those of the second and the later logs against the mean of all. It says nothing of
/// any other log.
pub struct TorqueZeroByLog;

/// Number of training logs.
const LOGS: &str = "logs";
/// Whether the mean of the zeros is free as well: 1, or 0 if it is none.
const WITH_MEAN: &str = "with_mean";

impl EffectKind for TorqueZeroByLog {
    fn name(&self) -> &str {
        "torque_zero_by_log"
    }
    fn scan(&self, _site: &[usize], ranges: &SignalRanges) -> Vec<Constants> {
        if ranges.logs < 2 {
            return Vec::new();
        }
        product(&values(LOGS, [ranges.logs as f64]), &values(WITH_MEAN, [1.0, 0.0]))
    }
    fn telling_motion(&self) -> &'static str {
        "the same motion in several logs"
    }
    fn is_of_the_log(&self) -> bool {
        true
    }
    fn is_of_training_logs(&self) -> bool {
        true
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let zeros = zeros(found.constants(), found.values());
        let lowest = zeros.iter().copied().fold(f64::INFINITY, f64::min);
        let highest = zeros.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        format!(
            "The zero of the torque of {} differs from log to log, by up to {}.",
            found.joints(),
            found.in_unit_of(0, highest - lowest)
        )
    }
    fn seen_against(&self) -> Signal {
        Signal::Time
    }
    fn mechanisms(&self, _found: &FittedEffect<'_>) -> Mechanisms {
        let left_out = vec!["a torque whose zero differs from log to log".to_owned()];
        Mechanisms { parts: Vec::new(), left_out }
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let first = usize::from(!has_mean(constants));
        let logs = constant(constants, LOGS, 1.0) as usize;
        let names: Vec<String> = (first..logs).map(|log| format!("zero_{}", log + 1)).collect();
        let parameters: Vec<(&str, ParameterKind, f64)> =
            names.iter().map(|name| (name.as_str(), ParameterKind::Torque, f64::NEG_INFINITY)).collect();
        let columns = move |sample: &Sample<'_>, out: &mut [f64]| {
            let own = sample.log();
            out.iter_mut().enumerate().for_each(|(place, column)| {
                *column = match own.checked_sub(first) {
                    None => -1.0,
                    Some(own) => f64::from(u8::from(own == place)),
                };
            });
        };
        Box::new(OwnTorque::new(self.name(), tree, site[0], constants, &parameters, columns))
    }
}

fn has_mean(constants: &Constants) -> bool {
    constant(constants, WITH_MEAN, 0.0) > 0.0
}

/// The zeros of a joint's torque in the training logs.
#[derive(Clone, Debug, PartialEq)]
pub struct TorqueZeros {
    /// One for each log \[N·m, N\].
    pub of_logs: Vec<f64>,
    /// Whether they have a mean; if not, that is in a torque offset.
    pub have_mean: bool,
}

/// The zeros that an effect and its parameters are; none for another effect.
pub fn torque_zeros(spec: &EffectSpec, parameters: &[f64]) -> Option<TorqueZeros> {
    let of_logs = || zeros(&spec.constants, parameters);
    (spec.kind == TorqueZeroByLog.name())
        .then(|| TorqueZeros { of_logs: of_logs(), have_mean: has_mean(&spec.constants) })
}

fn zeros(constants: &Constants, parameters: &[f64]) -> Vec<f64> {
    let first = (!has_mean(constants)).then(|| -parameters.iter().sum::<f64>());
    first.into_iter().chain(parameters.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};

    #[test]
    fn one_log_has_no_zero_of_its_own_and_three_have_three_or_two_beside_an_offset() {
        let ranges = |logs| SignalRanges { logs, ..SignalRanges::default() };
        assert!(TorqueZeroByLog.scan(&[0], &ranges(1)).is_empty());
        let urdf = r#"<robot name="one"><link name="base"/><link name="arm"><inertial><mass value="1"/>
            <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
            <joint name="j" type="continuous"><parent link="base"/><child link="arm"/></joint></robot>"#;
        let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
        let variants = TorqueZeroByLog.scan(&[0], &ranges(3));
        let expected = [(3, [0.25, 0.5, -2.0]), (2, [1.5, 0.5, -2.0])];
        for (constants, (count, zeros)) in variants.iter().zip(expected) {
            let effect = TorqueZeroByLog.build(&tree, &[0], constants);
            let names: Vec<String> = effect.parameters().into_iter().map(|own| own.name).collect();
            assert_eq!(names, ["zero_1", "zero_2", "zero_3"][3 - count..]);
            let found = torque_zeros(&effect.spec(), &[0.25, 0.5, -2.0][3 - count..]).unwrap();
            assert_eq!(found.of_logs, zeros);
            assert_eq!(found.have_mean, count == 3);
        }
        assert_eq!(torque_zeros(&EffectSpec::new("torque_offset", &["j"]), &[1.0]), None);
    }
}
