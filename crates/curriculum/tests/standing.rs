//! The humanoid on its feet, in both engines: what is measured of it is what its model says.

use phiw_curriculum::standing::*;
use phiw_curriculum::*;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{BackendError, DynamicsBackend, Foot, Tree, Workspace, World};
use phiw_plant::{Gains, Timing, feet_from_toml};
use phiw_regressor::BaseParameters;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const URDF: &str = include_str!("../../../models/humanoid30.urdf");
const SUPPORT: &str = include_str!("../../../models/humanoid30.support.toml");
const PERIOD_S: f64 = 0.01;

struct Humanoid {
    floating: Tree,
    chain: Tree,
    world: World,
    feet: Feet,
    stance: Vec<f64>,
    legs: Vec<usize>,
}

impl Humanoid {
    /// With bent knees, the ankles 2 cm behind the hips.
    fn new() -> Self {
        let floating =
            read_urdf(URDF, &UrdfOptions { floating_base: true, ..UrdfOptions::default() }).unwrap().tree;
        let text = with_virtual_base(URDF, &floating.bodies()[0].link).unwrap();
        let chain = read_urdf(&text, &UrdfOptions::default()).unwrap().tree;
        let world = World { feet: feet_from_toml(SUPPORT, &floating).unwrap(), ..World::default() };
        let own: Vec<Foot> =
            world.feet.iter().map(|foot| Foot { body: foot.body + 5, sole: foot.sole.clone() }).collect();
        let mut q = vec![0.0; chain.joint_count()];
        q[2] = 0.06 + 0.66 + 0.09;
        for side in ["left", "right"] {
            for (joint, angle) in [("hip_pitch", -0.38), ("knee", 0.82), ("ankle_pitch", -0.44)] {
                q[chain.joint_index(&format!("{side}_{joint}")).unwrap()] = angle;
            }
        }
        let feet = Feet::new(&chain, &own, &q).unwrap();
        let legs = [feet.leg(0), feet.leg(1)].concat();
        Humanoid { floating, chain, world, feet, stance: q, legs }
    }

    /// The base sways and squats, the arms swing: all of it, or a `share`.
    fn motion(&self, duration_s: f64, share: f64) -> Motion {
        let joints = self.chain.joint_count();
        let rows = (duration_s / PERIOD_S) as usize + 1;
        let mut signals = [0; 3].map(|_| Vec::with_capacity(rows * joints));
        let (mut q, mut v, mut a) = (self.stance.clone(), vec![0.0; joints], vec![0.0; joints]);
        for row in 0..rows {
            let t = row as f64 * PERIOD_S;
            for joint in (0..joints).filter(|joint| !self.legs.contains(joint)) {
                let reach = [0.02, 0.03, -0.05, 0.15, 0.08, 0.05].get(joint).copied().unwrap_or(0.15) * share;
                let rate = 2.0 + 0.17 * joint as f64 % 2.3;
                // Begins at rest.
                let (sine, cosine) = (rate * t).sin_cos();
                q[joint] = self.stance[joint] + reach * sine * sine;
                v[joint] = 2.0 * reach * rate * sine * cosine;
                a[joint] = 2.0 * reach * rate * rate * (cosine * cosine - sine * sine);
            }
            self.feet.close(&self.legs, &[0, 1], [&mut q, &mut v, &mut a]).unwrap();
            signals
                .iter_mut()
                .zip([&q, &v, &a])
                .for_each(|(signal, values)| signal.extend_from_slice(values));
        }
        Motion::new("sway", "sway", joints, PERIOD_S, signals).unwrap()
    }

    /// What motions with both feet on the floor tell apart, from random ones.
    fn base(&self) -> BaseParameters {
        let joints = self.chain.joint_count();
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut states: Vec<[Vec<f64>; 3]> = Vec::new();
        while states.len() < 120 {
            let [mut q, mut v, mut a] = [self.stance.clone(), vec![0.0; joints], vec![0.0; joints]];
            for joint in (0..joints).filter(|joint| !self.legs.contains(joint)) {
                let reach = [0.05, 0.05, 0.05, 0.3, 0.2, 0.15].get(joint).copied().unwrap_or(1.5);
                q[joint] += reach * random.random_range(-1.0..1.0) - if joint == 2 { 0.06 } else { 0.0 };
                v[joint] = random.random_range(-3.0..3.0);
                a[joint] = random.random_range(-10.0..10.0);
            }
            if self.feet.close(&self.legs, &[0, 1], [&mut q, &mut v, &mut a]).is_ok() {
                states.push([q, v, a]);
            }
        }
        let states = states.iter().map(|[q, v, a]| [q.as_slice(), v.as_slice(), a.as_slice()]);
        BaseParameters::of_states(&self.chain, states, &[0, 1, 2, 3, 4], Default::default()).unwrap()
    }

