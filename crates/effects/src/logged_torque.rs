//! What becomes of a torque on its way into the log: it is stamped late, or by a clock that drifts, or it is
//! low-passed.
//!
//! All of it is undone in the log itself, and their columns are linear about what is undone already.

use crate::fitted::FittedEffect;
use crate::kind::{Constants, EffectKind, Signal, constant};
use crate::mechanism::{Mechanism, Mechanisms};
use phiw_dynamics::Tree;
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample, second_rate};
use phiw_identification::{Effect, EffectSpec};
use phiw_telemetry::Block;

/// The torque is stamped later (positive) or earlier than the position: on one joint, or on all alike.
///
/// Linear in the delay about the value that has been corrected for already; a fitted delay really shifts the
/// torque.
pub struct TimeDelay;

impl EffectKind for TimeDelay {
    fn name(&self) -> &str {
        "time_delay"
    }
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        each_and_all(tree)
    }
    fn acts_on(&self) -> &'static str {
        EACH_OR_ALL
    }
    fn mends_turning(&self) -> bool {
        true
    }
    fn telling_motion(&self) -> &'static str {
        QUICK_REVERSALS
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joints, late_ms) = (found.joints(), 1e3 * LATE.value(found));
        match late_ms < 0.0 {
            true => format!("The torque of {joints} acts {:.2} ms after it is logged.", -late_ms),
            false => format!("The torque of {joints} is stamped {late_ms:.2} ms late."),
        }
    }
    /// A torque that is logged before it acts is a command, and its motor is late. One that is logged after
    /// it has acted is late in the log alone: nothing in a simulator's robot does that.
    fn mechanisms(&self, found: &FittedEffect<'_>) -> Mechanisms {
        let late = LATE.value(found);
        if late > 0.0 {
            return of_the_log("a torque that is logged late");
        }
        let delay = |joint: &String| Mechanism::MotorDelay { joint: joint.clone(), delay: -late };
        Mechanisms { parts: found.joint_names().iter().map(delay).collect(), left_out: Vec::new() }
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        LATE.effect(self.name(), tree, site, constants)
    }
}

/// The torques are stamped by a clock that runs faster (positive) or slower than that of the positions: a
/// delay that is nothing where a log begins and grows with it, alike on all joints.
///
/// Linear in the rate about the one that has been corrected for already; a fitted rate really moves each
/// torque to its time.
pub struct ClockDrift;

impl EffectKind for ClockDrift {
    fn name(&self) -> &str {
        "clock_drift"
    }
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        vec![(0..tree.joint_count()).collect()]
    }
    fn acts_on(&self) -> &'static str {
        "all joints"
    }
    fn telling_motion(&self) -> &'static str {
        "quick reversals of the torque at the beginning and at the end of a long log"
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let rate = DRIFT.value(found);
        let (runs, stamped) = if rate < 0.0 { ("slow", "early") } else { ("fast", "late") };
        let (ppm, late_ms) = (1e6 * rate.abs(), 1e4 * rate.abs());
        format!(
            "The clock of the torques runs {ppm:.0} ppm {runs}: ten seconds into a log they are stamped \
             {late_ms:.2} ms {stamped}."
        )
    }
    fn seen_against(&self) -> Signal {
        Signal::Time
    }
    fn mechanisms(&self, _found: &FittedEffect<'_>) -> Mechanisms {
        of_the_log("a clock of the torques that drifts")
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        DRIFT.effect(self.name(), tree, site, constants)
    }
}

/// The logged torque is low-passed, on one joint or on all alike.
///
/// To second order in the frequency every low-pass is a delay and a factor 1/(1 + T²ω²): this kind is the
/// factor, [`TimeDelay`] the delay. Two equal poles, in whichever direction each of them runs, have exactly
/// this factor, and T is their time constant. The parameter is T², linear about the value that has been
/// corrected for already; a fitted one really undoes the filter.
pub struct TorqueSmoothing;

