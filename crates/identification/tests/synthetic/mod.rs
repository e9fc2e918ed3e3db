//! Robots, recordings and an effect whose truth is known.

// Each test file uses a part of this.
#![allow(dead_code)]

use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_tree};
use phiw_dynamics::{Tree, Workspace};
use phiw_identification::effect::{EffectError, EffectParameter, Entry, Evaluator, Sample};
use phiw_identification::{BlockSource, Data, Design, Effect, EffectCatalogue, EffectSpec, Fold};
use phiw_regressor::BaseParameters;
use phiw_telemetry::{Block, Conditioning, ConditioningOptions, Recording};
use std::f64::consts::TAU;

/// Torque in proportion to the velocity of a joint.
pub struct Viscous {
    /// Name of the joint.
    pub name: String,
    /// Its coordinate.
    pub joint: usize,
}

impl Viscous {
    /// One on a joint of the robot.
    pub fn on(tree: &Tree, joint: usize) -> Box<dyn Effect> {
        Box::new(Viscous { name: tree.joint(joint).joint.clone(), joint })
    }
}

impl Effect for Viscous {
    fn spec(&self) -> EffectSpec {
        EffectSpec::new("viscous", &[&self.name])
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let (name, unit) = ("fv".to_owned(), "N·m·s/rad".to_owned());
        vec![EffectParameter { joint: self.name.clone(), name, unit, bounds: (0.0, f64::INFINITY) }]
    }
    fn entries(&self) -> Vec<Entry> {
        vec![Entry { row: self.joint, parameter: 0 }]
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        struct Column(usize);
        impl Evaluator for Column {
            fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
                columns[0] = sample.qd()[self.0];
            }
        }
        Box::new(Column(self.joint))
    }
}

/// Knows [`Viscous`] only.
pub struct OneKind;

impl EffectCatalogue for OneKind {
    fn build(&self, spec: &EffectSpec, tree: &Tree) -> Result<Box<dyn Effect>, EffectError> {
        let unknown = || EffectError::UnknownJoint {
            kind: spec.kind.clone(),
            joint: spec.joints[0].clone(),
            nearest: None,
            known: Vec::new(),
        };
        Ok(Viscous::on(tree, tree.joint_index(&spec.joints[0]).ok_or_else(unknown)?))
    }
}

/// A random robot with a fixed base.
pub fn robot(seed: u64, joints: usize) -> Tree {
    random_tree(seed, &RandomTreeOptions { joints, ..RandomTreeOptions::default() }).unwrap()
}

/// Its rigid body and viscous friction on every joint.
pub fn design(tree: &Tree) -> Design {
    let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
    let effects = (0..tree.joint_count()).map(|joint| Viscous::on(tree, joint)).collect();
    Design::new(tree.clone(), base, effects)
}

/// The true parameters of [`design`], all frictions being `viscous`.
pub fn truth(tree: &Tree, viscous: f64) -> Vec<f64> {
    let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
    let mut truth = base.from_standard(&tree.inertial_parameters()).unwrap();
    truth.extend(vec![viscous; tree.joint_count()]);
    truth
}

/// The robot on sums of sines, at 100 Hz. The motion is that of `motion`, the torques' white noise of
/// deviation `noise` that of `seed`.
///
/// Velocities and accelerations are recorded too, so that the torque belongs to them to the last digit.
pub fn recording(tree: &Tree, motion: u64, seconds: f64, viscous: f64, noise: f64, seed: u64) -> Recording {
    let (mut motion, mut random) = (RandomNumbers::new(motion), RandomNumbers::new(seed));
    let joints = tree.joint_count();
    let mut sines = || -> [[f64; 3]; 4] {
        std::array::from_fn(|k| {
            [
                motion.uniform(0.1, 0.4),
                TAU * (0.15 * (k + 1) as f64 + motion.uniform(0.0, 0.1)),
                motion.uniform(0.0, TAU),
            ]
        })
    };
    let sines: Vec<_> = (0..joints).map(|_| sines()).collect();
    let mut log = Recording {
        joints: tree.joint_names().map(str::to_owned).collect(),
        qd: Some(Vec::new()),
        qdd: Some(Vec::new()),
        ..Recording::default()
    };
    let mut torque = vec![0.0; joints];
    for row in 0..(100.0 * seconds) as usize {
        let t = 0.01 * row as f64;
        let sum = |term: &dyn Fn([f64; 3]) -> f64| -> Vec<f64> {
            sines.iter().map(|sines| sines.iter().map(|sine| term(*sine)).sum()).collect()
        };
        let q = sum(&|[a, w, p]| a * (w * t + p).sin());
        let v = sum(&|[a, w, p]| a * w * (w * t + p).cos());
        let a = sum(&|[a, w, p]| -a * w * w * (w * t + p).sin());
        tree.inverse_dynamics(&q, &v, &a, &mut Workspace::new(tree), &mut torque).unwrap();
        log.t.push(t);
        for joint in 0..joints {
            let radius = (-2.0 * random.uniform(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
            let gauss = radius * random.uniform(0.0, TAU).cos();
            log.tau.push(torque[joint] + viscous * v[joint] + noise * gauss);
        }
        log.q.extend(q);
        log.qd.iter_mut().for_each(|values| values.extend(&v));
        log.qdd.iter_mut().for_each(|values| values.extend(&a));
    }
    log
}

/// The blocks of a recording, about `block_samples` long.
pub fn blocks(recording: &Recording, block_samples: usize) -> Vec<Block> {
    let options = ConditioningOptions { block_samples, ..ConditioningOptions::default() };
    let conditioning = Conditioning::choose(&[recording.survey().unwrap()], &options).unwrap();
    recording.blocks(&conditioning).unwrap()
}

/// A recording of [`robot`]s with viscous friction 2: `tree`, and from `from_s` on `later`.
pub fn recording_that_changes(tree: &Tree, later: &Tree, from_s: f64, seconds: f64, seed: u64) -> Recording {
    let of = |tree| recording(tree, seed, seconds, 2.0, 0.2, seed);
    let (mut log, changed) = (of(tree), of(later));
    let from = tree.joint_count() * log.t.iter().filter(|t| **t < from_s).count();
    log.tau[from..].copy_from_slice(&changed.tau[from..]);
    log
}

/// The robot with a tool as heavy as its last link.
pub fn with_tool(tree: &Tree) -> Tree {
    let mut with_tool = tree.clone();
    let mut parameters = tree.inertial_parameters();
    let last = parameters.len() - 10;
    parameters[last..].iter_mut().for_each(|own| *own *= 2.0);
    with_tool.set_inertial_parameters(&parameters).unwrap();
    with_tool
}

/// The time from 0 to `seconds` of log 0 in equal pieces.
pub fn folds(seconds: f64, count: usize) -> Vec<Fold> {
    let edge = |piece: usize| seconds * piece as f64 / count as f64;
    (0..count).map(|piece| Fold { log: 0, start: edge(piece), end: edge(piece + 1) }).collect()
}

/// Data of one source, nothing of which is held out but the last fold.
pub fn data<'a>(source: &'a dyn BlockSource, mut folds: Vec<Fold>, rest_speeds: Vec<f64>) -> Data<'a> {
    let held_out = folds.pop().into_iter().collect();
    Data { train: folds, held_out, sources: vec![source], rest_speeds }
}
