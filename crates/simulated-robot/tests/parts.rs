//! The small parts: motions, relaxation, ends, beliefs, controllers.

use crate::arm;

use arm::{Arm, tree};
use phiw_curriculum::constraint::Safety;
use phiw_curriculum::end::{Certain, Converged, EndCriterion, EndReason, FixedCount};
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::relaxation::{
    ConditionRelaxation, Learnt, Maximum, Relaxation, Scale, UncertaintyRelaxation,
};
use phiw_curriculum::{CurriculumError, Experiment, IterationRecord, unreliable_model};
use phiw_dynamics::Workspace;
use phiw_effects::Catalogue;
use phiw_estimation::{Robot, RobotModel};
use phiw_identification::EffectSpec;
use phiw_simulated_robot::*;
use phiw_telemetry::Recording;
use proptest::prelude::*;

fn ramp(samples: usize) -> Motion {
    let q: Vec<f64> = (0..2 * samples).map(|index| index as f64).collect();
    Motion::new("ramp", "", 2, 0.1, [q.clone(), vec![1.0; 2 * samples], vec![0.0; 2 * samples]]).unwrap()
}

#[test]
fn a_motion_is_linear_between_its_samples_and_rests_at_its_end() {
    let motion = ramp(4);
    let at = |t_s: f64| {
        let mut signals = [0; 3].map(|_| vec![0.0; 2]);
        let [q, v, a] = &mut signals;
        motion.at(t_s, q, v, a);
        signals[0].clone()
    };
    for (t_s, expected) in
        [(0.0, [0.0, 1.0]), (0.1, [2.0, 3.0]), (0.05, [1.0, 2.0]), (0.3, [6.0, 7.0]), (9.0, [6.0, 7.0])]
    {
        for (found, expected) in at(t_s).iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{t_s}");
        }
    }
    // 0.3 is not three times 0.1 to a computer, and a sample is a sample all the same.
    assert_eq!(at(3.0 * 0.1), [6.0, 7.0]);
    assert_eq!((motion.samples(), motion.sample(1)[0]), (4, &[2.0, 3.0][..]));
}

#[test]
fn what_is_no_motion_says_what_it_lacks() {
    let check = |result: Result<Motion, CurriculumError>, expected: &str| {
        let error = result.unwrap_err().to_string();
        assert!(error.contains(expected), "{error:?} does not say {expected:?}");
    };
    let three = |length: usize| [0; 3].map(|_| vec![0.0; length]);
    check(Motion::new("m", "", 2, 0.1, three(2)), "two samples");
    check(Motion::new("m", "", 2, 0.1, three(5)), "two samples");
    check(Motion::new("m", "", 2, 0.0, three(6)), "period");
    let mut gap = three(6);
    gap[1][4] = f64::NAN;
    check(Motion::new("m", "", 2, 0.1, gap), "sample 2");
    let mut uneven = Recording {
        joints: vec!["a".to_owned()],
        t: vec![0.0, 0.1, 0.3],
        q: vec![0.0; 3],
        ..Recording::default()
    };
    check(Motion::from_recording("m", "", &uneven), "qd.<joint>");
    (uneven.qd, uneven.qdd) = (Some(vec![0.0; 3]), Some(vec![0.0; 3]));
    check(Motion::from_recording("m", "", &uneven), "not even");
    assert!(matches!(MotionDataset::new(2, Vec::new()), Err(CurriculumError::NoMotions)));
    assert!(MotionDataset::new(3, vec![ramp(3)]).unwrap_err().to_string().contains("2 joints"));
}

#[test]
fn five_percent_of_the_motions_pass_at_first() {
    let safety = |reduction: f64| Safety { largest_reduction: reduction, margin_m: 0.0, sure_margin_m: 0.0 };
    let motions: Vec<Safety> = (0..98).map(|index| safety(f64::from(index) / 100.0)).collect();
    let alpha = ConditionRelaxation::default().first(&motions);
    assert_eq!(motions.iter().filter(|safety| safety.largest_reduction >= alpha).count(), 5);
    // Nothing is safe: the whole region is all there is.
    assert_eq!(ConditionRelaxation::default().first(&[safety(-0.3), safety(f64::NEG_INFINITY)]), 0.0);
    let fixed = ConditionRelaxation { maximum: Maximum::Fixed(0.74), ..Default::default() };
    assert_eq!(fixed.first(&motions), 0.74);
}

