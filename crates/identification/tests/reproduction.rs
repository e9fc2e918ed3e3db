//! Models that are moved: what they reproduce, and what cannot move.

use crate::synthetic;

use phiw_dynamics::{AnalyticBackend, Tree, Workspace};
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use phiw_identification::reproduction::{
    ErrorGrowth, Plant, PlantError, ReproductionSettings, Window, collect_windows, reproduce,
};
use phiw_identification::{Design, Effect, EffectSpec};
use phiw_regressor::BaseParameters;
use phiw_telemetry::{Block, Conditioning, ConditioningOptions};

/// Inertia of the joint's own motion; `later` makes it one that no simulation can have.
struct Rotor {
    joint: usize,
    later: bool,
}

impl Effect for Rotor {
    fn spec(&self) -> EffectSpec {
        EffectSpec::new("rotor", &["a"])
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let (joint, name, unit) = ("a".to_owned(), "Ia".to_owned(), "kg·m²".to_owned());
        vec![EffectParameter { joint, name, unit, bounds: (0.0, f64::INFINITY) }]
    }
    fn entries(&self) -> Vec<Entry> {
        vec![Entry { row: self.joint, parameter: 0 }]
    }
    fn needs(&self) -> Needs {
        Needs { derivatives: self.later, ..Needs::default() }
    }
    fn is_linear_in_motion(&self, _: usize) -> bool {
        true
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        struct Column(usize);
        impl Evaluator for Column {
            fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
                columns[0] = sample.qdd()[self.0];
            }
        }
        Box::new(Column(self.joint))
    }
}

const VISCOUS: f64 = 2.0;
const ROTOR: f64 = 0.7;

/// Viscous friction and a rotor on every joint, and their parameters behind those of the rigid body.
fn design(tree: &Tree, later: bool) -> (Design, Vec<f64>) {
    let base = BaseParameters::of_tree(tree, Default::default()).unwrap();
    let joints = tree.joint_count();
    let mut parameters = base.from_standard(&tree.inertial_parameters()).unwrap();
    parameters.extend(vec![VISCOUS; joints]);
    parameters.extend(vec![ROTOR; joints]);
    let viscous = (0..joints).map(|joint| synthetic::Viscous::on(tree, joint));
    let rotors = (0..joints).map(|joint| Box::new(Rotor { joint, later }) as Box<dyn Effect>);
    (Design::new(tree.clone(), base, viscous.chain(rotors).collect()), parameters)
}

/// Two seconds of the robot with those effects, at 1 kHz.
fn window(tree: &Tree, start: f64) -> Window {
    let joints = tree.joint_count();
    let mut window =
        Window { log: 0, start, period: 1e-3, joints, q: Vec::new(), qd: Vec::new(), tau: Vec::new() };
    let mut torque = vec![0.0; joints];
    for sample in 0..=2000 {
        let t = start + 1e-3 * f64::from(sample);
        let phase = |joint: usize| (2.0 + 0.7 * joint as f64, joint as f64);
        let all = |of: &dyn Fn(f64, f64) -> f64| -> Vec<f64> {
            (0..joints).map(|joint| of(phase(joint).0, phase(joint).1)).collect()
        };
        let q = all(&|w, p| 0.5 * (w * t + p).sin());
        let v = all(&|w, p| 0.5 * w * (w * t + p).cos());
        let a = all(&|w, p| -0.5 * w * w * (w * t + p).sin());
        tree.inverse_dynamics(&q, &v, &a, &mut Workspace::new(tree), &mut torque).unwrap();
        window.tau.extend((0..joints).map(|joint| torque[joint] + VISCOUS * v[joint] + ROTOR * a[joint]));
        window.q.extend(q);
        window.qd.extend(v);
    }
    window
}

fn reproduced(
    tree: &Tree,
    design: &Design,
    parameters: &[f64],
    windows: &[Window],
    closed: bool,
) -> ErrorGrowth {
    let plant =
        || Ok(Plant::new(Box::new(AnalyticBackend::new(tree.clone()))).with_effects(design, parameters)?);
    let joints = tree.joint_count();
    let inertia = vec![1.0; joints];
    let in_loop = closed.then_some(inertia.as_slice());
    reproduce(&plant, windows, &vec![1.0; joints], in_loop, &ReproductionSettings::default()).unwrap()
}

