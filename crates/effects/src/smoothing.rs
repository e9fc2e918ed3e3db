//! What low-passes a torque before it is logged: the filter of a drive, or of whoever published the log.

use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal, constant};
use crate::mechanism::Mechanisms;
use phiw_dynamics::Tree;
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample, second_rate};
use phiw_identification::{Effect, EffectSpec};
use phiw_telemetry::Block;

/// The logged torque is low-passed, on one joint or on all alike.
///
/// To second order in the frequency every low-pass is a delay and a factor 1/(1 + T²ω²): this kind is the
/// factor, `time_delay` the delay. Two equal poles, in whichever direction each of them runs, have exactly
/// this factor, and T is their time constant. The parameter is T², linear about the value that has been
/// corrected for already; a fitted one really undoes the filter.
pub struct TorqueSmoothing;

const SQUARE: &str = "time_constant_squared";
/// A torque that is smoothed over a longer time is no measurement of a motion's torque \[s\].
const MOST_TIME_CONSTANT_S: f64 = 0.06;

impl EffectKind for TorqueSmoothing {
    fn name(&self) -> &str {
        "torque_smoothing"
    }
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        let count = tree.joint_count();
        let mut sites: Vec<Vec<usize>> = (0..count).map(|joint| vec![joint]).collect();
        if count > 1 {
            sites.push((0..count).collect());
        }
        sites
    }
    fn acts_on(&self) -> &'static str {
        "one joint, or all joints"
    }
    fn telling_motion(&self) -> &'static str {
        "quick reversals of the torque"
    }
    fn is_of_the_log(&self) -> bool {
        true
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let corner = corner_hz(found.constant(SQUARE) + found.value(0));
        format!(
            "The torque of {} is low-passed before it is logged, at about {corner:.1} Hz.",
            found.joints()
        )
    }
    fn seen_against(&self) -> Signal {
        Signal::Torque
    }
    fn mechanisms(&self, _found: &FittedEffect<'_>) -> Mechanisms {
        Mechanisms {
            parts: Vec::new(),
            left_out: vec!["a torque that is low-passed before it is logged".to_owned()],
        }
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        let joints = site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect();
        let spec = EffectSpec { kind: self.name().to_owned(), joints, constants: constants.clone() };
        Box::new(Smoothing { site: site.to_vec(), square: constant(constants, SQUARE, 0.0), spec })
    }
}

struct Smoothing {
    site: Vec<usize>,
    /// What has been corrected for already \[s²\].
    square: f64,
    spec: EffectSpec,
}

impl Effect for Smoothing {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let joint = self.spec.joints.first().cloned().unwrap_or_default();
        let bounds = (-self.square, MOST_TIME_CONSTANT_S.powi(2) - self.square);
        vec![EffectParameter { joint, name: SQUARE.to_owned(), unit: "s²".to_owned(), bounds }]
    }
    fn entries(&self) -> Vec<Entry> {
        self.site.iter().map(|&row| Entry { row, parameter: 0 }).collect()
    }
    fn needs(&self) -> Needs {
        Needs { torque: true, ..Needs::default() }
    }
    fn is_causal(&self) -> bool {
        false
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(SmoothingColumns(self))
    }
    /// τ of the log is τ of the motion over 1 + T²ω², so that the latter is τ − T²·τ̈ of the log.
    fn correct(&self, block: &mut Block) {
        if self.square == 0.0 || block.tau.is_empty() {
            return;
        }
        let logged = block.tau.clone();
        for &joint in &self.site {
            for sample in 0..block.len() {
                let rate = second_rate(block, &logged, joint, sample);
                block.tau[sample * block.joints + joint] -= self.square * rate;
            }
        }
    }
    fn relinearised(&self, fitted: &[f64]) -> Option<Box<dyn Effect>> {
        let square = self.square + fitted.first().copied().unwrap_or_default();
        let spec = self.spec.clone().with(SQUARE, square);
        Some(Box::new(Smoothing { site: self.site.clone(), square, spec }))
    }
}

struct SmoothingColumns<'a>(&'a Smoothing);

impl Evaluator for SmoothingColumns<'_> {
    /// τ/(1 + T²ω²) ≈ τ + T²·τ̈.
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        for (column, &joint) in columns.iter_mut().zip(&self.0.site) {
            *column = sample.total_torque_second_rate(joint);
        }
    }
}

/// The frequency at which half of the torque is left, by T² \[s²\].
fn corner_hz(square: f64) -> f64 {
    1.0 / (std::f64::consts::TAU * square.max(0.0).sqrt())
}

/// The frequency at which a `torque_smoothing` that is in force has left half of the torque \[Hz\]; none for
/// another effect.
pub fn smoothing_corner_hz(spec: &EffectSpec) -> Option<f64> {
    let square = spec.constants.get(SQUARE).filter(|square| **square > 0.0);
    square.filter(|_| spec.kind == TorqueSmoothing.name()).map(|square| corner_hz(*square))
}
