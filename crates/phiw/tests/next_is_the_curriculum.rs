//! `phiw next` and the curriculum plan the same on the same inputs: the same motion, α and margin, and the
//! same refusal.

use crate::next_scene;

use next_scene::{JOINTS, Scene, tree, urdf};
use phiw_curriculum::constraint::{Certainty, FalseFalls, ZmpConstraint};
use phiw_curriculum::end::FixedCount;
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::planner::Plan;
use phiw_curriculum::relaxation::ConditionRelaxation;
use phiw_curriculum::selection::{
    Choice, MotionCandidates, Selection, SmallestCondition, TorqueOptimalPerSecond,
};
use phiw_curriculum::{
    Curriculum, CurriculumError, CurriculumRun, CurriculumSettings, Experiment, IterationRecord, Trial,
};
use phiw_dynamics::Tree;
use phiw_effects::{Catalogue, SignalRanges};
use phiw_estimation::{
    BayesianLeastSquares, Estimator, Evidence, LeastSquares, LogNoise, ParameterPrior, Robot, RobotModel,
    RowsAt,
};
use phiw_identification::fitting::{fit, merge};
use phiw_identification::model::with_masses;
use phiw_identification::{BlockSource, Data, LogSet, identify};
use phiw_telemetry::{ConditioningOptions, Recording, TorqueColumns};
use phiw_zmp::{Stance, SupportPolygon};
use serde_json::Value;

/// A curriculum is never asked to do anything here.
struct Nobody;

impl Experiment for Nobody {
    fn perform(
        &self,
        _: &Robot,
        _: &RobotModel,
        _: &Motion,
        _: &mut dyn rand::Rng,
    ) -> Result<Trial, CurriculumError> {
        unreachable!("a plan moves nothing")
    }
}

/// What `phiw next` knows by default of the error of a URDF.
const URDF_ERROR: f64 = 0.3;
/// What it is told of the link on the floor.
const BASE_ERROR: f64 = 0.02;

/// The plan of a curriculum that has these logs of the scene, standing on a sole of `size` times the scene's.
fn curriculum_plan(
    scene: &Scene,
    logs: &[&str],
    size: f64,
    selection: &dyn Selection,
) -> Result<Plan, CurriculumError> {
    let fixed = tree(&urdf(), false);
    let base_link = tree(&urdf(), true).bodies()[0].inertial;
    let robot = Robot::with_viscous_friction(fixed.clone(), base_link, Catalogue::default())?;
    let dataset = MotionDataset::new(JOINTS, motions(scene, &fixed))?;
    let initial = RobotModel { standard: with_masses(&fixed), ..robot.truth(&[0.0; JOINTS])? };
    let mut run = CurriculumRun::new(0, initial.clone());
    let candidates = if logs.is_empty() {
        // The friction of a robot that has not moved yet has columns all the same.
        MotionCandidates::new(&robot, robot.declared(), &dataset, &[1.0; JOINTS])?
    } else {
        let (noise, evidence) = measured(scene, &fixed, logs);
        let design = robot.design(robot.declared())?;
        let estimator = BayesianLeastSquares {
            noise,
            prior: ParameterPrior { model: initial.clone(), share: URDF_ERROR },
        };
        let all = evidence.last().unwrap().clone();
        let estimate = estimator.estimate(&design, &all, &initial, &initial.parameters(&robot)?)?;
        run.certainty = Certainty::of(&robot, &estimate);
        run.model = initial.with_parameters(&robot, robot.declared(), &estimate.parameters)?;
        let candidates = MotionCandidates::new(&robot, robot.declared(), &dataset, &[1.0; JOINTS])?;
        for evidence in &evidence {
            run.history.push(record(candidates.measured(evidence)?.condition_number(), &run.model));
        }
        run.evidence = Some(all);
        candidates
    };
    let sole =
        [[0.22, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.22, -0.2]].map(|corner| corner.map(|x: f64| size * x));
    let stance = Stance::new(SupportPolygon::from_points(&sole).unwrap(), [0.0; 2], 0.0).unwrap();
    let curriculum = Curriculum {
        robot: &robot,
        dataset: &dataset,
        candidates: &candidates,
        experiment: &Nobody,
        selection,
        constraint: &ZmpConstraint::new(stance).counting(FalseFalls {
            belief_share: URDF_ERROR,
            base_link_share: BASE_ERROR,
            ..FalseFalls::default()
        }),
        relaxation: &ConditionRelaxation::default(),
        estimator: &LeastSquares,
        growth: None,
        end: &FixedCount(9),
        rows_at: RowsAt::Stamps,
        settings: CurriculumSettings::default(),
    };
    Ok(curriculum.plan(&run)?.unwrap())
}

