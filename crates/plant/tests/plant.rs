//! The plant as a whole: without secrets it is the rigid body, with the same seed it is the same, and it
//! refuses nonsense.

use crate::plants;

use phiw_dynamics::{
    BackendError, DimensionError, DynamicsBackend, Foot, Placement, SimulationBackend, Tree, World,
};
use phiw_plant::{
    Clock, ComputedTorque, Coupling, Derivatives, Friction, Gains, Mechanism, Plant, PlantEffect, PlantError,
    PlantRun, PlantSetup, Sensors, Timing, TorqueModel,
};
use plants::{analytic, model, motion, poor_controller, random, rms, rotors, run, setup, true_steps};

/// A plant without noise: the logged torque is the inverse dynamics of the true motion, for any model and
/// period.
fn check_rigid(name: &str, control_period_s: f64, period_s: f64) {
    let tree = model(name, false);
    let world = rotors(&tree);
    let timing = Timing { control_period_s, ..Timing::default() };
    let sensors = Sensors { period_s, torque_window_s: period_s, ..Sensors::default() };
    let run = run(&tree, &world, PlantSetup { timing, sensors, ..setup(&tree, &world, vec![]) }, 1);
    let joints = tree.joint_count();
    let (rows, last) = (run.recording.len(), run.recording.t[run.recording.len() - 1] - run.recording.t[0]);
    assert_eq!(rows, (6.0 / period_s + 1e-9) as usize + 1, "{name}");
    assert!((last - period_s * (rows - 1) as f64).abs() < 1e-9);
    assert_eq!((run.recording.q.len(), run.recording.tau.len()), (rows * joints, rows * joints));
    assert_eq!(run.reactions.len(), rows);
    let steps = true_steps(&run.history, &tree, &world);
    for joint in 0..joints {
        let rigid: Vec<f64> = steps.iter().map(|step| step.rigid[joint]).collect();
        let logged = run.recording.tau.iter().skip(joint).step_by(joints);
        let errors = logged.zip(&run.recording.t).map(|(torque, stamp)| {
            let t_s = stamp - run.recording.t[0];
            torque - run.history.mean(&rigid, 1, 0, t_s - 0.5 * period_s, t_s + 0.5 * period_s)
        });
        let (error, size) = (rms(errors), rms(rigid.iter().copied()));
        assert!(error < 1e-5 * size.max(0.1), "{name}: joint {joint} is off by {error:.1e} of {size:.2}");
    }
}

#[test]
fn without_secrets_the_log_is_inverse_dynamics() {
    check_rigid("planar2", 0.01, 0.01);
    check_rigid("puma560", 0.01, 0.01);
    check_rigid("puma560", 0.001, 0.004);
    check_rigid("arm7", 0.003, 0.01);
    check_rigid("upper_body18", 0.01, 0.002);
}

#[test]
fn actuator_noise_is_felt_and_not_logged() {
    let tree = model("puma560", false);
    let world = rotors(&tree);
    let noisy = PlantSetup { actuator_noise: 0.05, ..setup(&tree, &world, vec![]) };
    let run = run(&tree, &world, noisy, 1);
    let steps = true_steps(&run.history, &tree, &world);
    for joint in 0..6 {
        let share = 0.05 * tree.joint(joint).limits.effort;
        let unlogged =
            steps.iter().enumerate().map(|(k, step)| step.rigid[joint] - run.history.command[k * 6 + joint]);
        let ratio = rms(unlogged) / share;
        assert!((0.9..1.1).contains(&ratio), "joint {joint}: {ratio} of the noise asked for");
    }
    // Held for a control period, then drawn anew.
    let added = |k: usize| run.history.delivered[k * 6] - run.history.command[k * 6];
    assert!((0..200).all(|k| (added(k) == added(k + 1)) == ((k + 1) % 20 != 0)));
}