#[test]
fn the_paper_s_numbers_relax_as_in_the_paper() {
    let paper = ConditionRelaxation { maximum: Maximum::Fixed(0.74), scale: Scale::Fixed(2.5e-4), bias: 1.0 };
    for (cond, expected) in [(1e6, 0.74), (2961.0, 0.74), (1201.0, 0.3), (1.0, 0.0)] {
        let learnt = Learnt {
            first_alpha: 0.74,
            first_condition_number: 3000.0,
            condition_number: cond,
            torque_uncertainty: None,
        };
        assert!((paper.next(&learnt) - expected).abs() < 1e-12, "{cond}");
    }
}

/// A motion that is done again makes σ_max of Φ larger and σ_min hardly: cond rises, and α went back to its
/// maximum, at which nothing was allowed but the safest motion, which was then done again. What was learnt of
/// the torques is never lost.
#[test]
fn a_motion_done_again_does_not_tighten_the_constraint() {
    let learnt = |cond: f64, now: Option<f64>| Learnt {
        first_alpha: 0.66,
        first_condition_number: 1.5e5,
        condition_number: cond,
        torque_uncertainty: now.map(|now| [0.02, now]),
    };
    let relaxation = UncertaintyRelaxation::default();
    let alphas = [(1.5e5, 0.02), (1.9e5, 0.01), (2.2e5, 0.008), (2.5e5, 0.007)].map(|(cond, now)| {
        (relaxation.next(&learnt(cond, Some(now))), ConditionRelaxation::default().next(&learnt(cond, None)))
    });
    assert!((alphas[0].0 - 0.8 * 0.66).abs() < 1e-12);
    assert!(alphas.windows(2).all(|pair| pair[1].0 < pair[0].0), "{alphas:?}");
    assert_eq!(alphas[3].1, 0.66);
    // Who does not know how sure he is relaxes nothing.
    assert_eq!(relaxation.next(&learnt(1.5e5, None)), 0.66);
}

proptest! {
    #[test]
    fn alpha_never_exceeds_its_first_value(first in 0.0..1.0_f64, before in 1.0..1e9_f64, cond in 1.0..1e9_f64) {
        let learnt = Learnt {
            first_alpha: first,
            first_condition_number: before,
            condition_number: cond,
            torque_uncertainty: None,
        };
        let alpha = ConditionRelaxation::default().next(&learnt);
        prop_assert!((0.0..=first).contains(&alpha), "{alpha}");
    }

    /// Believing the measured base parameters exactly, and else what was believed before.
    #[test]
    fn base_parameters_survive_the_way_through_standard_ones(seed in 0..50_u64, other in 50..100_u64) {
        let tree = tree();
        let robot = Robot::with_viscous_friction(tree.clone(), [0.0; 10], Catalogue::default()).unwrap();
        let truth = robot.truth(&[0.5; 7]).unwrap();
        let (belief, measured) = (unreliable_model(&truth, seed), unreliable_model(&truth, other));
        let w = measured.parameters(&robot).unwrap();
        let updated = belief.with_parameters(&robot, robot.declared(), &w).unwrap();
        for (found, expected) in updated.parameters(&robot).unwrap().iter().zip(&w) {
            prop_assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()));
        }
        let again = updated.with_parameters(&robot, robot.declared(), &w).unwrap();
        for (found, expected) in again.standard.iter().zip(&updated.standard) {
            prop_assert!((found - expected).abs() < 1e-9);
        }
    }
}

#[test]
fn the_bad_model_is_between_nothing_and_twice_the_truth() {
    let arm = Arm::new(0.0);
    let model = unreliable_model(&arm.truth, 4);
    let ratios = model.standard.iter().zip(&arm.truth.standard).filter(|(_, truth)| **truth != 0.0);
    let ratios: Vec<f64> = ratios.map(|(value, truth)| value / truth).collect();
    assert!(ratios.iter().all(|ratio| (0.0..2.0).contains(ratio)));
    assert!(ratios.iter().any(|ratio| *ratio < 0.3) && ratios.iter().any(|ratio| *ratio > 1.7));
    assert_eq!(model, unreliable_model(&arm.truth, 4));
}

