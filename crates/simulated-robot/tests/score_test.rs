//! The score test: it foretells what a fit saves, finds what no residual's colour shows, and invents nothing.

use crate::arm;

use arm::Arm;
use phiw_curriculum::end::FixedCount;
use phiw_curriculum::growth::Growth;
use phiw_curriculum::{Curriculum, CurriculumError, CurriculumRun, Experiment, unreliable_model};
use phiw_estimation::{Estimator, Evidence, Gain, MotionLog, RobotModel, RowsAt};
use phiw_growth::ScoreTest;
use phiw_identification::EffectSpec;
use phiw_plant::{Coupling, Friction, Mechanism, PlantEffect};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The paper's noise: more than the torque of any secret here.
const NOISE: f64 = 0.05;

fn logs(arm: &Arm, secret: &[PlantEffect], seed: u64) -> Vec<MotionLog> {
    let mut experiment = arm.experiment();
    experiment.effects.extend_from_slice(secret);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let trial = |motion| experiment.perform(&arm.robot, &arm.truth, motion, &mut rng).unwrap().measured;
    arm.dataset.motions().iter().map(trial).collect()
}

fn test_of(arm: &Arm) -> ScoreTest {
    ScoreTest::new(arm.estimator())
}

fn secrets(arm: &Arm) -> [(PlantEffect, &'static str, usize); 3] {
    let effort = |joint: usize| arm.tree.joint(joint).limits.effort;
    let coulomb = Friction::Coulomb { torque: 0.035 * effort(1), width: 0.01 };
    let spring = Mechanism::Spring { stiffness: 0.1 * effort(5), rest: 0.2 };
    [
        (PlantEffect::Friction { joint: 1, law: coulomb }, "coulomb_friction", 1),
        (PlantEffect::Mechanism { joint: 5, law: spring }, "joint_spring", 5),
        (PlantEffect::RotorInertia { joint: 4, inertia: 0.008 }, "rotor_inertia", 4),
    ]
}

/// −log L of a model fitted to the logs.
fn negative_log_likelihood(arm: &Arm, model: &RobotModel, logs: &[MotionLog]) -> f64 {
    let design = arm.robot.design_of(model).unwrap();
    let mut evidence = Evidence::none(&design, RowsAt::Periods).unwrap();
    logs.iter().for_each(|log| evidence.add(&design, log).unwrap());
    arm.estimator()
        .negative_log_likelihood(&design, &evidence, &model.parameters(&arm.robot).unwrap())
        .unwrap()
        .unwrap()
}

#[test]
fn what_it_foretells_is_what_a_fit_saves() {
    let arm = Arm::new(NOISE);
    let test = test_of(&arm);
    for (index, (secret, kind, joint)) in secrets(&arm).into_iter().enumerate() {
        let logs = logs(&arm, &[secret], index as u64);
        let name = arm.tree.joint_names().nth(joint).unwrap();
        let spec = EffectSpec::new(kind, &[name]);
        let declared = test.fitted(&arm.robot, &arm.truth, &[], &logs).unwrap();
        let gains = arm.estimator().gains(&arm.robot, &declared, &logs, std::slice::from_ref(&spec)).unwrap();
        let foretold = gains[0].clone().unwrap();
        let grown = test.fitted(&arm.robot, &declared, &[spec], &logs).unwrap();
        let saved =
            negative_log_likelihood(&arm, &declared, &logs) - negative_log_likelihood(&arm, &grown, &logs);
        // A joint comes to rest by a friction that is there, and then tells more of it.
        let least = if kind == "coulomb_friction" { 0.2 } else { 0.75 };
        let is_near = |foretold: f64, found: f64| (least..1.25).contains(&(foretold / found));
        assert!(is_near(foretold.gain, saved), "{kind}: {} foretold, {saved} saved", foretold.gain);
        let fitted = &grown.effects.last().unwrap().parameters;
        for (&foretold, &fitted) in foretold.parameters.iter().zip(fitted) {
            assert!(is_near(foretold, fitted), "{kind}: {foretold} foretold, {fitted} fitted");
        }
    }
}

#[test]
fn an_effect_far_below_the_noise_of_a_row_is_found_in_many() {
    let arm = Arm::new(NOISE);
    let test = test_of(&arm);
    for (index, (secret, kind, joint)) in secrets(&arm).into_iter().enumerate() {
        let logs = logs(&arm, &[secret], index as u64);
        let declared = test.fitted(&arm.robot, &arm.truth, &[], &logs).unwrap();
        let ranked = test.rank(&arm.robot, &declared, &logs).unwrap();
        let best: Vec<_> =
            ranked.iter().take(3).map(|gain| (&gain.effect.kind, &gain.effect.joints, gain.merit)).collect();
        let found = test.look(&arm.robot, &declared, &logs, false, &[]).unwrap();
        let name = arm.tree.joint_names().nth(joint).unwrap();
        // In 18 s of this noise Coulomb and quadratic friction are nearly as likely: then one is the other's
        // rival.
        let is_it = |spec: &EffectSpec| spec.kind == kind && spec.joints == [name];
        let effects = found.effects();
        let [effect] = effects.as_slice() else { panic!("{kind}: {found:?}, {best:?}") };
        assert_eq!(effect.joints, [name], "{kind}: {best:?}");
        let named = is_it(effect) || ranked.iter().take(2).any(|gain| is_it(&gain.effect));
        assert!(named, "{kind}: {best:?}");
    }
}

/// Coulomb friction of all joints, of a hundredth of their torque limits.
fn frictions_of_all_joints(arm: &Arm) -> Vec<PlantEffect> {
    let friction = |joint: usize| {
        let torque = 0.01 * arm.tree.joint(joint).limits.effort;
        PlantEffect::Friction { joint, law: Friction::Coulomb { torque, width: 0.01 } }
    };
    (0..arm.tree.joint_count()).map(friction).collect()
}

/// Friction was taken of the velocity at the beginning of each period, and the noise turns it within the
/// period. Signs that turn over 0.1 rad/s were best, friction of some joints came out below nothing, and the
/// error of the rigid body's parameters was 0.026 where it is 0.014.
#[test]
fn frictions_that_the_noise_turns_within_a_period_are_friction() {
    let arm = Arm::new(0.02);
    let test = test_of(&arm);
    let logs = logs(&arm, &frictions_of_all_joints(&arm), 7);
    let fitted = |width: f64| {
        let spec = |joint: &str| EffectSpec::new("coulomb_friction", &[joint]).with("sign_width", width);
        let specs: Vec<EffectSpec> = arm.tree.joint_names().map(spec).collect();
        test.fitted(&arm.robot, &arm.truth, &specs, &logs).unwrap()
    };
    let model = fitted(0.01);
    let own = negative_log_likelihood(&arm, &model, &logs);
    for width in [0.003, 0.03] {
        let other = negative_log_likelihood(&arm, &fitted(width), &logs);
        assert!(other > own + 100.0, "{width} rad/s: {other}, and {own}");
    }
    for (joint, effect) in model.effects[arm.robot.declared().len()..].iter().enumerate() {
        let truth = 0.01 * arm.tree.joint(joint).limits.effort;
        let found = effect.parameters[0];
        assert!((found / truth - 1.0).abs() < 0.2, "{joint}: {found}, {truth} N·m");
    }
    let rigid = arm.robot.design(arm.robot.declared()).unwrap().base().count();
    let (found, truth) = (model.parameters(&arm.robot).unwrap(), arm.truth.parameters(&arm.robot).unwrap());
    let squares: f64 = found[..rigid].iter().zip(&truth).map(|(own, truth)| (own - truth).powi(2)).sum();
    let error = (squares / rigid as f64).sqrt();
    assert!(error < 0.016, "{error}");
}

/// A shaft that turns with the sum of two joints, its damping \[N·m·s/rad\] and its friction \[N·m\].
fn shared_friction(arm: &Arm) -> (PlantEffect, [f64; 2]) {
    let joints = [2, 3];
    let effort = joints.map(|joint| arm.tree.joint(joint).limits.effort);
    let torque = 0.02 * effort[0].min(effort[1]);
    let coefficient = 3.0 * torque;
    let shaft = Coupling::SharedFriction { joints, coefficient, torque, width: 0.01 };
    (PlantEffect::Coupling(shaft), [coefficient, torque])
}

fn coupling(arm: &Arm, terms: f64) -> EffectSpec {
    let joints = [2, 3].map(|joint| arm.tree.joint(joint).joint.as_str());
    EffectSpec::new("transmission_coupling", &joints).with("terms", terms)
}

/// A shaft between two joints comes to rest and turns within a period as a joint does.
#[test]
fn friction_of_a_sum_of_two_velocities_turns_within_a_period() {
    let arm = Arm::new(0.02);
    let test = test_of(&arm);
    let (secret, truth) = shared_friction(&arm);
    let logs = logs(&arm, &[secret], 3);
    let fitted = |width: f64| {
        let spec = coupling(&arm, 5.0).with("sign_width", width);
        let model = test.fitted(&arm.robot, &arm.truth, &[spec], &logs).unwrap();
        (negative_log_likelihood(&arm, &model, &logs), model.effects.last().unwrap().parameters.clone())
    };
    let (own, found) = fitted(0.01);
    for width in [0.003, 0.03] {
        let (other, _) = fitted(width);
        assert!(other > own, "{width} rad/s: {other}, and {own}");
    }
    for (found, truth) in found.iter().zip(truth) {
        assert!((found / truth - 1.0).abs() < 0.1, "{found}, not {truth}");
    }
}

/// A score may choose the friction alone, or an inertia that makes up for the width: fits choose again.
#[test]
fn damping_is_found_beside_the_friction_between_two_joints() {
    let arm = Arm::new(0.02);
    let test = test_of(&arm);
    let logs = logs(&arm, &[shared_friction(&arm).0], 3);
    let declared = test.fitted(&arm.robot, &arm.truth, &[], &logs).unwrap();
    let found = test.look(&arm.robot, &declared, &logs, false, &[]).unwrap().effects();
    let [effect] = found.as_slice() else { panic!("{found:?}") };
    let expected = coupling(&arm, 5.0);
    assert_eq!((&effect.kind, &effect.joints), (&expected.kind, &expected.joints), "{found:?}");
    assert_eq!(effect.constants["terms"], 5.0, "{found:?}");
}

/// Friction of all joints that no joint's score tells is one hypothesis; of a right model none is found.
#[test]
fn friction_of_all_joints_is_found_as_a_family() {
    // The paper's noise moves these joints so much that their friction is no sign of a speed any more; three
    // times this friction holds them fast.
    let arm = Arm::new(0.02);
    let test = test_of(&arm);
    let logs = logs(&arm, &frictions_of_all_joints(&arm), 7);
    let declared = test.fitted(&arm.robot, &arm.truth, &[], &logs).unwrap();
    let found = test.look(&arm.robot, &declared, &logs, false, &[]).unwrap();
    let family = found.answers.iter().find(|answer| answer.len() > 1);
    let family = family.unwrap_or_else(|| panic!("no family: {found:?}"));
    assert!(family.iter().all(|effect| effect.kind == "coulomb_friction"), "{found:?}");
    assert!(2 * family.len() > arm.tree.joint_count(), "{found:?}");
}

/// Twice the gain of a right model's missing effect is χ²: of all kinds on all joints none is worth its
/// price, and of an effect of one parameter the gain is ½ on average.
#[test]
fn a_right_model_lacks_nothing() {
    let arm = Arm::new(NOISE);
    let test = test_of(&arm);
    let (mut sum, mut count) = (0.0, 0);
    for seed in 0..3 {
        let logs = logs(&arm, &[], 100 + seed);
        let model = test.fitted(&arm.robot, &arm.truth, &[], &logs).unwrap();
        let ranked = test.rank(&arm.robot, &model, &logs).unwrap();
        let best = &ranked[0];
        assert!(best.merit < test.settings.least_merit, "seed {seed}: {best:?}");
        for joint in arm.tree.joint_names() {
            let offset = EffectSpec::new("torque_offset", &[joint]);
            let ripple = EffectSpec::new("asymmetric_friction", &[joint]).with("part", 0.0);
            let gains = arm.estimator().gains(&arm.robot, &model, &logs, &[offset, ripple]).unwrap();
            for gain in gains.into_iter().flatten() {
                sum += gain.gain;
                count += 1;
            }
        }
    }
    let mean = sum / f64::from(count);
    assert!((0.25..0.9).contains(&mean), "{mean} of {count}");
}

/// The offset of a spring is so nearly a weight that cond of all columns grew five-fold once the spring was
/// found: the constraint was never relaxed again, and the same motion was chosen four times.
#[test]
fn an_effect_that_was_found_does_not_change_what_cond_is_of() {
    let arm = Arm::new(0.02);
    let (spring, _, joint) = secrets(&arm)[1].clone();
    let mut experiment = arm.experiment();
    experiment.effects.push(spring);
    let (estimator, end) = (arm.estimator(), FixedCount(3));
    let growth = test_of(&arm);
    let curriculum = Curriculum { growth: Some(&growth), ..arm.curriculum(&experiment, &estimator, &end) };
    let mut run = CurriculumRun::new(1, unreliable_model(&arm.truth, 1));
    curriculum.run::<CurriculumError>(&mut run, |_| Ok(())).unwrap();
    let found = &run.model.effects[arm.robot.declared().len()..];
    let name = arm.tree.joint_names().nth(joint).unwrap();
    assert!(found.iter().any(|effect| effect.spec.joints == [name]), "{found:?}");
    let design = arm.robot.design(arm.robot.declared()).unwrap();
    let mut evidence = Evidence::none(&design, RowsAt::Periods).unwrap();
    run.logs.iter().for_each(|log| evidence.add(&design, log).unwrap());
    let declared = arm.candidates.measured(&evidence).unwrap().condition_number();
    let kept = run.history.last().unwrap().condition_number.unwrap();
    assert!((kept / declared - 1.0).abs() < 1e-6, "{kept}, not {declared}");
}

/// Widths were chosen by the score, which begins with no friction, where nothing sticks: 0.1 rad/s for 0.01.
#[test]
fn a_width_is_found_beside_the_friction_that_it_is_of() {
    let arm = Arm::new(0.02);
    let test = test_of(&arm);
    let logs = logs(&arm, &frictions_of_all_joints(&arm), 7);
    let spec = |joint: &str, width| EffectSpec::new("coulomb_friction", &[joint]).with("sign_width", width);
    let wide: Vec<EffectSpec> = arm.tree.joint_names().map(|joint| spec(joint, 0.1)).collect();
    let model = test.fitted(&arm.robot, &arm.truth, &wide, &logs).unwrap();
    let widths = [0.0025, 0.005, 0.01, 0.02, 0.04, 0.1];
    let tried: Vec<EffectSpec> =
        arm.tree.joint_names().flat_map(|joint| widths.map(|width| spec(joint, width))).collect();
    let gains = arm.estimator().exchanges(&arm.robot, &model, &logs, &tried).unwrap();
    let gains: Vec<Gain> = gains.into_iter().flatten().collect();
    assert_eq!(gains.len(), tried.len());
    let best = |own: &[Gain]| own.iter().max_by(|a, b| a.gain.total_cmp(&b.gain)).unwrap().clone();
    let best: Vec<Gain> = gains.chunks_exact(widths.len()).map(best).collect();
    for gain in &best {
        let width = gain.effect.constants["sign_width"];
        assert!((0.01..=0.02).contains(&width), "{:?}: {width} rad/s", gain.effect.joints);
    }
    // The width that the friction has saves next to nothing, and what is foretold is what a fit saves.
    for own in gains.chunks_exact(widths.len()) {
        assert!(own[widths.len() - 1].gain.abs() < 5.0, "{:?}", own[widths.len() - 1]);
    }
    let specs: Vec<EffectSpec> = best.iter().map(|gain| gain.effect.clone()).collect();
    let grown = test.fitted(&arm.robot, &model, &specs, &logs).unwrap();
    let saved = negative_log_likelihood(&arm, &model, &logs) - negative_log_likelihood(&arm, &grown, &logs);
    let foretold: f64 = best.iter().map(|gain| gain.gain).sum();
    assert!((0.8..=1.25).contains(&(foretold / saved)), "{foretold} foretold, {saved} saved");
}

/// An effect that is another kind's, has no velocity to turn with or is not in the model takes no place.
#[test]
fn what_takes_no_effects_place_is_no_exchange() {
    let arm = Arm::new(0.02);
    let logs = logs(&arm, &[], 7);
    let name = arm.tree.joint(2).joint.clone();
    let tried = [
        EffectSpec::new("coulomb_friction", &[&name]).with("sign_width", 0.01),
        EffectSpec::new("viscous_friction", &[&name]),
    ];
    let gains = arm.estimator().exchanges(&arm.robot, &arm.truth, &logs, &tried).unwrap();
    assert_eq!(gains, [None, None]);
}