#[test]
fn sensors_add_what_they_are_told() {
    let tree = model("puma560", false);
    let world = rotors(&tree);
    let perfect = run(&tree, &world, setup(&tree, &world, vec![]), 1);
    let list = |value: f64| vec![value; 6];
    let with =
        |sensors: Sensors| run(&tree, &world, PlantSetup { sensors, ..setup(&tree, &world, vec![]) }, 1);
    let noisy = with(Sensors { torque_noise: list(0.7), ..Sensors::default() });
    assert_eq!(noisy.recording.q, perfect.recording.q, "torque noise is no part of the motion");
    let noise = rms(noisy.recording.tau.iter().zip(&perfect.recording.tau).map(|(x, y)| x - y));
    assert!((0.65..0.75).contains(&noise), "{noise}");
    let quantum = 1e-3;
    let coarse = with(Sensors { angle_quantum: list(quantum), ..Sensors::default() });
    assert!(coarse.recording.q.iter().all(|q| (q / quantum - (q / quantum).round()).abs() < 1e-9));
    let angle =
        |run: &PlantRun, row: usize| run.history.drive_angle_at(2, run.recording.t[row] - run.recording.t[0]);
    let error =
        rms((0..coarse.recording.len()).map(|row| coarse.recording.q[row * 6 + 2] - angle(&coarse, row)));
    assert!((error / (quantum / 12.0_f64.sqrt()) - 1.0).abs() < 0.15, "{error}");
    let jittered = with(Sensors { clock: Clock::StampedJitter(0.2), ..Sensors::default() });
    let intervals: Vec<f64> = jittered.recording.t.windows(2).map(|pair| pair[1] - pair[0]).collect();
    assert!(intervals.iter().all(|interval| (0.006..=0.014).contains(interval)));
    assert!(intervals.iter().any(|interval| (interval - 0.01).abs() > 0.002));
    let row = 100;
    let truth = jittered.history.drive_angle_at(1, jittered.recording.t[row] - 1.0);
    assert!(
        (jittered.recording.q[row * 6 + 1] - truth).abs() < 1e-12,
        "the motion starts 1 s after switching on"
    );
    let derived = with(Sensors { derivatives: Derivatives::Exact, ..Sensors::default() }).recording;
    let (speeds, accelerations) = (derived.qd.unwrap(), derived.qdd.unwrap());
    for row in 1..derived.t.len() - 1 {
        let by_differences = (derived.q[(row + 1) * 6] - derived.q[(row - 1) * 6]) / 0.02;
        assert!((speeds[row * 6] - by_differences).abs() < 0.01);
    }
    assert_eq!(accelerations.len(), derived.q.len());
    assert!(rms(accelerations) > 0.1);
}

/// The velocities of a coarse encoder are steps of a quantum over two periods, around the true ones.
#[test]
fn velocities_from_differences_are_as_coarse_as_the_encoder() {
    let tree = model("arm7", false);
    let world = rotors(&tree);
    // The true speeds, the logged ones, and the RMS of their difference between the first row and the last.
    // The motion is the controller's, who sees the encoders.
    let with = |sensors: Sensors| {
        let run = run(&tree, &world, PlantSetup { sensors, ..setup(&tree, &world, Vec::new()) }, 3);
        let log = run.recording;
        let inner = 7..log.q.len() - 7;
        let true_speed = |index: usize| run.history.drive_speed_at(index % 7, log.t[index / 7] - log.t[0]);
        let truth: Vec<f64> = inner.clone().map(true_speed).collect();
        let logged = log.qd.unwrap()[inner].to_vec();
        assert_eq!(log.qdd.unwrap().len(), log.q.len());
        let error = rms(truth.iter().zip(&logged).map(|(truth, logged)| truth - logged));
        (truth, logged, error)
    };
    let (truth, _, exact) = with(Sensors::exact(0.01));
    assert!(exact < 1e-12, "{exact}");
    let (_, _, fine) = with(Sensors { derivatives: Derivatives::Differences, ..Sensors::exact(0.01) });
    assert!(fine > 0.0 && fine < 0.01 * rms(truth), "{fine}");
    let (_, coarse, error) = with(Sensors::exact(0.01).with_encoder_bits(12, 7));
    let quantum = std::f64::consts::TAU / 4096.0;
    let steps = |speed: &f64| speed * 0.02 / quantum;
    assert!(coarse.iter().all(|speed| (steps(speed) - steps(speed).round()).abs() < 1e-6));
    // Two roundings, each of a variance of quantum²/12, over two periods.
    let expected = quantum / 6.0_f64.sqrt() / 0.02;
    assert!((error / expected - 1.0).abs() < 0.2, "{error}, {expected} expected");
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let tree = model("arm7", false);
    let world = rotors(&tree);
    let once = |seed: u64| {
        let law = Friction::Coulomb { torque: 3.0, width: 0.005 };
        let sensors =
            Sensors { angle_noise: vec![1e-4; 7], torque_noise: vec![0.1; 7], ..Sensors::default() };
        let effects = vec![PlantEffect::Friction { joint: 3, law }];
        run(
            &tree,
            &world,
            PlantSetup { actuator_noise: 0.01, sensors, ..setup(&tree, &world, effects) },
            seed,
        )
    };
    assert_eq!(once(5), once(5));
    assert_ne!(once(5).recording, once(6).recording);
}

