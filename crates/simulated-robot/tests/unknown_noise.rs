//! A robot whose noise nobody knows: sensors that are not exact, and the estimator that finds the noise
//! out.

use crate::arm;

use arm::Arm;
use phiw_curriculum::{Experiment, unreliable_model};
use phiw_estimation::{
    ConcentratedLikelihood, Estimator, Evidence, EvidenceSettings, LeastSquares, MotionLog, RowsAt,
    TorqueNoise,
};
use phiw_identification::Design;
use phiw_simulated_robot::{Encoders, KnownOfController, LoggedTorque, Measuring, SimulatedRobot};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const CORRELATION: f64 = 0.5;

/// All motions of an arm with coloured noise in the motion, under the controller of the first belief.
fn measure(arm: &Arm, measuring: Measuring) -> (Design, Evidence) {
    let design = arm.robot.design(arm.robot.declared()).unwrap();
    let settings = EvidenceSettings { in_order: true, ..RowsAt::Periods.into() };
    let mut evidence = Evidence::none(&design, settings).unwrap();
    let experiment = SimulatedRobot { noise_correlation: CORRELATION, measuring, ..arm.experiment() };
    let initial = unreliable_model(&arm.truth, 5);
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    for motion in arm.dataset.motions() {
        let trial = experiment.perform(&arm.robot, &initial, motion, &mut rng).unwrap();
        evidence.add(&design, &trial.measured).unwrap();
    }
    (design, evidence)
}

fn rms(left: &[f64], right: &[f64]) -> f64 {
    let sum: f64 = left.iter().zip(right).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / left.len() as f64).sqrt()
}

struct Found {
    error: f64,
    least_squares: f64,
    initial: f64,
    /// RMS of the parameters' errors, each in its own standard deviation.
    deviations: f64,
    noise: Vec<TorqueNoise>,
}

fn found(measuring: Measuring) -> (Arm, Found) {
    found_at(0.05, measuring)
}

/// With noise of this standard deviation over the torque limits.
fn found_at(noise: f64, measuring: Measuring) -> (Arm, Found) {
    let arm = Arm::new(noise);
    let (design, evidence) = measure(&arm, measuring);
    let truth = arm.truth.parameters(&arm.robot).unwrap();
    let initial = unreliable_model(&arm.truth, 5);
    let start = initial.parameters(&arm.robot).unwrap();
    let estimator = ConcentratedLikelihood::new(initial.clone());
    let estimate = estimator.estimate(&design, &evidence, &initial, &start).unwrap();
    let own = estimate.parameters;
    let off = own.iter().zip(&truth).zip(&estimate.standard_deviations);
    let off: Vec<f64> = off.map(|((found, truth), std)| (found - truth) / std).collect();
    let deviations = rms(&off, &vec![0.0; off.len()]);
    let plain = LeastSquares.estimate(&design, &evidence, &initial, &start).unwrap().parameters;
    let noise = estimator.noise(&design, &evidence, &own).unwrap();
    let [error, least_squares, initial] = [&own, &plain, &start].map(|w| rms(w, &truth));
    (arm, Found { error, least_squares, initial, deviations, noise })
}

/// σ, ρ and where the noise is come with the parameters, from encoders and a torque sensor that is as bad as
/// the actuators.
#[test]
fn the_noise_is_found_with_the_parameters() {
    let measuring = Measuring {
        encoders: Some(Encoders::new(17, 1e-3)),
        torque_noise: 0.05,
        torque_noise_correlation: CORRELATION,
        ..Measuring::default()
    };
    let (arm, found) = found(measuring);
    assert!(found.error < found.initial, "{} from {}", found.error, found.initial);
    assert!(found.deviations < 2.5, "{} standard deviations", found.deviations);
    assert!(found.error < 0.5 * found.least_squares, "{}, (4): {}", found.error, found.least_squares);
    // The last joint's friction stops it within a period: no cubic follows that, and its noise comes
    // out small.
    for (joint, (noise, truth)) in found.noise.iter().zip(arm.torque_noise()).enumerate().take(6) {
        assert!((noise.std / truth - 1.0).abs() < 0.25, "{joint}: {noise:?}, {truth} N·m");
        assert!((noise.correlation - CORRELATION).abs() < 0.15, "{joint}: {noise:?}");
        assert!(noise.felt.abs() < 0.2, "{joint}: {noise:?}");
    }
}

