//! The simulated robot: its truth and its noise are stated once, its sensors can be set.

use crate::arm;

use arm::Arm;
use phiw_bspline_retarget::embedded::embedded_motions;
use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::{RetargetOptions, Retargeter};
use phiw_curriculum::end::FixedCount;
use phiw_curriculum::motion::Motion;
use phiw_curriculum::{CurriculumError, CurriculumRun, Experiment, unreliable_model};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, BackendError, SimulationBackend, Tree, World};
use phiw_effects::Catalogue;
use phiw_estimation::{MotionLikelihood, Robot};
use phiw_identification::EffectSpec;
use phiw_plant::{Derivatives, Friction, Gains, PlantEffect, Sensors, Timing};
use phiw_simulated_robot::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

fn analytic(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))
}

fn no_gains() -> FeedForward {
    FeedForward { gains: Gains { position: vec![0.0; 7], velocity: vec![0.0; 7] } }
}

/// Friction was stated twice, for the plant and for the truth that scores are taken against, and nothing told
/// when the two differed.
#[test]
fn bodies_and_frictions_are_those_of_the_truth() {
    let tree = arm::tree();
    let joints: Vec<&str> = tree.joint_names().collect();
    let specs = vec![
        EffectSpec::new("coulomb_friction", &[joints[2]]).with("sign_width", 0.02),
        EffectSpec::new("rotor_inertia", &[joints[4]]),
    ];
    let robot = Robot::new(tree.clone(), [0.0; 10], specs, Catalogue::default()).unwrap();
    let mut truth = robot.truth(&[3.0, 0.4]).unwrap();
    truth.standard[0] *= 1.5;
    let simulated = SimulatedRobot::new(&robot, &truth, no_gains(), analytic).unwrap();
    assert_eq!(simulated.tree.inertial_parameters(), truth.standard);
    let coulomb = PlantEffect::Friction { joint: 2, law: Friction::Coulomb { torque: 3.0, width: 0.02 } };
    assert_eq!(simulated.effects, [coulomb, PlantEffect::RotorInertia { joint: 4, inertia: 0.4 }]);
    assert_eq!(simulated.sensors, Sensors::exact(simulated.timing.control_period_s));
}

#[test]
fn an_effect_that_no_plant_has_is_named() {
    let tree = arm::tree();
    let joint = tree.joint_names().next().unwrap().to_owned();
    let spec = EffectSpec::new("torque_gain", &[&joint]);
    let robot = Robot::new(tree, [0.0; 10], vec![spec], Catalogue::default()).unwrap();
    let truth = robot.truth(&[0.1]).unwrap();
    let error = SimulatedRobot::new(&robot, &truth, no_gains(), analytic).err().unwrap();
    assert!(error.to_string().contains("torque_gain"), "{error}");
}

/// The plant's noise was stated for the plant and again for the estimator; with another number the estimate
/// was quietly worse.
#[test]
fn an_estimator_that_counts_on_another_noise_is_refused() {
    let arm = Arm::new(0.02);
    let experiment = arm.experiment();
    assert_eq!(experiment.torque_noise(), arm.torque_noise());
    let check = |share: f64| {
        let noise = experiment.torque_noise().iter().map(|noise| share * noise).collect();
        let (estimator, end) = (MotionLikelihood::new(noise), FixedCount(1));
        let curriculum = arm.curriculum(&experiment, &estimator, &end);
        let mut run = CurriculumRun::new(1, unreliable_model(&arm.truth, 1));
        curriculum.run::<CurriculumError>(&mut run, |_| Ok(()))
    };
    check(1.0).unwrap();
    let error = check(0.5).unwrap_err().to_string();
    assert!(
        error.contains(arm.tree.joint_names().next().unwrap()) && error.contains("torque_noise()"),
        "{error}"
    );
}

/// The noise of a torque sensor counts beside the actuator's, each joint by itself.
#[test]
fn the_noise_of_sensors_is_part_of_the_torques_noise() {
    let mut experiment = Arm::new(0.02).experiment();
    let actuators = experiment.torque_noise();
    experiment.sensors.torque_noise = vec![1.5; 7];
    for (both, actuator) in experiment.torque_noise().iter().zip(actuators) {
        assert!((both * both - actuator * actuator - 2.25).abs() < 1e-9);
    }
}