impl EffectKind for TorqueSmoothing {
    fn name(&self) -> &str {
        "torque_smoothing"
    }
    fn sites(&self, tree: &Tree) -> Vec<Vec<usize>> {
        each_and_all(tree)
    }
    fn acts_on(&self) -> &'static str {
        EACH_OR_ALL
    }
    fn telling_motion(&self) -> &'static str {
        QUICK_REVERSALS
    }
    fn is_of_the_log(&self) -> bool {
        true
    }
    fn sentence(&self, found: &FittedEffect<'_>) -> String {
        let (joints, corner) = (found.joints(), corner_hz(SMOOTHED.value(found)));
        format!("The torque of {joints} is low-passed before it is logged, at about {corner:.1} Hz.")
    }
    fn seen_against(&self) -> Signal {
        Signal::Torque
    }
    fn mechanisms(&self, _found: &FittedEffect<'_>) -> Mechanisms {
        of_the_log("a torque that is low-passed before it is logged")
    }
    fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
        SMOOTHED.effect(self.name(), tree, site, constants)
    }
}

/// The frequency at which a `torque_smoothing` that is in force has left half of the torque \[Hz\]; none for
/// another effect.
pub fn smoothing_corner_hz(spec: &EffectSpec) -> Option<f64> {
    let square = spec.constants.get(SMOOTHED.constant).filter(|square| **square > 0.0);
    square.filter(|_| spec.kind == TorqueSmoothing.name()).map(|square| corner_hz(*square))
}

/// The frequency at which half of the torque is left, by T² \[s²\].
fn corner_hz(square: f64) -> f64 {
    1.0 / (std::f64::consts::TAU * square.max(0.0).sqrt())
}

const EACH_OR_ALL: &str = "one joint, or all joints";
const QUICK_REVERSALS: &str = "quick reversals of the torque";

fn each_and_all(tree: &Tree) -> Vec<Vec<usize>> {
    let count = tree.joint_count();
    let mut sites: Vec<Vec<usize>> = (0..count).map(|joint| vec![joint]).collect();
    if count > 1 {
        sites.push((0..count).collect());
    }
    sites
}

fn of_the_log(what: &str) -> Mechanisms {
    Mechanisms { parts: Vec::new(), left_out: vec![what.to_owned()] }
}

/// One way in which a torque gets into the log.
struct Way {
    /// Name of its parameter, and of the constant that has been corrected for.
    constant: &'static str,
    unit: &'static str,
    /// What the value may be.
    bounds: (f64, f64),
    /// What a unit of it adds to the torque of a joint, to first order.
    column: fn(&Sample<'_>, usize) -> f64,
    /// Undoes a value of it in a joint's torques.
    undo: fn(&mut Block, usize, f64),
}

/// τ(t − d) ≈ τ(t) − d·τ̇(t). A log whose torque is later than its motion by more is no log of a controlled
/// robot.
static LATE: Way = Way {
    constant: "delay",
    unit: "s",
    bounds: (-0.1, 0.1),
    column: |sample, joint| -rate_of_torque(sample, joint),
    undo: |block, joint, delay| advance(block, joint, |_| delay),
};

/// A clock that is further off is that of another sample rate.
static DRIFT: Way = Way {
    constant: "rate",
    unit: "s/s",
    bounds: (-0.02, 0.02),
    column: |sample, joint| -sample.time_in_log() * rate_of_torque(sample, joint),
    undo: |block, joint, rate| advance(block, joint, |time_in_log| rate * time_in_log),
};

/// τ/(1 + T²ω²) ≈ τ + T²·τ̈. A torque that is smoothed over more than 60 ms is no measurement of a motion's
/// torque.
static SMOOTHED: Way = Way {
    constant: "time_constant_squared",
    unit: "s²",
    bounds: (0.0, 0.06 * 0.06),
    column: |sample, joint| sample.total_torque_second_rate(joint),
    undo: sharpen,
};

fn rate_of_torque(sample: &Sample<'_>, joint: usize) -> f64 {
    sample.total_torque_rate().get(joint).copied().unwrap_or_default()
}

impl Way {
    /// The value that was fitted: what has been corrected for, and the rest.
    fn value(&self, found: &FittedEffect<'_>) -> f64 {
        found.constant(self.constant) + found.value(0)
    }