#[test]
fn logs_of_one_plant_go_on_in_time() {
    let tree = model("planar2", false);
    let world = rotors(&tree);
    let mut plant = Plant::new(&tree, &world, setup(&tree, &world, vec![]), analytic).unwrap();
    let mut rng = random(2);
    let first = plant.run(&motion(&tree, 2.0, 1), 2.0, &mut rng).unwrap().recording;
    plant.rest(10.0);
    let second = plant.run(&motion(&tree, 2.0, 1), 2.0, &mut rng).unwrap().recording;
    assert_eq!(first.t[0], 1.0);
    assert!((first.t[200] - 3.0).abs() < 1e-9 && first.len() == 201);
    assert!((second.t[0] - 14.0).abs() < 1e-9);
    let change = second.q.iter().zip(&first.q).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
    assert!(change < 1e-9, "the same motion without noise, {change} off");
}

/// A controller that does nothing.
struct Limp;

impl TorqueModel for Limp {
    fn torque(&mut self, _: &[f64], _: &[f64], _: &[f64], torque: &mut [f64]) -> Result<(), DimensionError> {
        torque.fill(0.0);
        Ok(())
    }
}

fn limp(joints: usize, effects: Vec<PlantEffect>) -> PlantSetup {
    let gains = Gains { position: vec![0.0; joints], velocity: vec![0.0; joints] };
    let timing = Timing { settle_s: 0.0, ..Timing::default() };
    PlantSetup { effects, timing, ..PlantSetup::new(ComputedTorque::new(Limp, gains)) }
}

/// A double pendulum swings from level: its energy, springs and motors included, at all steps.
fn energies(effects: Vec<PlantEffect>, stored: &dyn Fn(&PlantRun, usize) -> f64) -> Vec<f64> {
    let tree = model("planar2", false);
    let world = World { rotor_inertia: vec![0.05, 0.02], ..World::default() };
    let flexible = effects.iter().any(|effect| matches!(effect, PlantEffect::Flexibility { .. }));
    let mut plant = Plant::new(&tree, &world, limp(2, effects), analytic).unwrap();
    let level = |_: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| {
        q.copy_from_slice(&[0.0, 0.3]);
        v.fill(0.0);
        a.fill(0.0);
    };
    let run = plant.run(&level, 2.0, &mut random(1)).unwrap();
    let mut workspace = phiw_dynamics::Workspace::new(&tree);
    let mut placements = vec![Placement::identity(); 2];
    let mut matrix = vec![0.0; 4];
    let energy = |row: usize| {
        let (q, v) = (&run.history.link_angle[2 * row..][..2], &run.history.link_speed[2 * row..][..2]);
        let w = &run.history.drive_speed[2 * row..][..2];
        tree.mass_matrix(q, &mut workspace, &mut matrix).unwrap();
        let links = 0.5 * (matrix[0] * v[0] * v[0] + 2.0 * matrix[1] * v[0] * v[1] + matrix[3] * v[1] * v[1]);
        let rotors = 0.5 * (0.05 * w[0] * w[0] + 0.02 * w[1] * w[1]);
        tree.forward_kinematics(q, &mut placements).unwrap();
        let height = tree.center_of_mass(&placements).unwrap().0[2];
        links + rotors + tree.mass() * 9.81 * height + stored(&run, row)
    };
    assert!(!flexible || run.history.drive_angle != run.history.link_angle);
    (0..=run.history.steps()).map(energy).collect()
}

fn at(values: &[f64], row: usize, joint: usize) -> f64 {
    values[2 * row + joint]
}

