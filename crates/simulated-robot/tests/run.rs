//! Whole runs: what they reach, that they are the same however they are interrupted, and that falls count.

use crate::arm;

use arm::Arm;
use phiw_curriculum::constraint::{Believed, Constraint, Safety};
use phiw_curriculum::end::{EndReason, FixedCount};
use phiw_curriculum::motion::Motion;
use phiw_curriculum::relaxation::{ConditionRelaxation, Learnt, Maximum, Relaxation};
use phiw_curriculum::selection::{Choice, Question, Selection};
use phiw_curriculum::{Curriculum, CurriculumError, CurriculumRun, Experiment, Trial, unreliable_model};
use phiw_estimation::{Robot, RobotModel};
use phiw_simulated_robot::*;
use rand::Rng;

fn rms(left: &[f64], right: &[f64]) -> f64 {
    let sum: f64 = left.iter().zip(right).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / left.len() as f64).sqrt()
}

fn text(run: &CurriculumRun) -> String {
    serde_json::to_string(run).unwrap()
}

#[test]
fn a_bad_model_becomes_a_good_one() {
    let arm = Arm::new(0.02);
    let (experiment, estimator, end) = (arm.experiment(), arm.estimator(), FixedCount(4));
    let curriculum = arm.curriculum(&experiment, &estimator, &end);
    let truth = arm.truth.parameters(&arm.robot).unwrap();
    let mut run = CurriculumRun::new(1, unreliable_model(&arm.truth, 1));
    let error = |model: &RobotModel| rms(&model.parameters(&arm.robot).unwrap(), &truth);
    let before = error(&run.initial);
    curriculum.run::<CurriculumError>(&mut run, |_| Ok(())).unwrap();
    assert_eq!((run.history.len(), run.ended), (4, Some(EndReason::Count)));
    assert!(error(&run.model) < 0.3 * before, "{} from {before}", error(&run.model));
    assert!(run.history.iter().all(|record| record.condition_number.is_some_and(f64::is_finite)));
    let uncertainties: Vec<f64> = run.history.iter().filter_map(|record| record.torque_uncertainty).collect();
    assert!(
        uncertainties.len() == 4 && uncertainties.windows(2).all(|pair| pair[1] < pair[0]),
        "{uncertainties:?}"
    );
    // Nothing more happens to a run that has ended.
    let ended = text(&run);
    curriculum.step(&mut run).unwrap();
    assert_eq!(text(&run), ended);
}

/// Killed after any iteration, written and read back, on one thread or many: the same to the last bit.
#[test]
fn a_run_is_the_same_however_it_is_interrupted() {
    let arm = Arm::new(0.05);
    let (experiment, estimator, end) = (arm.experiment(), arm.estimator(), FixedCount(3));
    let curriculum = arm.curriculum(&experiment, &estimator, &end);
    let start = || CurriculumRun::new(7, unreliable_model(&arm.truth, 7));
    let mut undisturbed = start();
    curriculum.run::<CurriculumError>(&mut undisturbed, |_| Ok(())).unwrap();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().unwrap();
    for killed_after in 0..3 {
        let mut run = start();
        (0..killed_after).for_each(|_| curriculum.step(&mut run).unwrap());
        let mut resumed: CurriculumRun = serde_json::from_str(&text(&run)).unwrap();
        pool.install(|| curriculum.run::<CurriculumError>(&mut resumed, |_| Ok(()))).unwrap();
        assert_eq!(text(&resumed), text(&undisturbed), "killed after {killed_after}");
    }
}

#[test]
fn another_seed_is_another_run() {
    let arm = Arm::new(0.05);
    let (experiment, estimator, end) = (arm.experiment(), arm.estimator(), FixedCount(1));
    let curriculum = arm.curriculum(&experiment, &estimator, &end);
    let initial = unreliable_model(&arm.truth, 1);
    let mut runs = [CurriculumRun::new(1, initial.clone()), CurriculumRun::new(2, initial)];
    runs.iter_mut().for_each(|run| curriculum.step(run).unwrap());
    assert_ne!(runs[0].model, runs[1].model);
}

/// A robot that falls on every motion but one.
struct Clumsy {
    safe: &'static str,
    robot: SimulatedRobot,
}