fn record(cond: f64, change: f64) -> IterationRecord {
    let model = RobotModel { standard: Vec::new(), effects: Vec::new() };
    IterationRecord {
        motion: String::new(),
        choice: phiw_curriculum::selection::Choice { motion: 0, merit: None, runner_up: None },
        allowed: 1,
        forced: false,
        alpha: 0.5,
        margin_m: None,
        sure_margin_m: None,
        kept: None,
        fell_at_s: None,
        still_share: 1.0,
        tracking_error: Vec::new(),
        condition_number: Some(cond),
        torque_uncertainty: None,
        torque_change: Some(change),
        separates: None,
        model,
        standard_deviations: Vec::new(),
        misfit: Vec::new(),
    }
}

#[test]
fn a_curriculum_ends_when_nothing_moves_any_more() {
    let criterion = Converged::default();
    let history = [(3000.0, 0.5), (1500.0, 0.01), (1450.0, 0.05), (1440.0, 0.01)]
        .map(|(cond, change)| record(cond, change));
    let reasons: Vec<_> = (1..=4).map(|count| criterion.reason(&history[..count])).collect();
    assert_eq!(reasons, [None, None, None, Some(EndReason::Converged)]);
    assert_eq!(FixedCount(5).reason(&history), None);
    assert_eq!(FixedCount(4).reason(&history), Some(EndReason::Count));
    let long: Vec<_> = (0..10).map(|_| record(1000.0, 1.0)).collect();
    assert_eq!(criterion.reason(&long), Some(EndReason::Count));
}

#[test]
fn a_curriculum_ends_when_the_torques_are_known_as_well_as_was_asked() {
    let criterion = Certain { torque_uncertainty: 0.3, most: 4 };
    let history = [Some(0.9), None, Some(0.31), Some(0.3)]
        .map(|uncertainty| IterationRecord { torque_uncertainty: uncertainty, ..record(3000.0, 0.0) });
    let reasons: Vec<_> = (1..=4).map(|count| criterion.reason(&history[..count])).collect();
    assert_eq!(reasons, [None, None, None, Some(EndReason::Converged)]);
    let ignorant: Vec<_> = (0..4).map(|_| record(3000.0, 0.0)).collect();
    assert_eq!(criterion.reason(&ignorant), Some(EndReason::Count));
}

/// The feed-forward of a model with any effects is the torque of its columns.
#[test]
fn the_controller_s_torque_is_that_of_the_model() {
    use phiw_plant::Gains;
    let tree = tree();
    let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
    let mut specs: Vec<EffectSpec> =
        joints.iter().map(|joint| EffectSpec::new("viscous_friction", &[joint])).collect();
    specs.push(EffectSpec::new("coulomb_friction", &[&joints[2]]).with("width", 0.01));
    let robot = Robot::new(tree.clone(), [0.0; 10], specs, Catalogue::default()).unwrap();
    let mut values = vec![0.4; 7];
    values.push(3.0);
    let model = robot.truth(&values).unwrap();
    // Gains of nothing leave the feed-forward alone.
    let gains = Gains { position: vec![0.0; 7], velocity: vec![0.0; 7] };
    let experiment = SimulatedRobot {
        tree: tree.clone(),
        world: Default::default(),
        effects: Vec::new(),
        controller: Box::new(FeedForward { gains }),
        actuator_noise: 0.0,
        sensors: phiw_plant::Sensors::exact(0.01),
        timing: phiw_plant::Timing { settle_s: 0.0, ..Default::default() },
        fall_tilt_rad: 0.3,
        stance: None,
        stillness: Default::default(),
        noise_correlation: 0.0,
        measuring: Default::default(),
        build: Box::new(|tree, world| {
            Ok(Box::new(phiw_dynamics::AnalyticBackend::in_world(tree.clone(), world)?))
        }),
    };
    let motion = arm::motions(&tree, 1).remove(0);
    let mut rng = <rand_chacha::ChaCha8Rng as rand::SeedableRng>::seed_from_u64(1);
    let trial = experiment.perform(&robot, &model, &motion, &mut rng).unwrap();
    let mut workspace = Workspace::new(&tree);
    for sample in [0, 100, 200] {
        let [q, v, a] = motion.sample(sample);
        let mut torque = vec![0.0; 7];
        tree.inverse_dynamics(q, v, a, &mut workspace, &mut torque).unwrap();
        for joint in 0..7 {
            torque[joint] += 0.4 * v[joint] + if joint == 2 { 3.0 * (v[2] / 0.01).tanh() } else { 0.0 };
            let logged = trial.measured.tau[sample * 7 + joint];
            let limit = tree.joint(joint).limits.effort;
            assert!((logged - torque[joint].clamp(-limit, limit)).abs() < 1e-9, "{sample}, {joint}");
        }
    }
}
