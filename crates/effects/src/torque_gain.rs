//! A torque that is measured, or computed from a current, with the wrong factor.

use crate::drive::motor;
use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal, constant};
use crate::mechanism::Mechanisms;
use phiw_codegen::{Expression, JointTorque};
use phiw_dynamics::Tree;
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use phiw_identification::{Effect, EffectSpec};

/// (1 + ε) on the measured torque: the column is all torque that the model knows of, friction included. Where
/// the friction is fitted its own columns take up that part of the change; where it is held nothing else
/// would.
///
/// To first order in ε, unless a value is in force: then all columns of the torque are multiplied by it, and
/// what is fitted is the rest. A factor of two, taken to first order alone, would be fitted to a torque that
/// holds the friction twice.
pub struct TorqueGain;

const GAIN_ERROR: &str = "gain_error";
/// What is known to first order only is no larger.
const LARGEST_TO_FIRST_ORDER: f64 = 0.5;
/// A torque that is further off, a tenth or ten times, is in another unit.
const LARGEST_FACTOR: f64 = 10.0;

impl EffectKind for TorqueGain {
    fn name(&self) -> &str {
        "torque_gain"
    }
    fn telling_motion(&self) -> &'static str {
        "a known load on the joint"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let error = gain_error(found);
        let (percent, way) = (100.0 * error.abs(), if error < 0.0 { "small" } else { "large" });
        format!("The torque of {} is measured {percent:.1} % too {way}.", found.joints())
    }
    fn mechanisms(&self, found: &FittedEffect<'_>) -> Mechanisms {
        motor(found, 1.0 / (1.0 + gain_error(found)), 0.0)
    }
    fn formulas(&self, found: &FittedEffect<'_>) -> Vec<JointTorque> {
        let error = gain_error(found);
        found.own_torque(|joint| error * Expression::MotionTorque(joint.to_owned()))
    }
    fn seen_against(&self) -> Signal {
        Signal::Torque
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        Box::new(Gain {
            joint: site[0],
            error: constant(constants, GAIN_ERROR, 0.0),
            spec: EffectSpec {
                kind: self.name().to_owned(),
                joints: vec![tree.joint(site[0]).joint.clone()],
                constants: constants.clone(),
            },
        })
    }
}

fn gain_error(found: &FittedEffect<'_>) -> f64 {
    found.constant(GAIN_ERROR) + found.value(0)
}

#[derive(Clone)]
struct Gain {
    joint: usize,
    /// What is in force already.
    error: f64,
    spec: EffectSpec,
}

impl Effect for Gain {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let joint = self.spec.joints.first().cloned().unwrap_or_default();
        let bounds = match self.error == 0.0 {
            true => (-LARGEST_TO_FIRST_ORDER, LARGEST_TO_FIRST_ORDER),
            false => (1.0 / LARGEST_FACTOR - 1.0 - self.error, LARGEST_FACTOR - 1.0 - self.error),
        };
        vec![EffectParameter { joint, name: GAIN_ERROR.to_owned(), unit: "1".to_owned(), bounds }]
    }
    fn entries(&self) -> Vec<Entry> {
        vec![Entry { row: self.joint, parameter: 0 }]
    }
    fn needs(&self) -> Needs {
        Needs { total_torque: true, ..Needs::default() }
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(GainColumn(self))
    }
    fn logged_factor(&self) -> Option<(usize, f64)> {
        (self.error != 0.0).then_some((self.joint, 1.0 + self.error))
    }
    fn with_logged_factor(&self, fitted: &[f64]) -> Option<Box<dyn Effect>> {
        let moved = self.error + fitted.first().copied().unwrap_or_default();
        // A step to first order may go beyond what is possible; from a factor of nothing nothing comes back.
        let error = moved.clamp(1.0 / LARGEST_FACTOR - 1.0, LARGEST_FACTOR - 1.0);
        Some(Box::new(Gain { error, spec: self.spec.clone().with(GAIN_ERROR, error), ..self.clone() }))
    }
    fn relinearised(&self, fitted: &[f64]) -> Option<Box<dyn Effect>> {
        // What is not in force stays as it is: to first order, beside the others.
        (self.error != 0.0).then(|| self.with_logged_factor(fitted))?
    }
}

struct GainColumn<'a>(&'a Gain);

impl Evaluator for GainColumn<'_> {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        let torque = sample.total_torque().get(self.0.joint).copied().unwrap_or_default();
        // The factor that is in force multiplies this column, too.
        columns[0] = torque / (1.0 + self.0.error);
    }
}