/// A spline of the readings alone does not know that slow noise hardly changes from a period to the next:
/// with encoders, slow noise made the parameters twice as wrong as exact sensors did.
#[test]
fn slow_noise_and_encoders_ask_for_the_motion_under_the_belief() {
    let measuring = Measuring { encoders: Some(Encoders::new(13, 1e-3)), ..Measuring::default() };
    let arm = Arm::new(0.05);
    let (design, evidence) = measure(&arm, measuring);
    let truth = arm.truth.parameters(&arm.robot).unwrap();
    let initial = unreliable_model(&arm.truth, 5);
    let start = initial.parameters(&arm.robot).unwrap();
    let error = |smoothings: usize| {
        let mut estimator = ConcentratedLikelihood::new(initial.clone());
        estimator.settings.smoothings = smoothings;
        let found = estimator.estimate(&design, &evidence, &initial, &start).unwrap();
        rms(&found.parameters, &truth)
    };
    let (spline, smoothed) = (error(0), error(5));
    println!("spline {spline}, smoothed {smoothed}, at first {}", rms(&start, &truth));
    assert!(smoothed < 0.8 * spline, "{smoothed} from {spline}");
}

/// What encoders leave open of a motion was counted of the first motion alone: the noise of the others came
/// out small, so that the next smoothing left still less of it, and the more often the motion was found anew
/// the worse were the parameters. What is missing for it from the information of the parameters was not
/// counted at all: their errors were 2.5 standard deviations.
#[test]
fn what_encoders_leave_open_counts_in_every_motion() {
    let measuring = Measuring { encoders: Some(Encoders::new(13, 1e-2)), ..Measuring::default() };
    let (arm, found) = found_at(0.02, measuring);
    let noise: Vec<f64> = found.noise.iter().zip(arm.torque_noise()).map(|(a, b)| a.std / b).collect();
    assert!(found.error < 0.3 * found.initial, "{} from {}", found.error, found.initial);
    assert!(found.deviations < 2.0, "{} standard deviations", found.deviations);
    assert!(noise.iter().all(|share| (share - 1.0).abs() < 0.25), "{noise:.2?} of the true noise");
}

/// What was delivered beside the command is in the log, and moved the robot: little is left that is not
/// known.
#[test]
fn a_log_of_what_was_delivered_has_little_noise_left() {
    let measuring = Measuring { logged: LoggedTorque::Delivered, ..Measuring::default() };
    let (arm, found) = found(measuring);
    assert!(found.error < 0.5 * found.initial, "{} from {}", found.error, found.initial);
    for (noise, truth) in found.noise.iter().zip(arm.torque_noise()) {
        assert!((noise.felt - 1.0).abs() < 0.25 && noise.std < 0.2 * truth, "{noise:?}, {truth} N·m");
    }
}

/// The gains of a PD are not in the log, and the reference is: the torques' errors are then what no
/// controller could have asked for.
#[test]
fn commands_follow_from_the_reference_without_the_gains() {
    let arm = Arm::new(0.05);
    let initial = unreliable_model(&arm.truth, 5);
    let log = |controller: KnownOfController, torque_noise: f64| -> MotionLog {
        let measuring = Measuring { controller, torque_noise, ..Measuring::default() };
        let experiment = SimulatedRobot { measuring, ..arm.experiment() };
        let motion = &arm.dataset.motions()[3];
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        experiment.perform(&arm.robot, &initial, motion, &mut rng).unwrap().measured
    };
    let limits: Vec<f64> = (0..7).map(|joint| arm.tree.joint(joint).limits.effort).collect();
    let (exact, noisy) = (log(KnownOfController::Nothing, 0.0), log(KnownOfController::Reference, 0.05));
    let (logged, commands) = (rms(&noisy.tau, &exact.tau), rms(&noisy.commands(&limits), &exact.tau));
    assert!(commands < 0.25 * logged, "{commands} N·m, in the log {logged}");
}
