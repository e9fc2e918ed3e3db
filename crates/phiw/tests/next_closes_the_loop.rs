//! `phiw next` with a simulated robot behind it, which knows nothing but files: five iterations give what the
//! curriculum gives in one process, since both plan alike and estimate alike.

use crate::next_scene;
use crate::synthetic;

use next_scene::{JOINTS, Scene, tree, urdf};
use phiw_curriculum::constraint::{FalseFalls, ZmpConstraint};
use phiw_curriculum::end::FixedCount;
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::relaxation::ConditionRelaxation;
use phiw_curriculum::selection::{MotionCandidates, TorqueOptimalPerSecond};
use phiw_curriculum::{Curriculum, CurriculumError, CurriculumRun, CurriculumSettings, Experiment, Trial};
use phiw_dynamics::{AnalyticBackend, DimensionError, Tree, World};
use phiw_effects::Catalogue;
use phiw_estimation::{ConcentratedLikelihood, Robot, RobotModel, RowsAt};
use phiw_identification::model::with_masses;
use phiw_plant::{ComputedTorque, Friction, Gains, PlantEffect, Sensors, Timing, TorqueModel};
use phiw_simulated_robot::{Controller, Encoders, FeedForward, KnownOfController, Measuring, SimulatedRobot};
use phiw_telemetry::{Recording, TorqueColumns};
use phiw_zmp::{Stance, SupportPolygon};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::sync::atomic::{AtomicU64, Ordering};

const ITERATIONS: u64 = 5;
/// What `phiw next` knows by default of the error of a URDF, and what it is told of the link on the floor.
const URDF_ERROR: f64 = 0.3;
const BASE_ERROR: f64 = 0.02;
const SOLE: [[f64; 2]; 4] = [[0.22, 0.2], [-0.2, 0.2], [-0.2, -0.2], [0.22, -0.2]];

/// What is believed at first: bodies that are too heavy or too light.
fn believed() -> String {
    [("<mass value=\"5\"/>", "<mass value=\"7.5\"/>"), ("<mass value=\"3\"/>", "<mass value=\"1.8\"/>")]
        .into_iter()
        .fold(urdf(), |text, (from, to)| text.replace(from, to))
        .replace("<mass value=\"1.5\"/>", "<mass value=\"2.1\"/>")
}

/// The robot, whose noise is that of the iteration alone.
struct Seeded {
    robot: SimulatedRobot,
    next: AtomicU64,
}

fn noise(iteration: u64) -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(900 + iteration)
}

impl Experiment for Seeded {
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        _: &mut dyn rand::Rng,
    ) -> Result<Trial, CurriculumError> {
        let iteration = self.next.fetch_add(1, Ordering::Relaxed);
        self.robot.perform(robot, model, motion, &mut noise(iteration))
    }
}

/// A controller that is given the file of `phiw next`: its torque, and the same gains.
struct Planned {
    plan: Recording,
    gains: Gains,
}

struct PlannedTorque(Recording);

impl TorqueModel for PlannedTorque {
    /// That of the row whose reference it is.
    fn torque(&mut self, q: &[f64], v: &[f64], _: &[f64], torque: &mut [f64]) -> Result<(), DimensionError> {
        let speeds = self.0.qd.as_ref().unwrap();
        let away = |row: &usize| -> f64 {
            let own = row * JOINTS..(row + 1) * JOINTS;
            let apart = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            apart(&self.0.q[own.clone()], q) + apart(&speeds[own], v)
        };
        let nearest = (0..self.0.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap();
        torque.copy_from_slice(&self.0.tau[nearest * JOINTS..(nearest + 1) * JOINTS]);
        Ok(())
    }
}

impl Controller for Planned {
    fn controller(&self, _: &Robot, _: &RobotModel) -> Result<ComputedTorque, CurriculumError> {
        Ok(ComputedTorque::new(PlannedTorque(self.plan.clone()), self.gains.clone()))
    }
}

fn gains(tree: &Tree) -> Gains {
    Gains::critically_damped(tree, &[], &tree.neutral_configuration(), 6.0).unwrap()
}

/// The true robot, with noise in its motion and in its torque sensors, and encoders alone.
fn true_robot(
    tree: &Tree,
    controller: Box<dyn Controller>,
    controller_is: KnownOfController,
) -> SimulatedRobot {
    let friction = |(joint, &coefficient): (usize, &f64)| PlantEffect::Friction {
        joint,
        law: Friction::Viscous { coefficient },
    };
    SimulatedRobot {
        tree: tree.clone(),
        world: World::default(),
        effects: synthetic::VISCOUS.iter().enumerate().map(friction).collect(),
        controller,
        actuator_noise: 0.02,
        sensors: Sensors::exact(0.01),
        timing: Timing { longest_step_s: 1e-3, settle_s: 0.2, ..Timing::default() },
        fall_tilt_rad: 0.3,
        stance: None,
        stillness: Default::default(),
        noise_correlation: 0.0,
        measuring: Measuring {
            encoders: Some(Encoders::new(17, 1e-3)),
            torque_noise: 0.02,
            controller: controller_is,
            ..Measuring::default()
        },
        build: Box::new(|tree, world| Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))),
    }
}

