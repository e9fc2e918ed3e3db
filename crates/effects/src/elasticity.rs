//! A flexible transmission between motor and link.

use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal, constant};
use phiw_dynamics::{JointType, Tree};
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use phiw_identification::{Effect, EffectSpec};

/// The encoder sits on the motor: the link lags behind it by τ/k. Linear in the compliance 1/k, about the
/// value that is in force already: the link's position, velocity and acceleration differ by −τ/k, −τ̇/k,
/// −τ̈/k.
///
/// τ is the torque of the reference model, which is smooth: the measured one has noise that its second rate
/// would blow up.
pub struct JointElasticity;

impl EffectKind for JointElasticity {
    fn name(&self) -> &str {
        "joint_elasticity"
    }
    fn telling_motion(&self) -> &'static str {
        "quick reversals, so that the torque changes fast"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let compliance = found.constant(COMPLIANCE) + found.value(0);
        format!("The transmission of {} gives: {compliance:.3e} {}.", found.joints(), found.unit(0))
    }
    fn seen_against(&self) -> Signal {
        Signal::Acceleration
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joint = site[0];
        let unit = match tree.joint(joint).joint_type {
            JointType::Prismatic => "m/N",
            _ => "rad/(N·m)",
        };
        Box::new(Elastic {
            joint,
            name: tree.joint(joint).joint.clone(),
            unit,
            joints: tree.joint_count(),
            compliance: constant(constants, COMPLIANCE, 0.0),
        })
    }
}

const COMPLIANCE: &str = "compliance";

#[derive(Clone)]
struct Elastic {
    joint: usize,
    name: String,
    unit: &'static str,
    joints: usize,
    /// What is in force already.
    compliance: f64,
}

impl Effect for Elastic {
    fn spec(&self) -> EffectSpec {
        let spec = EffectSpec::new("joint_elasticity", &[&self.name]);
        if self.compliance == 0.0 { spec } else { spec.with(COMPLIANCE, self.compliance) }
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        vec![EffectParameter {
            joint: self.name.clone(),
            name: COMPLIANCE.to_owned(),
            unit: self.unit.to_owned(),
            bounds: (-self.compliance, f64::INFINITY),
        }]
    }
    fn entries(&self) -> Vec<Entry> {
        (0..self.joints).map(|row| Entry { row, parameter: 0 }).collect()
    }
    fn needs(&self) -> Needs {
        Needs { torque: true, rates: true, derivatives: true, ..Needs::default() }
    }
    fn compliance(&self) -> Option<(usize, f64)> {
        (self.compliance != 0.0).then_some((self.joint, self.compliance))
    }
    fn relinearised(&self, fitted: &[f64]) -> Option<Box<dyn Effect>> {
        let compliance = (self.compliance + fitted.first().copied().unwrap_or_default()).max(0.0);
        Some(Box::new(Elastic { compliance, ..self.clone() }))
    }
    fn is_causal(&self) -> bool {
        false
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(ElasticColumns { joint: self.joint, joints: self.joints })
    }
}

struct ElasticColumns {
    joint: usize,
    joints: usize,
}

impl Evaluator for ElasticColumns {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        let (Some(torque), Some(rate), Some(second)) = (
            sample.reference_torque().get(self.joint),
            sample.reference_torque_rate().get(self.joint),
            sample.reference_torque_second_rate().get(self.joint),
        ) else {
            return columns.fill(0.0);
        };
        let (position, velocity, acceleration) =
            (sample.torque_by_position(), sample.torque_by_velocity(), sample.torque_by_acceleration());
        for (row, column) in columns.iter_mut().enumerate() {
            let at = row * self.joints + self.joint;
            *column = -(position[at] * torque + velocity[at] * rate + acceleration[at] * second);
        }
    }
}
