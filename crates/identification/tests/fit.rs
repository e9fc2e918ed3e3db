//! Fits of robots whose truth is known.

use crate::synthetic;

use phiw_dynamics::Tree;
use phiw_identification::checks::InputError;
use phiw_identification::consistent::{Consistent, ConsistentSettings, consistent};
use phiw_identification::effect::{EffectParameter, Entry, Evaluator, Needs, Sample};
use phiw_identification::fitting::{TorqueError, accumulate, torque_error};
use phiw_identification::{
    BlockSource, Data, Effect, EffectSpec, Fold, IdentificationError, Identified, Variants, identify, predict,
};
use phiw_telemetry::{Block, Recording};

const FOLDS: usize = 13;

/// Friction in proportion to the torque that a joint carries: its column is made of the model's own torque.
struct LoadFriction {
    name: String,
    joint: usize,
}

/// How a speed [rad/s] turns the sign of that friction.
fn turned(speed: f64) -> f64 {
    (speed / 0.1).tanh()
}

impl Effect for LoadFriction {
    fn spec(&self) -> EffectSpec {
        EffectSpec::new("load_friction", &[&self.name])
    }
    fn parameters(&self) -> Vec<EffectParameter> {
        let (name, unit) = ("mu".to_owned(), "1".to_owned());
        vec![EffectParameter { joint: self.name.clone(), name, unit, bounds: (0.0, f64::INFINITY) }]
    }
    fn entries(&self) -> Vec<Entry> {
        vec![Entry { row: self.joint, parameter: 0 }]
    }
    fn needs(&self) -> Needs {
        Needs { torque: true, ..Needs::default() }
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        struct Column(usize);
        impl Evaluator for Column {
            fn evaluate(&mut self, sample: &Sample<'_>, columns: &mut [f64]) {
                let torque = sample.reference_torque().get(self.0).copied().unwrap_or_default();
                columns[0] = torque.abs() * turned(sample.qd()[self.0]);
            }
        }
        Box::new(Column(self.joint))
    }
}

/// Blocks of a robot of three joints whose friction grows much with the load, its URDF, which is far off, and
/// the effects that it has.
fn loaded_robot() -> (Vec<Block>, Tree, Vec<Variants>) {
    const MU: f64 = 0.8;
    let tree = synthetic::robot(5, 3);
    let mut log = synthetic::recording(&tree, 7, 60.0, 2.0, 0.0, 0);
    let mut torque = vec![0.0; 3];
    for row in 0..log.len() {
        let own = 3 * row..3 * row + 3;
        let [v, a] = [&log.qd, &log.qdd].map(|values| values.as_ref().unwrap()[own.clone()].to_vec());
        let mut workspace = phiw_dynamics::Workspace::new(&tree);
        tree.inverse_dynamics(&log.q[own.clone()], &v, &a, &mut workspace, &mut torque).unwrap();
        for joint in 0..3 {
            log.tau[own.start + joint] += MU * torque[joint].abs() * turned(v[joint]);
        }
    }
    let mut urdf = tree.clone();
    let wrong: Vec<f64> = tree.inertial_parameters().iter().map(|value| 0.2 * value).collect();
    urdf.set_inertial_parameters(&wrong).unwrap();
    let load = |joint: usize| -> Box<dyn Effect> {
        Box::new(LoadFriction { name: tree.joint(joint).joint.clone(), joint })
    };
    let effects = (0..3).flat_map(|joint| [vec![synthetic::Viscous::on(&tree, joint)], vec![load(joint)]]);
    (synthetic::blocks(&log, 4096), urdf, effects.collect())
}

/// Two passes with the torque of the fit before were taken to be enough. Where the URDF is far off and
/// friction grows much with the load, the model's error was seven times what its fit had left.
#[test]
fn a_fit_is_one_to_the_models_own_torque() {
    let (blocks, urdf, effects) = loaded_robot();
    let data = synthetic::data(&blocks, synthetic::folds(60.0, FOLDS), Vec::new());
    let identified = identify(&urdf, effects, &data).unwrap();
    for (rmse, left) in identified.train.rmse.iter().zip(&identified.fit.residual_std) {
        assert!(*rmse <= 1.05 * left, "{rmse} with its own torque, {left} left by the fit");
    }
    assert!(identified.train.relative < 1e-6, "{}", identified.train.relative);
}