struct Figures {
    motions: Vec<String>,
    alpha: Vec<f64>,
    margin: Vec<f64>,
    condition_number: Vec<f64>,
    parameters: Vec<f64>,
    misfit: Vec<f64>,
}

fn declared(scene: &Scene) -> (Tree, Robot, MotionDataset) {
    let fixed = tree(&believed(), false);
    let base_link = tree(&believed(), true).bodies()[0].inertial;
    let robot = Robot::with_viscous_friction(fixed.clone(), base_link, Catalogue::default()).unwrap();
    let joints: Vec<String> = fixed.joint_names().map(str::to_owned).collect();
    let motion = |number: usize| {
        let path = scene.path(&format!("motions/m{number:02}.csv"));
        let recording = Recording::from_csv(&path, &joints, TorqueColumns::Absent).unwrap();
        Motion::from_recording(&format!("m{number:02}"), "", &recording).unwrap()
    };
    let dataset = MotionDataset::new(JOINTS, (0..20).map(motion).collect()).unwrap();
    (fixed, robot, dataset)
}

fn in_process(scene: &Scene, known: KnownOfController) -> Figures {
    let (fixed, robot, dataset) = declared(scene);
    let truth = tree(&urdf(), false);
    let initial = RobotModel { standard: with_masses(&fixed), ..robot.truth(&[0.0; JOINTS]).unwrap() };
    let candidates = MotionCandidates::new(&robot, robot.declared(), &dataset, &[1.0; JOINTS]).unwrap();
    let controller = Box::new(FeedForward { gains: gains(&truth) });
    let experiment = Seeded { robot: true_robot(&truth, controller, known), next: AtomicU64::new(0) };
    let stance = Stance::new(SupportPolygon::from_points(&SOLE).unwrap(), [0.0; 2], 0.0).unwrap();
    let constraint = ZmpConstraint::new(stance).counting(FalseFalls {
        belief_share: URDF_ERROR,
        base_link_share: BASE_ERROR,
        ..FalseFalls::default()
    });
    let estimator = ConcentratedLikelihood::new(initial.clone());
    let curriculum = Curriculum {
        robot: &robot,
        dataset: &dataset,
        candidates: &candidates,
        experiment: &experiment,
        selection: &TorqueOptimalPerSecond,
        constraint: &constraint,
        relaxation: &ConditionRelaxation::default(),
        estimator: &estimator,
        growth: None,
        end: &FixedCount(ITERATIONS as usize),
        rows_at: RowsAt::Periods,
        settings: CurriculumSettings::default(),
    };
    let mut run = CurriculumRun::new(0, initial);
    curriculum.run::<CurriculumError>(&mut run, |_| Ok(())).unwrap();
    Figures {
        motions: run.history.iter().map(|record| record.motion.clone()).collect(),
        alpha: run.history.iter().map(|record| record.alpha).collect(),
        margin: run
            .history
            .iter()
            .flat_map(|record| [record.margin_m.unwrap(), record.sure_margin_m.unwrap()])
            .collect(),
        condition_number: run.history.iter().map(|record| record.condition_number.unwrap()).collect(),
        parameters: run.model.parameters(&robot).unwrap()[..robot.base().count()].to_vec(),
        misfit: run.history.last().unwrap().misfit.iter().map(|misfit| misfit.chi_squared).collect(),
    }
}