/// Sensors were fixed inside of the simulated robot.
#[test]
fn encoders_are_as_coarse_as_they_are_told() {
    let arm = Arm::new(0.0);
    let perform = |sensors: Sensors| {
        let experiment = SimulatedRobot { sensors, ..arm.experiment() };
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        experiment.perform(&arm.robot, &arm.truth, &arm.dataset.motions()[0], &mut rng)
    };
    let exact = perform(Sensors::exact(0.01)).unwrap().measured;
    let coarse = perform(Sensors::exact(0.01).with_encoder_bits(12, 7)).unwrap().measured;
    let quantum = std::f64::consts::TAU / 4096.0;
    let is_step = |q: &f64| (q / quantum - (q / quantum).round()).abs() < 1e-9;
    assert!(coarse.q.iter().all(is_step) && !exact.q.iter().all(is_step));
    let slope = (coarse.q[7 * 101] - coarse.q[7 * 99]) / 0.02;
    assert!((coarse.qd[7 * 100] - slope).abs() < 1e-9);

    let refused = |sensors: Sensors| perform(sensors).unwrap_err().to_string();
    assert!(refused(Sensors::exact(0.005)).contains("control period"));
    let blind = Sensors { derivatives: Derivatives::Unlogged, ..Sensors::exact(0.01) };
    assert!(refused(blind).contains("velocities"));
}

/// From a retargeted motion to one to choose from was eight lines of everybody's own.
#[test]
fn a_retargeted_motion_is_a_motion() {
    let urdf = include_str!("../../../models/upper_body18.urdf");
    let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
    let retargeter =
        Retargeter::new(tree, MarkerMap::embedded().unwrap(), RetargetOptions::default()).unwrap();
    let person = embedded_motions(1).unwrap().next().unwrap();
    let retargeted = retargeter.retarget(&person.recording, None).unwrap();
    let motion = Motion::new("m", "", 18, retargeted.period_s(), retargeted.signals()).unwrap();
    assert_eq!((motion.samples(), motion.period_s()), (retargeted.frames, 1.0 / retargeted.rate_hz));
    let frame = retargeted.frames / 2;
    let mut point = vec![0.0; 18];
    for (order, signal) in motion.sample(frame).into_iter().enumerate() {
        retargeted.robot.evaluate(order, frame as f64 / retargeted.rate_hz, &mut [0.0; 4], &mut point);
        assert_eq!(signal, point);
    }
}

#[test]
fn a_reference_is_sampled_where_it_is_asked() {
    let line = |t: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        q.copy_from_slice(&[t, -2.0 * t]);
        v.copy_from_slice(&[1.0, -2.0]);
        a.fill(0.0);
    };
    let motion = Motion::of_reference("line", "", 2, (5, 0.1), line).unwrap();
    assert_eq!((motion.samples(), motion.joints()), (5, 2));
    assert_eq!(motion.sample(3), [&[0.1 * 3.0, -0.2 * 3.0][..], &[1.0, -2.0], &[0.0, 0.0]]);
    assert!(Motion::of_reference("line", "", 2, (1, 0.1), line).is_err());
    assert_eq!(Timing::default().control_period_s, 0.01, "what the tests above take for the control period");
}

/// What a force plate under the base sees of a motion that is followed exactly is the reference's own ZMP.
#[test]
fn the_balance_that_was_kept_is_that_of_the_motion() {
    let arm = Arm::new(0.0);
    let link = [30.0, 0.3, -0.2, 6.0, 2.0, 0.0, 2.0, 0.0, 0.0, 1.0];
    let robot = Robot::with_viscous_friction(arm.tree.clone(), link, Catalogue::default()).unwrap();
    let standing = phiw_zmp::standing_parameters(&link, &arm.truth.standard);
    let stance = |shift: f64| {
        let corners = [[0.1, 0.1], [-0.1, 0.1], [-0.1, -0.1], [0.1, -0.1]].map(|[x, y]| [x + shift, y]);
        let polygon = phiw_zmp::SupportPolygon::from_points(&corners).unwrap();
        phiw_zmp::Stance::new(polygon, [shift, 0.0], 0.0).unwrap()
    };
    let motion = &arm.dataset.motions()[2];
    for shift in [0.0, 0.08, 5.0] {
        let stance = stance(shift);
        let experiment = SimulatedRobot { stance: Some(stance.clone()), ..arm.experiment() };
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let kept = experiment.perform(&robot, &arm.truth, motion, &mut rng).unwrap().kept.unwrap();
        let samples = (0..motion.samples()).map(|sample| motion.sample(sample));
        let mut workspace = phiw_zmp::ZmpWorkspace::new(&arm.tree);
        let balance =
            phiw_zmp::MotionBalance::of_motion(&arm.tree, &standing, &stance, samples, &mut workspace)
                .unwrap();
        println!("{kept:?} {}", balance.multi_body.margin);
        let margin = kept.margin_m.unwrap();
        assert!((margin - balance.multi_body.margin).abs() < 3e-3, "{kept:?} {balance:?}");
        // A mean leaves out what is short.
        assert!(kept.tipping_margin_m >= margin - 1e-3);
        assert_eq!(kept.outside_share > 0.0, margin < 0.0);
    }
    let without = arm.experiment().perform(&robot, &arm.truth, motion, &mut ChaCha8Rng::seed_from_u64(1));
    assert_eq!(without.unwrap().kept, None);
}