impl Experiment for Clumsy {
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<Trial, CurriculumError> {
        let trial = self.robot.perform(robot, model, motion, rng)?;
        Ok(Trial { fell_at_s: (motion.name != self.safe).then_some(1.0), ..trial })
    }
}

#[test]
fn a_fall_teaches_nothing_and_is_not_repeated() {
    let arm = Arm::new(0.05);
    let (estimator, end) = (arm.estimator(), FixedCount(6));
    let experiment = Clumsy { safe: "sine_0", robot: arm.experiment() };
    let curriculum = arm.curriculum(&experiment, &estimator, &end);
    let mut run = CurriculumRun::new(3, unreliable_model(&arm.truth, 3));
    curriculum.run::<CurriculumError>(&mut run, |_| Ok(())).unwrap();
    let fell = run.history.iter().filter(|record| record.fell_at_s.is_some());
    let mut names: Vec<&str> = fell.map(|record| record.motion.as_str()).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert!(count > 0 && names.len() == count && !names.contains(&"sine_0"), "{names:?}");
    for pair in run.history.windows(2).filter(|pair| pair[1].fell_at_s.is_some()) {
        assert_eq!(pair[0].model, pair[1].model);
    }
    assert_ne!(run.model, run.initial);
}

/// Always the first that is allowed.
struct First;

impl Selection for First {
    fn name(&self) -> &'static str {
        "first"
    }
    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        Choice { motion: question.allowed[0], merit: None, runner_up: None }
    }
}

/// Allows a motion up to an α that is its number over ten, and a little more: no test of equal numbers.
struct Numbered;

impl Constraint for Numbered {
    fn name(&self) -> &'static str {
        "numbered"
    }
    fn safety(&self, _: &Robot, _: &Believed<'_>, motion: &Motion) -> Result<Safety, CurriculumError> {
        let number: f64 = motion.name.trim_start_matches("sine_").parse().unwrap();
        Ok(Safety { largest_reduction: 0.1 * number + 1e-9, margin_m: 0.0, sure_margin_m: 0.0 })
    }
}

#[test]
fn the_constraint_lets_more_in_as_it_is_relaxed() {
    let arm = Arm::new(0.05);
    let (experiment, estimator, end) = (arm.experiment(), arm.estimator(), FixedCount(3));
    let curriculum = Curriculum {
        selection: &First,
        constraint: &Numbered,
        ..arm.curriculum(&experiment, &estimator, &end)
    };
    let mut run = CurriculumRun::new(3, unreliable_model(&arm.truth, 3));
    // One of six motions is 5 %, rounded up: the one that may be reduced most.
    let plan = curriculum.plan(&run).unwrap().unwrap();
    assert_eq!((plan.allowed, plan.alpha), (vec![5], 0.1 * 5.0 + 1e-9));
    curriculum.run::<CurriculumError>(&mut run, |_| Ok(())).unwrap();
    let alphas: Vec<f64> = run.history.iter().map(|record| record.alpha).collect();
    assert!((alphas[1] - 0.4).abs() < 1e-8, "{alphas:?}");
    let conds: Vec<f64> = run.history.iter().filter_map(|record| record.condition_number).collect();
    let learnt = Learnt {
        first_alpha: plan.alpha,
        first_condition_number: conds[0],
        condition_number: conds[1],
        torque_uncertainty: None,
    };
    assert_eq!(alphas[2], ConditionRelaxation::default().next(&learnt), "{conds:?}");
    assert_eq!(run.history[1].motion, "sine_4");
    assert!(!run.history.iter().any(|record| record.forced));
}

#[test]
fn where_nothing_is_allowed_the_safest_is_taken_and_it_is_said() {
    let arm = Arm::new(0.05);
    let (experiment, estimator, end) = (arm.experiment(), arm.estimator(), FixedCount(1));
    let strict = ConditionRelaxation { maximum: Maximum::Fixed(0.9), ..ConditionRelaxation::default() };
    let curriculum = Curriculum {
        constraint: &Numbered,
        relaxation: &strict,
        ..arm.curriculum(&experiment, &estimator, &end)
    };
    let mut run = CurriculumRun::new(3, unreliable_model(&arm.truth, 3));
    curriculum.step(&mut run).unwrap();
    let record = &run.history[0];
    assert_eq!((record.motion.as_str(), record.allowed, record.forced), ("sine_5", 0, true));
}