fn through_files(scene: &Scene, known: KnownOfController) -> Figures {
    let (_, robot, dataset) = declared(scene);
    let truth = tree(&urdf(), false);
    let mut figures = Figures {
        motions: Vec::new(),
        alpha: Vec::new(),
        margin: Vec::new(),
        condition_number: Vec::new(),
        parameters: Vec::new(),
        misfit: Vec::new(),
    };
    let mut logs = String::new();
    for iteration in 0..=ITERATIONS {
        let measured = if logs.is_empty() { String::new() } else { format!("--measured{logs}") };
        let more = format!(
            "--support DIR/support.toml --false-fall-rate 0.001 --base-error {BASE_ERROR} --declare viscous_friction {measured}"
        );
        let (_, _, report) = scene.next(&more);
        let next = &report["next"];
        assert_eq!(next["estimate"]["source"], if iteration == 0 { "urdf" } else { "controlled_logs" });
        let number = |path: &str| next.pointer(path).and_then(serde_json::Value::as_f64).unwrap();
        if iteration > 0 {
            figures.condition_number.push(number("/condition_number/before"));
        }
        if iteration == ITERATIONS {
            let parameters = next["estimate"]["base_parameters"].as_array().unwrap();
            figures.parameters = parameters.iter().map(|own| own["value"].as_f64().unwrap()).collect();
            let misfit = next["estimate"]["misfit"].as_object().unwrap();
            figures.misfit = misfit.values().map(|own| own["chi_squared"].as_f64().unwrap()).collect();
            break;
        }
        figures.alpha.push(number("/balance/alpha"));
        figures.margin.extend([number("/balance/margin_m"), number("/balance/sure_margin_m")]);
        let name = next["motion"].as_str().unwrap().to_owned();
        let motion = dataset.motions().iter().find(|motion| motion.name == name).unwrap();
        figures.motions.push(name);
        let controller = Box::new(Planned { plan: scene.planned(), gains: gains(&truth) });
        let experiment = true_robot(&truth, controller, known);
        // What the robot is given to believe is not used: its torques are the file's.
        let nothing = robot.truth(&[0.0; JOINTS]).unwrap();
        let (_, logged) = experiment.perform_logged(&robot, &nothing, motion, &mut noise(iteration)).unwrap();
        let file = format!("run_{iteration}.csv");
        logged.write_csv(&scene.path(&file)).unwrap();
        logs += &format!(" DIR/{file}");
    }
    figures
}

#[test]
fn five_iterations_through_files_are_those_of_the_curriculum() {
    both_are_the_same(KnownOfController::Commands, 1e-6, 0.3);
}

/// Logs without commands, that say what the controller was asked for and not with which gains it answered:
/// `qref.<joint>`. The file has positions alone: speeds and accelerations of the reference are differences of
/// them, so that the numbers are not those to the last digit.
#[test]
fn five_iterations_through_files_that_know_the_reference_alone_are_those_of_the_curriculum() {
    both_are_the_same(KnownOfController::Reference, 5e-3, 0.3);
}

/// In process and through files, to a share of `tolerance`; at the end the error is less than this share of
/// the first belief's.
fn both_are_the_same(known: KnownOfController, tolerance: f64, share: f64) {
    let scene = Scene::new(&believed());
    let (own, files) = (in_process(&scene, known), through_files(&scene, known));
    println!("motions {:?}, cond {:?}", files.motions, files.condition_number);
    assert_eq!(own.motions, files.motions);
    let all = |figures: &Figures| {
        [&figures.alpha, &figures.margin, &figures.condition_number].map(Clone::clone).concat()
    };
    let apart = |own: &[f64], files: &[f64]| {
        let pairs = own.iter().zip(files);
        pairs.map(|(own, file)| (own - file).abs() / (1.0 + own.abs())).fold(0.0, f64::max)
    };
    let plans = apart(&all(&own), &all(&files));
    let parameters = apart(&own.parameters, &files.parameters);
    let misfits = apart(&own.misfit, &files.misfit);
    println!("apart at most: plans {plans:e}, parameters {parameters:e}, misfits {misfits:e}");
    // χ² is a square of small differences.
    assert!(plans.max(parameters) < tolerance && misfits < 20.0 * tolerance);
    // And they are right.
    let (_, robot, _) = declared(&scene);
    let truth = robot.base().from_standard(&tree(&urdf(), false).inertial_parameters()).unwrap();
    let first = robot.base().from_standard(&tree(&believed(), false).inertial_parameters()).unwrap();
    let error = |w: &[f64]| w.iter().zip(&truth).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
    println!("error {} from {}", error(&files.parameters), error(&first));
    assert!(error(&files.parameters) < share * error(&first));
}