    fn gains(&self) -> Gains {
        let stiffness = |joint: usize| {
            let limit = self.floating.joint(joint).limits.effort;
            if self.legs.contains(&(joint + 6)) { 12.0 * limit } else { 0.5 * limit }
        };
        let position: Vec<f64> = (0..self.floating.joint_count()).map(stiffness).collect();
        Gains { velocity: position.iter().map(|gain| 0.004 * gain).collect(), position }
    }

    fn experiment(&self, build: Box<BuildBackend>) -> StandingRobot {
        let controller =
            StandingFeedForward { gains: self.gains(), feet: self.feet.clone(), stance: self.stance.clone() };
        let plant = SimulatedRobot {
            tree: self.floating.clone(),
            world: self.world.clone(),
            effects: Vec::new(),
            controller: Box::new(controller),
            actuator_noise: 0.0,
            sensors: phiw_plant::Sensors::exact(1e-3),
            timing: Timing { control_period_s: 1e-3, longest_step_s: 5e-4, settle_s: 1.0 },
            fall_tilt_rad: 0.3,
            build,
        };
        let wrench_noise = WrenchNoise { force_n: 0.0, moment_nm: 0.0 };
        StandingRobot { plant, feet: self.feet.clone(), wrench_noise }
    }
}

fn rapier(tree: &Tree, world: &World) -> Result<Box<dyn DynamicsBackend>, BackendError> {
    Ok(Box::new(phiw_sim_rapier::RapierBackend::new(tree, world)?))
}

fn mujoco(tree: &Tree, world: &World) -> Result<Box<dyn DynamicsBackend>, BackendError> {
    let backend = phiw_sim_mujoco::MujocoBackend::new(tree, world);
    let backend =
        backend.map_err(|error| BackendError::Backend { backend: "mujoco", message: error.to_string() })?;
    Ok(Box::new(backend.with_integrator(phiw_sim_mujoco::Integrator::Implicit)))
}

/// Feet that stay hide what they are made of: nine parameters each, of which the rest of the robot's cover none.
#[test]
fn feet_on_the_floor_hide_parameters() {
    let humanoid = Humanoid::new();
    let base = humanoid.base();
    let free = BaseParameters::of_tree(&humanoid.floating, Default::default()).unwrap();
    assert_eq!((free.count(), base.count()), (220, 202));
    assert!(base.rank_gap() > 1e8, "{}", base.rank_gap());
    // Massless links stay massless.
    assert!(base.independent().iter().all(|&parameter| parameter >= 50));
}

/// The loop that the feet close: they stay, and velocities and accelerations are derivatives.
#[test]
fn legs_follow_the_base() {
    let humanoid = Humanoid::new();
    let motion = humanoid.motion(0.5, 1.0);
    for sample in 1..motion.samples() - 1 {
        let [q, v, _] = motion.sample(sample);
        let [linear, angular] = humanoid.feet.speeds(q, v).unwrap();
        assert!(linear < 1e-9 && angular < 1e-9);
        let [[before, speed_before, _], [after, speed_after, _]] =
            [motion.sample(sample - 1), motion.sample(sample + 1)];
        let [_, v, a] = motion.sample(sample);
        for &joint in &humanoid.legs {
            assert!(((after[joint] - before[joint]) / (2.0 * PERIOD_S) - v[joint]).abs() < 2e-3);
            assert!(((speed_after[joint] - speed_before[joint]) / (2.0 * PERIOD_S) - a[joint]).abs() < 2e-2);
        }
    }
}

/// What the feet take of a load and what is left is all of it, and nothing is left for the joints without motors.
#[test]
fn feet_carry_the_base() {
    let humanoid = Humanoid::new();
    let motion = humanoid.motion(0.5, 1.0);
    let [q, v, a] = motion.sample(30);
    let mut force = vec![0.0; q.len()];
    humanoid.chain.inverse_dynamics(q, v, a, &mut Workspace::new(&humanoid.chain), &mut force).unwrap();
    humanoid.feet.take_load(q, &mut force).unwrap();
    assert!(force[..6].iter().all(|force| force.abs() < 1e-9), "{:?}", &force[..6]);
    // Knees that are bent bear a part of the weight.
    let knee = humanoid.chain.joint_index("left_knee").unwrap();
    assert!(force[knee].abs() > 5.0);
}