    fn effect(
        &'static self,
        kind: &str,
        tree: &Tree,
        site: &[usize],
        constants: &Constants,
    ) -> Box<dyn Effect> {
        let joints = site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect();
        let spec = EffectSpec { kind: kind.to_owned(), joints, constants: constants.clone() };
        Box::new(Logged {
            way: self,
            site: site.to_vec(),
            corrected: constant(constants, self.constant, 0.0),
            spec,
        })
    }
}

#[derive(Clone)]
struct Logged {
    way: &'static Way,
    site: Vec<usize>,
    /// What has been corrected for already.
    corrected: f64,
    spec: EffectSpec,
}

impl Effect for Logged {
    fn spec(&self) -> EffectSpec {
        self.spec.clone()
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let joint = self.spec.joints.first().cloned().unwrap_or_default();
        let (low, high) = self.way.bounds;
        let bounds = (low - self.corrected, high - self.corrected);
        let (name, unit) = (self.way.constant.to_owned(), self.way.unit.to_owned());
        vec![EffectParameter { joint, name, unit, bounds }]
    }
    fn entries(&self) -> Vec<Entry> {
        self.site.iter().map(|&row| Entry { row, parameter: 0 }).collect()
    }
    fn needs(&self) -> Needs {
        Needs { rates: true, ..Needs::default() }
    }
    fn is_causal(&self) -> bool {
        false
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(LoggedColumns(self))
    }
    fn correct(&self, block: &mut Block) {
        if self.corrected != 0.0 && !block.tau.is_empty() {
            self.site.iter().for_each(|&joint| (self.way.undo)(block, joint, self.corrected));
        }
    }
    fn relinearised(&self, fitted: &[f64]) -> Option<Box<dyn Effect>> {
        let corrected = self.corrected + fitted.first().copied().unwrap_or_default();
        let spec = self.spec.clone().with(self.way.constant, corrected);
        Some(Box::new(Logged { corrected, spec, ..self.clone() }))
    }
}

struct LoggedColumns<'a>(&'a Logged);

impl Evaluator for LoggedColumns<'_> {
    fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
        for (column, &joint) in columns.iter_mut().zip(&self.0.site) {
            *column = (self.0.way.column)(sample, joint);
        }
    }
}

/// τ of the log is τ of the motion over 1 + T²ω², so that the latter is τ − T²·τ̈ of the log.
fn sharpen(block: &mut Block, joint: usize, square: f64) {
    let rates: Vec<f64> =
        (0..block.len()).map(|sample| second_rate(block, &block.tau, joint, sample)).collect();
    let own = block.tau.iter_mut().skip(joint).step_by(block.joints);
    own.zip(rates).for_each(|(torque, rate)| *torque -= square * rate);
}

/// Shifts a joint's torque earlier by what `delay` gives for the time since the log's first sample, by cubic
/// interpolation; the ends keep their last value.
fn advance(block: &mut Block, joint: usize, delay: impl Fn(f64) -> f64) {
    let samples = block.t.len();
    if samples < 4 {
        return;
    }
    let period = (block.t[samples - 1] - block.t[0]) / (samples - 1) as f64;
    let joints = block.joints;
    let original: Vec<f64> = (0..samples).map(|sample| block.tau[sample * joints + joint]).collect();
    let last = (samples - 1) as f64;
    for sample in 0..samples {
        let shift = delay(block.t[sample] - block.log_start) / period;
        let place = (sample as f64 + shift).clamp(0.0, last);
        let before = (place.floor() as usize).clamp(1, samples - 3);
        let u = place - before as f64;
        // Lagrange's polynomial through the samples at −1, 0, 1, 2.
        let weights = [
            -u * (u - 1.0) * (u - 2.0) / 6.0,
            (u + 1.0) * (u - 1.0) * (u - 2.0) / 2.0,
            -(u + 1.0) * u * (u - 2.0) / 2.0,
            (u + 1.0) * u * (u - 1.0) / 6.0,
        ];
        let value = weights.iter().zip(&original[before - 1..before + 3]).map(|(w, x)| w * x).sum();
        block.tau[sample * joints + joint] = value;
    }
}