/// Bodies that can exist foretold the Schunk's torque to 8.6 % with the columns of least squares' torque, and
/// were the model, which was then 26 % off with columns of its own.
#[test]
fn bodies_are_the_model_only_where_they_are_as_good_with_their_own_torque() {
    let (blocks, urdf, effects) = loaded_robot();
    let data = synthetic::data(&blocks, synthetic::folds(60.0, FOLDS), Vec::new());
    let identified = identify(&urdf, effects, &data).unwrap();
    let Identified { design, fit, train_folds, held_out_folds, train, .. } = &identified;
    let settings = ConsistentSettings::default();
    let mut possible = consistent(design, fit, train_folds, held_out_folds, &settings).unwrap();
    // What least squares has, and the same 2 % larger: that much off with these columns, and more with their
    // own, in which friction grows with the larger load.
    possible.foretells_better = true;
    possible.parameters.clone_from(&fit.parameters);
    possible.train.clone_from(train);
    let parameters: Vec<f64> = fit.parameters.iter().map(|value| 1.02 * value).collect();
    let judged = torque_error(train_folds, &parameters).unwrap();
    let heavier = Consistent { parameters, train: judged, ..possible.clone() };
    let least_squares = (fit.parameters.clone(), train.relative);
    let (identified, is_taken) = identified.with_possible(&heavier, Some(&data)).unwrap();
    assert!(!is_taken);
    assert_eq!((identified.fit.parameters.clone(), identified.train.relative), least_squares);
    // Its columns are of its own torque again.
    let folds = accumulate(&identified.design, &data.train, &data.sources).unwrap();
    assert!(torque_error(&folds, &identified.fit.parameters).unwrap().relative < 1e-6);
    assert!(identified.with_possible(&possible, Some(&data)).unwrap().1);
}

fn fit(tree: &Tree, blocks: &Vec<Block>, seconds: f64, rest_speeds: Vec<f64>) -> Identified {
    let effects = (0..tree.joint_count()).map(|joint| vec![synthetic::Viscous::on(tree, joint)]).collect();
    identify(tree, effects, &synthetic::data(blocks, synthetic::folds(seconds, FOLDS), rest_speeds)).unwrap()
}

#[test]
fn without_noise_the_truth_is_found() {
    for seed in 0..6 {
        let tree = synthetic::robot(seed, 4);
        let blocks = synthetic::blocks(&synthetic::recording(&tree, seed, 40.0, 2.0, 0.0, 0), 500);
        let identified = fit(&tree, &blocks, 40.0, Vec::new());
        let truth = synthetic::truth(&tree, 2.0);
        assert!(identified.fit.undetermined.is_empty());
        // What the low-pass over the positions bends is left.
        assert!(identified.held_out.relative < 1e-6, "{}", identified.held_out.relative);
        for (found, truth) in identified.fit.parameters.iter().zip(&truth) {
            assert!((found - truth).abs() < 1e-4 * (1.0 + truth.abs()), "{found}, in truth {truth}");
        }
    }
}

/// Delete-one-fold deviations against the spread of fits to the same motion with other noise.
#[test]
fn standard_deviations_are_those_of_repeated_experiments() {
    const EXPERIMENTS: u64 = 40;
    let tree = synthetic::robot(2, 2);
    let fits: Vec<Identified> = (0..EXPERIMENTS)
        .map(|seed| {
            fit(
                &tree,
                &synthetic::blocks(&synthetic::recording(&tree, 1, 40.0, 2.0, 0.5, seed), 4096),
                40.0,
                Vec::new(),
            )
        })
        .collect();
    for parameter in 0..fits[0].design.parameter_count() {
        let mean =
            |value: &dyn Fn(&Identified) -> f64| fits.iter().map(value).sum::<f64>() / EXPERIMENTS as f64;
        let center = mean(&|fit| fit.fit.parameters[parameter]);
        let spread = mean(&|fit| (fit.fit.parameters[parameter] - center).powi(2)).sqrt();
        let claimed = mean(&|fit| fit.fit.standard_deviations[parameter].powi(2)).sqrt();
        let ratio = claimed / spread;
        assert!((0.6..1.7).contains(&ratio), "parameter {parameter}: ± {claimed} claimed, {spread} in truth");
    }
}

/// A recording whose joint 0 stands still in the second half, under a torque that no model knows of.
fn resting(tree: &Tree) -> Recording {
    let mut log = synthetic::recording(tree, 4, 40.0, 2.0, 0.0, 0);
    let joints = tree.joint_count();
    let half = log.len() / 2;
    let stop = log.q[half * joints];
    for row in half..log.len() {
        log.q[row * joints] = stop;
        log.tau[row * joints] += 30.0;
        for derivative in [&mut log.qd, &mut log.qdd].into_iter().flatten() {
            derivative[row * joints] = 0.0;
        }
    }
    // The others feel that joint 0 does not move.
    let mut torque = vec![0.0; joints];
    for row in half..log.len() {
        let own = row * joints..(row + 1) * joints;
        let [v, a] = [&log.qd, &log.qdd].map(|values| values.as_ref().unwrap()[own.clone()].to_vec());
        tree.inverse_dynamics(
            &log.q[own.clone()],
            &v,
            &a,
            &mut phiw_dynamics::Workspace::new(tree),
            &mut torque,
        )
        .unwrap();
        for joint in 1..joints {
            log.tau[own.start + joint] = torque[joint] + 2.0 * v[joint];
        }
    }
    log
}