/// Φ·w is what is measured: the commands, and the wrenches under the feet through the feet's Jacobian. In both engines, on a robot that stands by
/// itself.
#[test]
fn the_model_says_what_is_measured() {
    let humanoid = Humanoid::new();
    let motion = humanoid.motion(1.5, 1.0);
    let robot =
        Robot::with_base(humanoid.chain.clone(), humanoid.base(), [0.0; 10], Vec::new(), Default::default())
            .unwrap();
    let truth = robot.truth(&[]).unwrap();
    let design = robot.design_of(&truth).unwrap();
    let parameters = truth.parameters(&robot).unwrap();
    for (name, build) in [("mujoco", mujoco as fn(&Tree, &World) -> _), ("rapier", rapier)] {
        let experiment = humanoid.experiment(Box::new(build));
        let mut random = ChaCha8Rng::seed_from_u64(1);
        if name == "mujoco" && phiw_sim_mujoco::find_library().is_err() {
            println!("skipped: MuJoCo is not there");
            continue;
        }
        let trial = experiment.perform(&robot, &truth, &motion, &mut random).unwrap();
        assert_eq!(trial.fell_at_s, None, "{name}");
        assert!(
            trial.tracking_error[..12].iter().all(|error| *error < 0.02),
            "{name}: {:?}",
            trial.tracking_error
        );
        let log = &trial.measured;
        // An edge of a sole may lift for a moment; rows in which it does do not count.
        println!("{name}: feet still in {:.1} % of the rows", 100.0 * log.still_share());
        assert!(log.still_share() > 0.5, "{name}: {}", log.still_share());
        let mut evidence = Evidence::none(&design, RowsAt::Periods).unwrap();
        evidence.add(&design, log).unwrap();
        // [base, legs, upper body]: RMS of what the model does not explain, and of what is measured.
        for (rows, share) in [(0..6, 0.005), (6..18, 0.05), (18..36, 0.002)] {
            let weights: Vec<f64> =
                (0..log.joints).map(|row| f64::from(u8::from(rows.contains(&row)))).collect();
            let factor = evidence.factor().combine(&weights).unwrap();
            let none = vec![0.0; parameters.len()];
            let error = (factor.residual_sum_of_squares(&parameters).unwrap()
                / factor.residual_sum_of_squares(&none).unwrap())
            .sqrt();
            println!("{name}: rows {rows:?}: {:.3} % unexplained", 100.0 * error);
            assert!(error < share, "{name}: rows {rows:?}: {error}");
        }
    }
}

/// Engines' steps are semi-implicit: Δq/T followed the noise of a period by three quarters of what it did to the velocity and not by half. The likelihood took
/// the difference for friction: −1.6 N·m·s/rad in a waist that has 1.3.
#[test]
fn positions_and_velocities_are_of_one_instant() {
    let humanoid = Humanoid::new();
    let motion = humanoid.motion(0.2, 0.2);
    let robot =
        Robot::with_base(humanoid.chain.clone(), humanoid.base(), [0.0; 10], Vec::new(), Default::default())
            .unwrap();
    let truth = robot.truth(&[]).unwrap();
    for (name, build) in [("mujoco", mujoco as fn(&Tree, &World) -> _), ("rapier", rapier)] {
        if name == "mujoco" && phiw_sim_mujoco::find_library().is_err() {
            println!("skipped: MuJoCo is not there");
            continue;
        }
        let mut experiment = humanoid.experiment(Box::new(build));
        experiment.plant.actuator_noise = 0.02;
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let log = experiment.perform(&robot, &truth, &motion, &mut random).unwrap().measured;
        let (mut along, mut square) = (0.0, 0.0);
        for index in 0..log.q.len() - log.joints {
            let next = index + log.joints;
            let change = log.qd[next] - log.qd[index];
            along += change * ((log.q[next] - log.q[index]) / log.period_s - log.qd[index]);
            square += change * change;
        }
        let share = along / square;
        println!("{name}: the mean velocity follows {share:.3} of a change");
        assert!((share - 0.5).abs() < 0.03, "{name}: {share}");
    }
}
