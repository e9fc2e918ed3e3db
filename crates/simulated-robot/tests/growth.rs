//! The loop closed: what nobody declared enters the model, nothing does where there is nothing, and rivals
//! are told apart.

use crate::arm;

use arm::Arm;
use phiw_curriculum::end::FixedCount;
use phiw_curriculum::growth::{Growth, Rivalry};
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::selection::MotionCandidates;
use phiw_curriculum::{Curriculum, CurriculumError, CurriculumRun, Experiment, unreliable_model};
use phiw_estimation::{Evidence, KnownEffect, RobotModel, RowsAt};
use phiw_growth::TraceResidual;
use phiw_identification::EffectSpec;
use phiw_plant::{Friction, Mechanism, PlantEffect};

/// Iterations of 3 s each; the tracer begins with the second.
const ITERATIONS: usize = 3;

fn trace_residual() -> TraceResidual {
    TraceResidual { least_s: 5.0, ..TraceResidual::default() }
}

/// Runs a curriculum over a plant with a secret, with or without growth.
fn run(arm: &Arm, secret: Option<&PlantEffect>, growth: Option<&dyn Growth>, seed: u64) -> CurriculumRun {
    let mut experiment = arm.experiment();
    experiment.effects.extend(secret.cloned());
    let (estimator, end) = (arm.estimator(), FixedCount(ITERATIONS));
    let curriculum = Curriculum { growth, ..arm.curriculum(&experiment, &estimator, &end) };
    let mut run = CurriculumRun::new(seed, unreliable_model(&arm.truth, seed));
    curriculum.run::<CurriculumError>(&mut run, |_| Ok(())).unwrap();
    run
}

/// Effects of a belief beside those declared: kind and joints.
fn found<'a>(arm: &Arm, model: &'a RobotModel) -> Vec<(&'a str, Vec<&'a str>)> {
    let found = &model.effects[arm.robot.declared().len()..];
    found
        .iter()
        .map(|effect| {
            (effect.spec.kind.as_str(), effect.spec.joints.iter().map(String::as_str).collect::<Vec<_>>())
        })
        .collect()
}

/// RMS torque error of a belief on a motion that no run had, of the plant with its secret, which moves
/// without noise.
fn torque_error(arm: &Arm, secret: &PlantEffect, model: &RobotModel) -> f64 {
    let mut experiment = Arm::new(0.0).experiment();
    experiment.effects.push(secret.clone());
    let motion = arm::motions(&arm.tree, 9).pop().unwrap();
    let mut rng = <rand_chacha::ChaCha8Rng as rand::SeedableRng>::seed_from_u64(99);
    let measured = experiment.perform(&arm.robot, &arm.truth, &motion, &mut rng).unwrap().measured;
    let design = arm.robot.design_of(model).unwrap();
    let mut evidence = Evidence::none(&design, RowsAt::Periods).unwrap();
    evidence.add(&design, &measured).unwrap();
    let factor = evidence.factor().combine(&vec![1.0; arm.tree.joint_count()]).unwrap();
    let squares = factor.residual_sum_of_squares(&model.parameters(&arm.robot).unwrap()).unwrap();
    (squares / factor.rows() as f64).sqrt()
}

#[test]
fn what_nobody_declared_is_found_where_it_is() {
    let arm = Arm::new(0.01);
    let effort = |joint: usize| arm.tree.joint(joint).limits.effort;
    // No more than the small gains overcome: of a joint that is stuck there is nothing to learn.
    let coulomb = Friction::Coulomb { torque: 0.02 * effort(3), width: 0.01 };
    let spring = Mechanism::Spring { stiffness: 0.3 * effort(5), rest: 0.2 };
    for (secret, kind, joint) in [
        (PlantEffect::Friction { joint: 3, law: coulomb }, "coulomb_friction", 3),
        (PlantEffect::Mechanism { joint: 5, law: spring }, "joint_spring", 5),
    ] {
        let open = run(&arm, Some(&secret), None, 1);
        let closed = run(&arm, Some(&secret), Some(&trace_residual()), 1);
        let name = arm.tree.joint_names().nth(joint).unwrap();
        let found = found(&arm, &closed.model);
        let [(named, joints)] = found.as_slice() else { panic!("{kind}: {found:?}") };
        // In 9 s over a small range the sine of a balancer is as straight as a spring.
        let twin = if kind == "joint_spring" { "gravity_balancer" } else { kind };
        assert!((*named == kind || *named == twin) && *joints == [name], "{kind}: {found:?}");
        let [without, with] = [&open, &closed].map(|run| torque_error(&arm, &secret, &run.model));
        assert!(with < 0.8 * without, "{kind}: {with} with the loop closed, {without} without");
        // Where the model has just grown there is nothing to compare its torques with.
        for pair in closed.history.windows(2) {
            assert_eq!(pair[1].torque_change.is_none(), pair[0].model.specs() != pair[1].model.specs());
        }
    }
}

#[test]
fn a_right_model_does_not_grow() {
    let arm = Arm::new(0.02);
    let closed = run(&arm, None, Some(&trace_residual()), 1);
    assert_eq!(found(&arm, &closed.model), []);
    // And is the one that it would have been without anybody looking.
    assert_eq!(closed.model, run(&arm, None, None, 1).model);
}