#[test]
fn what_stores_energy_keeps_it_and_what_rubs_takes_it() {
    let check_kept = |effects: Vec<PlantEffect>, stored: &dyn Fn(&PlantRun, usize) -> f64| {
        let energies = energies(effects, stored);
        let drift = energies.iter().map(|energy| (energy - energies[0]).abs()).fold(0.0, f64::max);
        assert!(drift < 0.02, "{drift} J of some 60 J exchanged");
    };
    check_kept(vec![], &|_, _| 0.0);
    let spring = PlantEffect::Mechanism { joint: 1, law: Mechanism::Spring { stiffness: 20.0, rest: 0.5 } };
    check_kept(vec![spring], &|run, row| 10.0 * (at(&run.history.link_angle, row, 1) - 0.5).powi(2));
    let elastic = PlantEffect::Flexibility { joint: 1, stiffness: 400.0, damping: 0.0, backlash: 0.0 };
    check_kept(vec![elastic], &|run, row| {
        let twist = at(&run.history.drive_angle, row, 1) - at(&run.history.link_angle, row, 1);
        200.0 * twist * twist
    });
    let law = Friction::Coulomb { torque: 2.0, width: 0.002 };
    let rubbed = energies(vec![PlantEffect::Friction { joint: 0, law }], &|_, _| 0.0);
    assert!(rubbed.windows(2).all(|pair| pair[1] < pair[0] + 1e-5));
    assert!(rubbed[0] - rubbed[rubbed.len() - 1] > 2.0);
}

/// Stiction holds: a joint that its friction can hold creeps by no more than the smoothed sign lets it.
#[test]
fn a_joint_that_friction_holds_stays() {
    let tree = model("planar2", false);
    let law = Friction::Coulomb { torque: 60.0, width: 1e-4 };
    let effects = (0..2).map(|joint| PlantEffect::Friction { joint, law: law.clone() }).collect();
    let mut plant = Plant::new(&tree, &World::default(), limp(2, effects), analytic).unwrap();
    let level =
        |_: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| [q, v, a].into_iter().for_each(|x| x.fill(0.0));
    let run = plant.run(&level, 2.0, &mut random(1)).unwrap();
    let furthest = run.recording.q.iter().map(|q| q.abs()).fold(0.0, f64::max);
    assert!(furthest < 2e-4, "crept by {furthest} rad");
}

/// A backend whose base leans over at 0.2 rad/s and whose joints do not move.
struct Leaning {
    names: Vec<String>,
    q: Vec<f64>,
    t_s: f64,
}

impl DynamicsBackend for Leaning {
    fn name(&self) -> &str {
        "leaning"
    }

    fn joint_names(&self) -> &[String] {
        &self.names
    }

    fn velocity_size(&self) -> usize {
        self.q.len() - 1
    }

    fn configuration_size(&self) -> usize {
        self.q.len()
    }

    fn inverse_dynamics(
        &mut self,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn forward_dynamics(
        &mut self,
        _: &[f64],
        _: &[f64],
        _: &[f64],
        _: &mut [f64],
    ) -> Result<(), BackendError> {
        Ok(())
    }

    fn base_wrench(&self) -> [f64; 6] {
        // 100 N pressing at x = 0.2 m, y = −0.1 m.
        [0.0, 0.0, 100.0, -10.0, -20.0, 0.0]
    }
}

impl SimulationBackend for Leaning {
    fn state(&self, q: &mut [f64], v: &mut [f64]) -> Result<(), BackendError> {
        q.copy_from_slice(&self.q);
        let (sine, cosine) = (0.1 * self.t_s).sin_cos();
        q[3..7].copy_from_slice(&[0.0, sine, 0.0, cosine]);
        v.fill(0.0);
        Ok(())
    }

    fn set_state(&mut self, q: &[f64], _: &[f64]) -> Result<(), BackendError> {
        self.q.copy_from_slice(q);
        self.t_s = 0.0;
        Ok(())
    }