fn motions(scene: &Scene, tree: &Tree) -> Vec<Motion> {
    let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
    let motion = |number: usize| {
        let path = scene.path(&format!("motions/m{number:02}.csv"));
        let recording = Recording::from_csv(&path, &joints, TorqueColumns::Absent).unwrap();
        Motion::from_recording(&format!("m{number:02}"), "", &recording).unwrap()
    };
    (0..20).map(motion).collect()
}

/// The noise of logs, and what had been measured after each.
fn measured(scene: &Scene, tree: &Tree, logs: &[&str]) -> (LogNoise, Vec<Evidence>) {
    let paths: Vec<_> = logs.iter().map(|log| scene.path(log)).collect();
    let silent = |_: &str, _: u64, _: u64| {};
    let set = LogSet::open_unexcited(tree, &paths, &[], &ConditioningOptions::default(), &silent).unwrap();
    let sources = set.sources(&silent);
    let data = Data {
        train: set.training_folds(),
        held_out: set.held_out_folds(),
        sources: sources.iter().map(|source| source as &dyn BlockSource).collect(),
        rest_speeds: set.rest_speeds(),
    };
    let ranges = SignalRanges::of_surveys(set.training());
    let effects = Catalogue::default().declare("viscous_friction", tree, &ranges).unwrap();
    let identified = identify(tree, effects, &data).unwrap();
    let folds = [identified.train_folds, identified.held_out_folds].concat();
    let rate_hz = set.conditioning().plan(&set.surveys()[0]).unwrap().output_rate_hz();
    let after = |log: usize| {
        let stretches = data.train.iter().chain(&data.held_out).zip(&folds);
        let own: Vec<_> = stretches.filter(|(fold, _)| fold.log <= log).map(|(_, own)| own.clone()).collect();
        Evidence::of_factor(merge(&own).unwrap(), Some(rate_hz))
    };
    let noise = LogNoise::of_fit(&fit(&identified.design, &folds).unwrap());
    (noise, (0..logs.len()).map(after).collect())
}

fn record(condition_number: f64, model: &RobotModel) -> IterationRecord {
    IterationRecord {
        motion: String::new(),
        choice: Choice { motion: 0, merit: None, runner_up: None },
        allowed: 1,
        forced: false,
        alpha: 0.0,
        margin_m: None,
        sure_margin_m: None,
        kept: None,
        fell_at_s: None,
        still_share: 1.0,
        tracking_error: Vec::new(),
        condition_number: Some(condition_number),
        torque_uncertainty: None,
        torque_change: None,
        separates: None,
        model: model.clone(),
        standard_deviations: Vec::new(),
        misfit: Vec::new(),
    }
}