#[test]
fn a_right_model_reproduces_its_motion_and_a_wrong_one_does_not() {
    for seed in 1..4 {
        let tree = synthetic::robot(seed, 3);
        let (design, parameters) = design(&tree, false);
        let windows = [window(&tree, 0.0), window(&tree, 3.0)];
        let right = reproduced(&tree, &design, &parameters, &windows, false);
        assert_eq!((right.horizons.len(), right.lost[39]), (40, 0));
        assert!(right.share_of_travel[39] < 1e-5, "{:?}", right.share_of_travel);
        // Friction that is off by half, and then inertia.
        let mut wrong = parameters.clone();
        let friction = design.base().count();
        wrong[friction..friction + 3].iter_mut().for_each(|fv| *fv *= 1.5);
        let off = reproduced(&tree, &design, &wrong, &windows, false);
        assert!(off.share_of_travel[39] > 100.0 * right.share_of_travel[39]);
        assert!(off.share_of_travel[0] < off.share_of_travel[9], "{:?}", off.share_of_travel);
        let in_loop = reproduced(&tree, &design, &wrong, &windows, true);
        assert!(in_loop.share_of_travel[39] < off.share_of_travel[39]);
        assert!(in_loop.loop_torque_share > 0.0 && off.loop_torque_share == 0.0);
        let mut heavy = parameters.clone();
        heavy[friction + 3..].iter_mut().for_each(|rotor| *rotor *= 2.0);
        assert!(reproduced(&tree, &design, &heavy, &windows, false).share_of_travel[39] > 0.01);
    }
}

#[test]
fn rotors_are_part_of_the_mass_matrix() {
    let tree = synthetic::robot(5, 3);
    let (design, parameters) = design(&tree, false);
    let backend = || Box::new(AnalyticBackend::new(tree.clone()));
    let (mut alone, mut with) = ([0.0; 3], [0.0; 3]);
    assert!(Plant::new(backend()).inertia(&[0.1; 3], &mut alone).unwrap());
    let mut plant = Plant::new(backend()).with_effects(&design, &parameters).unwrap();
    assert!(plant.inertia(&[0.1; 3], &mut with).unwrap());
    alone.iter().zip(&with).for_each(|(alone, with)| assert!((with - alone - ROTOR).abs() < 1e-9));
    assert!(Plant::new(backend()).with_effects(&design, &parameters[1..]).is_err());
}

#[test]
fn a_mass_matrix_that_is_not_positive_definite_is_found_and_moves_nothing() {
    let mut tree = synthetic::robot(5, 3);
    let negative: Vec<f64> = tree.inertial_parameters().iter().map(|x| -x).collect();
    tree.set_inertial_parameters(&negative).unwrap();
    let mut plant = Plant::new(Box::new(AnalyticBackend::new(tree.clone())));
    let mut own = [0.0; 3];
    assert!(!plant.inertia(&[0.1; 3], &mut own).unwrap());
    let zero = [0.0; 3];
    let moved = plant.accelerate(0.0, [&zero, &zero, &zero, &zero], &mut own);
    assert!(matches!(moved, Err(PlantError::NotPositiveDefinite)));
    // Within a reproduction that is a window lost, at once.
    let plant = || Ok(Plant::new(Box::new(AnalyticBackend::new(tree.clone()))));
    let windows = [window(&synthetic::robot(5, 3), 0.0)];
    let growth = reproduce(&plant, &windows, &[1.0; 3], None, &ReproductionSettings::default()).unwrap();
    assert!(growth.lost.iter().all(|lost| *lost == 1));
    assert!(growth.share_of_travel.iter().all(|share| *share == 1.0));
}

#[test]
fn effects_that_a_simulation_cannot_have_are_named_and_left_out() {
    let tree = synthetic::robot(5, 2);
    let (design, parameters) = design(&tree, true);
    assert_eq!(Plant::left_out(&design), ["rotor"]);
    let mut plant =
        Plant::new(Box::new(AnalyticBackend::new(tree.clone()))).with_effects(&design, &parameters).unwrap();
    let (mut own, mut alone) = ([0.0; 2], [0.0; 2]);
    plant.inertia(&[0.1; 2], &mut own).unwrap();
    Plant::new(Box::new(AnalyticBackend::new(tree.clone()))).inertia(&[0.1; 2], &mut alone).unwrap();
    assert_eq!(own, alone);
}

/// Windows lie side by side, cross no gap, and are spread over a log that has too many.
#[test]
fn windows_cross_no_gap_and_are_at_most_so_many() {
    let tree = synthetic::robot(2, 2);
    let mut log = synthetic::recording(&tree, 1, 30.0, 0.0, 0.0, 1);
    log.t.iter_mut().skip(1500).for_each(|t| *t += 5.0);
    let survey = log.survey().unwrap();
    let options = ConditioningOptions { decimation: Some(1), block_samples: 300, ..Default::default() };
    let blocks = log.blocks(&Conditioning::choose(&[survey], &options).unwrap()).unwrap();
    let all = collect_windows(&[&blocks], 2.0, 30.0, 100).unwrap();
    assert_eq!(all.len(), 14, "seven in each half");
    for window in &all {
        let end = window.start + 2.0;
        assert_eq!(window.len(), 201);
        assert!(end <= 15.0 || window.start >= 20.0, "{} to {end}", window.start);
    }
    let few = collect_windows(&[&blocks], 2.0, 30.0, 5).unwrap();
    assert!((4..=5).contains(&few.len()) && few.last().unwrap().start > 20.0);
    // Logs without torque drive nothing.
    let mut silent: Vec<Block> = blocks.clone();
    silent.iter_mut().for_each(|block| block.tau.clear());
    assert!(collect_windows(&[&silent], 2.0, 30.0, 5).unwrap().is_empty());
}