    fn step(&mut self, _: &[f64], dt: f64) -> Result<(), BackendError> {
        self.t_s += dt;
        Ok(())
    }
}

#[test]
fn a_robot_that_leans_too_far_has_fallen() {
    let tree = model("upper_body18", true);
    let sole = vec![[0.1, 0.1, -0.02], [-0.1, 0.1, -0.02], [-0.1, -0.1, -0.02], [0.1, -0.1, -0.02]];
    let world = World { feet: vec![Foot { body: 0, sole }], ..World::default() };
    let build = |tree: &Tree, _: &World| -> Result<Box<dyn SimulationBackend>, BackendError> {
        Ok(Box::new(Leaning {
            names: tree.joint_names().map(str::to_owned).collect(),
            q: tree.neutral_configuration(),
            t_s: 0.0,
        }))
    };
    let mut plant = Plant::new(&tree, &world, setup(&tree, &world, vec![]), build).unwrap();
    let run = plant.run(&motion(&tree, 6.0, 1), 6.0, &mut random(1)).unwrap();
    // 1.5 s from the start, of which one to settle.
    assert!((run.fell_at_s.unwrap() - 0.5).abs() < 1e-3);
    assert!(run.recording.len() >= 49 && run.recording.len() <= 51, "{} rows", run.recording.len());
    // The soles lie on the floor.
    assert!((run.history.base[2] - 0.02).abs() < 1e-12);
    let zmp = run.reactions[10].zmp.unwrap();
    assert!((zmp[0] - 0.2).abs() < 1e-12 && (zmp[1] + 0.1).abs() < 1e-12);
    assert!((plant.clock_s() - 1.5).abs() < 2e-3);
}

#[test]
fn nonsense_is_refused() {
    let tree = model("planar2", false);
    let check = |change: &dyn Fn(&mut PlantSetup), expected: &str| {
        let world = World::default();
        let mut setup = setup(&tree, &world, vec![]);
        change(&mut setup);
        let error = Plant::new(&tree, &world, setup, analytic).err().unwrap();
        assert!(error.to_string().contains(expected), "{error}");
    };
    let viscous =
        |joint, coefficient| PlantEffect::Friction { joint, law: Friction::Viscous { coefficient } };
    check(&|setup| setup.effects = vec![viscous(2, 1.0)], "viscous_friction acts on joint 2");
    check(&|setup| setup.effects = vec![viscous(0, -1.0)], "coefficient of viscous_friction is -1");
    check(&|setup| setup.effects = vec![viscous(0, f64::NAN)], "NaN");
    let coulomb = Friction::Coulomb { torque: 1.0, width: 0.0 };
    check(&|setup| setup.effects = vec![PlantEffect::Friction { joint: 0, law: coulomb.clone() }], "> 0");
    let payload = PlantEffect::Payload { body: 7, mass: 1.0, center: [0.0; 3], radii: [0.0; 3] };
    check(&|setup| setup.effects = vec![payload.clone()], "payload acts on body 7");
    let same = Coupling::SharedInertia { joints: [1, 1], inertia: 0.1 };
    check(&|setup| setup.effects = vec![PlantEffect::Coupling(same.clone())], "second joint");
    let flexible = PlantEffect::Flexibility { joint: 0, stiffness: 100.0, damping: 0.0, backlash: 0.0 };
    check(&|setup| setup.effects = vec![flexible.clone()], "rotor inertia > 0");
    check(&|setup| setup.timing.control_period_s = 0.0, "control period");
    check(&|setup| setup.actuator_noise = -0.1, "noise");
    check(&|setup| setup.sensors.torque_noise = vec![0.1; 3], "torque noise");
    check(&|setup| setup.sensors.clock = Clock::HiddenJitter(0.7), "jitter");
    check(
        &|setup| {
            let gains = Gains { position: vec![1.0], velocity: vec![1.0, 1.0] };
            setup.controller = ComputedTorque::new(Limp, gains);
        },
        "position gains",
    );
    let world = World { position_limits: true, ..World::default() };
    let refused = Plant::new(&tree, &world, setup(&tree, &world, vec![]), analytic).err().unwrap();
    assert!(matches!(refused, PlantError::Build(BackendError::Backend { .. })));
    let floating = model("planar2", true);
    let force = PlantEffect::ExternalForce { body: 1, point: [0.0; 3], force: [1.0, 0.0, 0.0] };
    let refused =
        Plant::new(&floating, &World::default(), setup(&floating, &World::default(), vec![force]), analytic);
    assert_eq!(refused.err().unwrap(), PlantError::ForceOnFloatingBase);
    let mut plant = Plant::new(
        &tree,
        &World::default(),
        PlantSetup::new(poor_controller(&tree, &World::default())),
        analytic,
    )
    .unwrap();
    let wild = |_: f64, q: &mut [f64], _: &mut [f64], _: &mut [f64]| q.fill(f64::NAN);
    assert_eq!(plant.run(&wild, 1.0, &mut random(1)).unwrap_err(), PlantError::Reference { t_s: 0.0 });
    assert!(plant.run(&motion(&tree, 1.0, 1), -1.0, &mut random(1)).is_err());
}
