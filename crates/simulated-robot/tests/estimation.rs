//! Estimators on a robot that is known.

use crate::arm;

use arm::Arm;
use phiw_curriculum::{Experiment, unreliable_model};
use phiw_estimation::{
    Estimate, Estimator, Evidence, LeastSquares, MotionLikelihood, MotionLog, NewtonSettings, ParameterPrior,
    RowsAt, WeightedLeastSquares,
};
use phiw_identification::Design;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// All motions, measured with the true model in the controller.
fn measure(arm: &Arm, rows_at: RowsAt, motions: usize) -> (Design, Evidence) {
    let design = arm.robot.design(arm.robot.declared()).unwrap();
    let mut evidence = Evidence::none(&design, rows_at).unwrap();
    let experiment = arm.experiment();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for motion in &arm.dataset.motions()[..motions] {
        let trial = experiment.perform(&arm.robot, &arm.truth, motion, &mut rng).unwrap();
        evidence.add(&design, &trial.measured).unwrap();
    }
    (design, evidence)
}

fn estimate(arm: &Arm, estimator: &dyn Estimator, design: &Design, evidence: &Evidence) -> Estimate {
    let initial = unreliable_model(&arm.truth, 5);
    estimator.estimate(design, evidence, &initial, &initial.parameters(&arm.robot).unwrap()).unwrap()
}

fn rms(left: &[f64], right: &[f64]) -> f64 {
    let sum: f64 = left.iter().zip(right).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / left.len() as f64).sqrt()
}

#[test]
fn without_noise_every_estimator_finds_the_truth() {
    let arm = Arm { noise: 0.0, ..Arm::new(0.0) };
    let (design, evidence) = measure(&arm, RowsAt::Periods, 6);
    let truth = arm.truth.parameters(&arm.robot).unwrap();
    let quiet = MotionLikelihood::new(vec![1e-3; 7]);
    for estimator in [&LeastSquares as &dyn Estimator, &WeightedLeastSquares, &quiet] {
        let found = estimate(&arm, estimator, &design, &evidence).parameters;
        let error = rms(&found, &truth) / rms(&truth, &vec![0.0; truth.len()]);
        assert!(error < 2e-3, "{}: {error}", estimator.name());
    }
}

/// The noise moves the robot: least squares takes it for physics, however long the log.
#[test]
fn noise_inside_the_loop_biases_least_squares_and_not_the_likelihood() {
    let arm = Arm::new(0.05);
    let (design, evidence) = measure(&arm, RowsAt::Periods, 6);
    let truth = arm.truth.parameters(&arm.robot).unwrap();
    let found = estimate(&arm, &arm.estimator(), &design, &evidence);
    let least_squares = estimate(&arm, &LeastSquares, &design, &evidence).parameters;
    let (likely, plain) = (rms(&found.parameters, &truth), rms(&least_squares, &truth));
    assert!(likely < 0.3 * plain, "{likely} against {plain}");
    // Errors are as large as it says they are.
    let standardised: Vec<f64> =
        (0..truth.len()).map(|k| (found.parameters[k] - truth[k]) / found.standard_deviations[k]).collect();
    let spread = rms(&standardised, &vec![0.0; truth.len()]);
    assert!((0.5..1.6).contains(&spread), "{spread}");
}

#[test]
fn the_likelihood_has_one_minimum_wherever_it_is_sought_from() {
    let arm = Arm::new(0.05);
    let (design, evidence) = measure(&arm, RowsAt::Periods, 2);
    let estimator = MotionLikelihood {
        newton: NewtonSettings { settled: 1e-5, ..NewtonSettings::default() },
        ..arm.estimator()
    };
    let from = |seed: u64| {
        let initial = unreliable_model(&arm.truth, seed);
        let w = initial.parameters(&arm.robot).unwrap();
        estimator.estimate(&design, &evidence, &initial, &w).unwrap()
    };
    let first = from(1);
    for seed in 2..5 {
        let other = from(seed);
        for k in 0..first.parameters.len() {
            let distance = (first.parameters[k] - other.parameters[k]).abs() / first.standard_deviations[k];
            assert!(distance < 0.01, "parameter {k} is {distance} standard deviations away from seed {seed}");
        }
    }
}