#[test]
fn the_choice_alpha_and_margin_are_the_same() {
    let scene = Scene::new(&urdf());
    let all_logs = [&[][..], &["log_1.csv"], &["log_1.csv", "log_2.csv"]];
    let selections: [(&dyn Selection, &str); 2] =
        [(&TorqueOptimalPerSecond, ""), (&SmallestCondition, " --selection condition")];
    for (logs, (selection, option)) in
        all_logs.into_iter().flat_map(|logs| selections.map(|selection| (logs, selection)))
    {
        let plan = curriculum_plan(&scene, logs, 1.0, selection).unwrap();
        let measured: String = logs.iter().map(|log| format!(" DIR/{log}")).collect();
        let measured = if logs.is_empty() { measured } else { format!("--measured{measured}") };
        let more = format!(
            "--support DIR/support.toml --false-fall-rate 0.001 --base-error {BASE_ERROR} --declare viscous_friction{option} {measured}"
        );
        let (_, _, report) = scene.next(&more);
        let next = &report["next"];
        let number = |path: &str| next.pointer(path).and_then(Value::as_f64).unwrap();
        assert_eq!(next["motion"], format!("m{:02}", plan.choice.motion));
        assert_eq!((number("/allowed") as usize, next["forced"] == true), (plan.allowed.len(), plan.forced));
        let (runner_up, merit) = (plan.choice.runner_up, plan.choice.merit.unwrap());
        assert_eq!(
            next["condition_number"]["runner_up"]["motion"].as_str().map(str::to_owned),
            runner_up.map(|(motion, _)| format!("m{motion:02}"))
        );
        println!(
            "{} logs: m{:02}, α {}, margin {} m",
            logs.len(),
            plan.choice.motion,
            plan.alpha,
            plan.safety.margin_m
        );
        for (path, expected) in [
            ("/balance/alpha", plan.alpha),
            ("/balance/margin_m", plan.safety.margin_m),
            ("/balance/sure_margin_m", plan.safety.sure_margin_m),
            ("/balance/largest_alpha", plan.safety.largest_reduction),
            ("/merit", merit),
        ] {
            let found = number(path);
            assert!((found - expected).abs() <= 1e-9 * expected.abs(), "{path}: {found}, {expected}");
        }
    }
}

#[test]
fn both_refuse_where_no_motion_keeps_the_balance() {
    let scene = Scene::new(&urdf());
    // A sole of nine millimetres.
    let text = next_scene::SUPPORT.replace("0.22", "0.0044").replace("0.2,", "0.004,");
    std::fs::write(scene.path("support.toml"), text).unwrap();
    let line = "next --urdf DIR/robot.urdf --motions DIR/motions --out DIR/next.csv --support \
         DIR/support.toml --false-fall-rate 0.001 --base-error 0.02";
    let (status, _, message) = scene.run(line);
    assert_eq!(status, 2);
    let refusal = curriculum_plan(&scene, &[], 0.02, &TorqueOptimalPerSecond).unwrap_err();
    assert!(matches!(refusal, CurriculumError::NothingSafe { motions: 20, .. }), "{refusal}");
    let same = refusal.to_string();
    assert!(message.contains(same.split(';').next().unwrap()), "{message}, {same}");
}

/// A first log after which something was undetermined had the condition number ∞, over which any later one is
/// nothing: α fell to 0, and all motions that stay on the support were allowed at once.
#[test]
fn a_first_log_that_leaves_parameters_undetermined_does_not_open_every_motion() {
    let scene = Scene::new(&urdf());
    let robot = tree(&urdf(), false);
    let joints: Vec<String> = robot.joint_names().map(str::to_owned).collect();
    let mut log = Recording::from_csv(&scene.path("log_1.csv"), &joints, TorqueColumns::Required).unwrap();
    let rest = [0.0; JOINTS];
    let mut torque = [0.0; JOINTS];
    let mut workspace = phiw_dynamics::Workspace::new(&robot);
    robot.inverse_dynamics(&rest, &rest, &rest, &mut workspace, &mut torque).unwrap();
    for (q, tau) in log.q.chunks_exact_mut(JOINTS).zip(log.tau.chunks_exact_mut(JOINTS)) {
        q[1..].fill(0.0);
        tau[1..].copy_from_slice(&torque[1..]);
    }
    (log.qd, log.qdd) = (None, None);
    log.write_csv(&scene.path("still.csv")).unwrap();
    let support = "--support DIR/support.toml --false-fall-rate 0.001 --base-error 0.02 --declare viscous_friction --measured DIR/still.csv";
    let alpha = |logs: &str| {
        let (_, _, report) = scene.next(&format!("{support} {logs}"));
        (
            report["next"]["balance"]["alpha"].as_f64().unwrap(),
            report["next"]["condition_number"]["before"].clone(),
        )
    };
    let (first, before) = alpha("");
    assert_eq!(before, Value::Null, "cond must be infinite for this test to test anything");
    let (second, before) = alpha("DIR/log_1.csv");
    assert!(before.as_f64().is_some(), "{before}");
    assert!((second - 0.8 * first).abs() < 1e-6, "α goes from {first} to {second}");
}