#[test]
fn torque_at_rest_decides_nothing() {
    let tree = synthetic::robot(6, 3);
    let blocks = synthetic::blocks(&resting(&tree), 500);
    let data = |rest_speeds| {
        let folds = synthetic::folds(40.0, 20);
        let all: Vec<Fold> =
            folds.iter().copied().filter(|fold| !(fold.start..fold.end).contains(&20.0)).collect();
        Data { train: all.clone(), held_out: all, sources: vec![&blocks as &dyn BlockSource], rest_speeds }
    };
    let effects =
        || -> Vec<Variants> { (0..3).map(|joint| vec![synthetic::Viscous::on(&tree, joint)]).collect() };
    let misled = identify(&tree, effects(), &data(Vec::new())).unwrap();
    let fitted = identify(&tree, effects(), &data(vec![1e-3; 3])).unwrap();
    let rows = |identified: &Identified, joint: usize| -> u64 {
        identified.train_folds.iter().map(|fold| fold.groups()[joint].factor.rows()).sum()
    };
    // A reversal takes less than a tenth of the filter's window, unless it is a slow one.
    let kept = rows(&fitted, 1) as f64 / rows(&misled, 1) as f64;
    assert!(kept > 0.99, "{kept} of the rows of a joint that moves");
    let share = rows(&fitted, 0) as f64 / rows(&misled, 0) as f64;
    assert!((0.45..0.6).contains(&share), "joint 0 moves half of the time, {share} of its rows count");
    assert!(misled.train.rmse[0] > 1.0);
    // What the filter mixes across the stop is left.
    assert!(
        fitted.train.rmse[0] < 0.05 * misled.train.rmse[0],
        "{:?} {:?}",
        fitted.train.rmse,
        misled.train.rmse
    );

    let (mut resting, mut before_the_stop, mut outputs) = (0, 0, 0);
    predict(&fitted.design, &fitted.fit.parameters, &[&blocks], &mut |prediction| {
        outputs += 1;
        resting += u32::from(!prediction.counts(0));
        before_the_stop += u32::from(!prediction.counts(0) && prediction.t < 19.0);
    })
    .unwrap();
    assert!((0.4..0.6).contains(&(f64::from(resting) / f64::from(outputs))));
    assert!(before_the_stop * 100 < outputs, "{before_the_stop} of {outputs} rest before the joint stops");
}

/// The errors that the factors tell are those of the predictions, summed one by one.
#[test]
fn predictions_have_the_error_that_the_factors_tell() {
    let tree = synthetic::robot(9, 4);
    let blocks = synthetic::blocks(&synthetic::recording(&tree, 9, 40.0, 2.0, 1.0, 3), 300);
    let identified = fit(&tree, &blocks, 40.0, vec![0.05; 4]);
    let held_out = synthetic::folds(40.0, FOLDS).pop().unwrap();
    let (mut squares, mut rows) = (vec![0.0; 4], vec![0; 4]);
    predict(&identified.design, &identified.fit.parameters, &[&blocks], &mut |prediction| {
        for joint in (0..4).filter(|&joint| held_out.contains(0, prediction.t) && prediction.counts(joint)) {
            squares[joint] += prediction.residual(joint).powi(2);
            rows[joint] += 1;
        }
    })
    .unwrap();
    for joint in 0..4 {
        let rmse = (squares[joint] / f64::from(rows[joint])).sqrt();
        assert!((rmse / identified.held_out.rmse[joint] - 1.0).abs() < 1e-9, "joint {joint}");
    }
}

#[test]
fn too_short_a_log_is_said_to_be() {
    let tree = synthetic::robot(1, 6);
    let blocks = synthetic::blocks(&synthetic::recording(&tree, 1, 2.0, 2.0, 0.1, 0), 500);
    let mut data = synthetic::data(&blocks, synthetic::folds(2.0, 20), Vec::new());
    data.train.truncate(1);
    match identify(&tree, Vec::new(), &data) {
        Err(IdentificationError::Input(InputError::TooShort { rows, parameters, .. })) => {
            assert!(rows < 2 * parameters as u64);
        }
        other => panic!("{:?}", other.map(|identified| identified.train)),
    }
}

/// Three effects took all but noise from three joints and were given up, since the noise of a joint of 37 N·m
/// had become a little larger: what is as good as none neither grows nor shrinks.
#[test]
fn the_noise_of_a_large_torque_does_not_hide_what_is_won_on_small_ones() {
    let rms_torque = vec![3.591, 37.02, 2.018, 0.1378, 0.1195, 0.2255];
    let of = |rmse: &[f64]| {
        let pooled = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let relative = (pooled(rmse) / pooled(&rms_torque)).sqrt();
        TorqueError { rmse: rmse.to_vec(), rms_torque: rms_torque.clone(), relative, rows: 685 }
    };
    let before = of(&[0.0342, 0.1207, 0.0150, 0.00725, 0.01575, 0.01540]);
    let after = of(&[0.0156, 0.1379, 0.0134, 0.00083, 0.00070, 0.00104]);
    assert!(after.relative > before.relative);
    assert!(after.relative_from(0.005) < before.relative_from(0.005));
    // An error that does count is counted as it is.
    let large = of(&[1.0, 10.0, 1.0, 0.1, 0.1, 0.1]);
    assert!((large.relative_from(0.005) - large.relative).abs() < 1e-15);
}