#[test]
fn what_rows_do_not_determine_keeps_its_present_value() {
    let arm = Arm::new(0.0);
    let design = arm.robot.design(arm.robot.declared()).unwrap();
    let mut evidence = Evidence::none(&design, RowsAt::Periods).unwrap();
    // A robot that only holds a posture tells of its gravity torques and of nothing else.
    let joints = 7;
    let q: Vec<f64> = (0..joints).map(|joint| 0.2 + 0.1 * joint as f64).collect();
    let mut tau = vec![0.0; joints];
    let rest = vec![0.0; joints];
    let mut workspace = phiw_dynamics::Workspace::new(&arm.tree);
    arm.tree.inverse_dynamics(&q, &rest, &rest, &mut workspace, &mut tau).unwrap();
    let rows = 40;
    let measured = MotionLog {
        joints,
        period_s: 0.01,
        q: q.repeat(rows),
        qd: vec![0.0; joints * rows],
        qdd: Vec::new(),
        tau: tau.repeat(rows),
        ..MotionLog::default()
    };
    evidence.add(&design, &measured).unwrap();
    let initial = unreliable_model(&arm.truth, 9);
    let present = initial.parameters(&arm.robot).unwrap();
    let found = LeastSquares.estimate(&design, &evidence, &initial, &present).unwrap();
    let kept = (0..present.len()).filter(|&k| found.parameters[k] == present[k]).count();
    assert!(kept >= present.len() - joints, "{kept} of {}", present.len());
    // What was learnt explains the torques, with what was kept.
    let model = initial.with_parameters(&arm.robot, arm.robot.declared(), &found.parameters).unwrap();
    let mut predicted = vec![0.0; joints];
    let tree = model.tree(&arm.robot).unwrap();
    tree.inverse_dynamics(&q, &rest, &rest, &mut workspace, &mut predicted).unwrap();
    for joint in 0..joints {
        assert!(
            (predicted[joint] - tau[joint]).abs() < 1e-6,
            "{joint}: {} is not {}",
            predicted[joint],
            tau[joint]
        );
    }
}

/// Without a log the estimate is the prior; what one log does not tell is the prior's, and logs that tell
/// much overrule it.
#[test]
fn a_prior_decides_what_logs_do_not() {
    let noisy = Arm::new(0.05);
    // The slowest motion alone leaves much to the noise.
    let (design, evidence) = measure(&noisy, RowsAt::Periods, 1);
    let quiet = Arm::new(0.002);
    let (_, plenty) = measure(&quiet, RowsAt::Periods, 6);
    let truth = noisy.truth.parameters(&noisy.robot).unwrap();
    let mut ratios = Vec::new();
    for seed in 20..25 {
        let initial = unreliable_model(&noisy.truth, seed);
        let first = initial.parameters(&noisy.robot).unwrap();
        let believing = |arm: &Arm| arm.estimator().believing(ParameterPrior::unreliable(initial.clone()));
        let nothing = Evidence::none(&design, RowsAt::Periods).unwrap();
        let present = unreliable_model(&noisy.truth, seed + 100);
        let w = present.parameters(&noisy.robot).unwrap();
        let found = believing(&noisy).estimate(&design, &nothing, &present, &w).unwrap();
        for k in 0..first.len() {
            let distance = (found.parameters[k] - first[k]).abs() / found.standard_deviations[k];
            assert!(distance < 1e-3, "parameter {k} is {distance} standard deviations from the prior");
        }
        let of = |estimator: &MotionLikelihood, evidence: &Evidence| {
            estimator.estimate(&design, evidence, &initial, &first).unwrap().parameters
        };
        let error = |estimator: &MotionLikelihood| rms(&of(estimator, &evidence), &truth);
        ratios.push(error(&believing(&noisy)) / error(&noisy.estimator()));
        let (with, without) = (of(&believing(&quiet), &plenty), of(&quiet.estimator(), &plenty));
        let moved = rms(&with, &without) / rms(&first, &truth);
        assert!(moved < 0.02, "the prior moves what is known by {moved} of the first error");
    }
    let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
    assert!(mean < 0.5, "{ratios:?} of the error without the prior");
}

#[test]
fn a_prior_that_is_never_wrong_is_an_error_that_says_so() {
    let arm = Arm::new(0.05);
    let (design, evidence) = measure(&arm, RowsAt::Periods, 1);
    let w = arm.truth.parameters(&arm.robot).unwrap();
    let certain = arm.estimator().believing(ParameterPrior { model: arm.truth.clone(), share: 0.0 });
    let error = certain.estimate(&design, &evidence, &arm.truth, &w).unwrap_err().to_string();
    assert!(error.contains("a prior may be wrong is 0: it must be finite and > 0"), "{error}");
}

#[test]
fn evidence_comes_back_from_text_to_the_last_bit() {
    let arm = Arm::new(0.05);
    let (_, evidence) = measure(&arm, RowsAt::Stamps, 2);
    let text = serde_json::to_string(&evidence).unwrap();
    let back: Evidence = serde_json::from_str(&text).unwrap();
    assert_eq!(serde_json::to_string(&back).unwrap(), text);
    for (left, right) in evidence.factor().groups().iter().zip(back.factor().groups()) {
        assert_eq!(left.factor, right.factor);
    }
}

#[test]
fn a_standing_noise_of_nothing_is_an_error_that_says_so() {
    let arm = Arm::new(0.05);
    let (design, evidence) = measure(&arm, RowsAt::Periods, 1);
    let w = arm.truth.parameters(&arm.robot).unwrap();
    let noiseless = MotionLikelihood::new(vec![0.0; 7]);
    let error = noiseless.estimate(&design, &evidence, &arm.truth, &w).unwrap_err().to_string();
    assert!(error.contains("must be finite and > 0"), "{error}");
}