/// Killed after any iteration, while the model grows: the same to the last bit.
#[test]
fn a_growing_run_is_the_same_however_it_is_interrupted() {
    let arm = Arm::new(0.01);
    let torque = 0.02 * arm.tree.joint(3).limits.effort;
    let secret = PlantEffect::Friction { joint: 3, law: Friction::Coulomb { torque, width: 0.01 } };
    let mut experiment = arm.experiment();
    experiment.effects.push(secret);
    let (estimator, end, growth) = (arm.estimator(), FixedCount(3), trace_residual());
    let curriculum = Curriculum { growth: Some(&growth), ..arm.curriculum(&experiment, &estimator, &end) };
    let text = |run: &CurriculumRun| serde_json::to_string(run).unwrap();
    let mut undisturbed = CurriculumRun::new(5, unreliable_model(&arm.truth, 5));
    let mut saved = vec![text(&undisturbed)];
    curriculum
        .run::<CurriculumError>(&mut undisturbed, |run| {
            saved.push(text(run));
            Ok(())
        })
        .unwrap();
    assert!(undisturbed.model.effects.len() > arm.robot.declared().len(), "it did not grow");
    for (killed_after, saved) in saved.iter().enumerate().take(3) {
        let mut resumed: CurriculumRun = serde_json::from_str(saved).unwrap();
        curriculum.run::<CurriculumError>(&mut resumed, |_| Ok(())).unwrap();
        assert_eq!(text(&resumed), text(&undisturbed), "killed after {killed_after}");
    }
}

/// Motions of one joint each, `amplitude·sin(2πt)`; the others are still.
fn one_joint_each(joints: usize, amplitudes: &[f64]) -> Vec<Motion> {
    let motion = |(moved, &amplitude): (usize, &f64)| {
        let omega = std::f64::consts::TAU;
        let mut signals = [0; 3].map(|_| vec![0.0; 201 * joints]);
        for sample in 0..201 {
            let (sine, cosine) = (omega * 0.01 * sample as f64).sin_cos();
            let at = sample * joints + moved;
            signals[0][at] = amplitude * sine;
            signals[1][at] = amplitude * omega * cosine;
            signals[2][at] = -amplitude * omega * omega * sine;
        }
        Motion::new(&format!("joint_{moved}"), "alone", joints, 0.01, signals).unwrap()
    };
    amplitudes.iter().enumerate().map(motion).collect()
}

/// Beliefs that differ in one joint's friction by `difference` N·m·s/rad differ in the torque by
/// difference·q̇ there, and nowhere else.
#[test]
fn rivals_are_told_apart_by_the_motion_on_which_they_differ() {
    let arm = Arm::new(0.01);
    let (joints, moved, difference) = (arm.tree.joint_count(), 2, 0.3);
    let name = arm.tree.joint_names().nth(moved).unwrap();
    let belief = |kind: &str, value: f64| {
        let mut model = arm.truth.clone();
        model.effects.push(KnownEffect { spec: EffectSpec::new(kind, &[name]), parameters: vec![value] });
        model
    };
    // The same effect in two sizes: the difference is known in closed form.
    let rivalry = Rivalry {
        beliefs: [belief("viscous_friction", 0.1), belief("viscous_friction", 0.1 + difference)],
        effects: ["coulomb_friction", "viscous_friction"].map(|kind| EffectSpec::new(kind, &[name])),
    };
    // Others move more.
    let motions = one_joint_each(joints, &[0.5, 0.4, 0.1, 0.3, 0.2]);
    let scale: Vec<f64> = (0..joints).map(|joint| 2.0 + joint as f64).collect();
    for (index, motion) in motions.iter().enumerate() {
        let found = rivalry.difference(&arm.robot, motion, &scale, 0.02).unwrap();
        let rows = (0..motion.samples()).step_by(2);
        let squares =
            rows.clone().map(|row| (difference * motion.sample(row)[1][moved] / scale[moved]).powi(2));
        let expected = (squares.sum::<f64>() / (rows.count() * joints) as f64).sqrt();
        assert!((found - expected).abs() < 1e-12, "{index}: {found}, not {expected}");
    }
    let (experiment, estimator, end) = (arm.experiment(), arm.estimator(), FixedCount(1));
    let dataset = MotionDataset::new(joints, motions).unwrap();
    let candidates =
        MotionCandidates::new(&arm.robot, arm.robot.declared(), &dataset, &vec![1.0; joints]).unwrap();
    let curriculum = Curriculum {
        dataset: &dataset,
        candidates: &candidates,
        ..arm.curriculum(&experiment, &estimator, &end)
    };
    let mut run = CurriculumRun::new(1, arm.truth.clone());
    run.rivals.push(rivalry);
    let plan = curriculum.plan(&run).unwrap().unwrap();
    assert_eq!(plan.choice.motion, moved);
    assert_eq!(
        plan.separates,
        Some([format!("coulomb_friction [{name}]"), format!("viscous_friction [{name}]")])
    );
}
