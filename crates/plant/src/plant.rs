//! The plant: controller, actuators, physics, sensors.

use crate::active_run::ActiveRun;
use crate::error::check_value;
use crate::joint_drive::JointDrive;
use crate::robot_as_built::robot_as_built;
use crate::{ComputedTorque, Coupling, PlantEffect, PlantError, PlantRun, Reaction, Reference, Sensors};
use phiw_dynamics::{BackendError, SimulationBackend, Tree, World};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// How time is cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Time between two commands of the controller, which are held in between \[s\].
    pub control_period_s: f64,
    /// Longest integration step \[s\]; the step used divides the control period.
    pub longest_step_s: f64,
    /// How long the robot holds the reference's first posture before the motion starts \[s\].
    pub settle_s: f64,
}

impl Default for Timing {
    /// Commands every 10 ms, as in the paper; steps of 0.5 ms; a second to settle.
    fn default() -> Self {
        Timing { control_period_s: 0.01, longest_step_s: 5e-4, settle_s: 1.0 }
    }
}

/// What a plant is made of, beside a robot, a world and a backend.
pub struct PlantSetup {
    /// The controller.
    pub controller: ComputedTorque,
    /// Everything that the robot has beside its rigid bodies and the world's rotors, declared or not.
    pub effects: Vec<PlantEffect>,
    /// Standard deviation of the torque that actuators add by themselves, over the effort limit; drawn anew
    /// for every command, and never logged. 0.05 in the paper.
    pub actuator_noise: f64,
    /// Correlation ρ of that torque from one command to the next, between −1 and 1: n' = ρ·n + √(1 − ρ²)·ξ.
    /// 0 in the paper.
    pub actuator_noise_correlation: f64,
    /// Sensors.
    pub sensors: Sensors,
    /// How time is cut.
    pub timing: Timing,
    /// Tilt of its base at which a standing robot counts as fallen \[rad\].
    pub fall_tilt_rad: f64,
}

impl PlantSetup {
    /// A perfect robot: no effects, no noise, perfect sensors.
    pub fn new(controller: ComputedTorque) -> Self {
        PlantSetup {
            controller,
            effects: Vec::new(),
            actuator_noise: 0.0,
            actuator_noise_correlation: 0.0,
            sensors: Sensors::default(),
            timing: Timing::default(),
            fall_tilt_rad: 0.3,
        }
    }
}

/// A simulated robot that behaves like a real one, over any [`SimulationBackend`].
///
/// Each control period the controller reads the encoders and commands torques, clipped at the effort limits.
/// The actuators deliver them with their noise and faults. Between two commands the backend is stepped, under
/// the torque that is left after all effects have taken theirs: they act inside the physics, and the log
/// knows nothing of them.
///
/// Effects that are steep in speed or angle (dry friction, presliding, stops, springs of transmissions) are
/// solved implicitly for the end of each step, so that steps of 0.5 ms are stable at any smoothing width;
/// other effects are taken in the step's middle. Beyond torques the effects change the robot itself: payload,
/// tilt and rotors are built into the backend's tree and world.
pub struct Plant {
    /// The robot as built.
    pub(crate) tree: Tree,
    pub(crate) world: World,
    pub(crate) backend: Box<dyn SimulationBackend>,
    pub(crate) controller: ComputedTorque,
    pub(crate) effects: Vec<PlantEffect>,
    pub(crate) drives: Vec<JointDrive>,
    pub(crate) couplings: Vec<Coupling>,
    pub(crate) effort: Vec<f64>,
    pub(crate) actuator_noise: f64,
    pub(crate) actuator_noise_correlation: f64,
    pub(crate) sensors: Sensors,
    pub(crate) timing: Timing,
    pub(crate) fall_tilt_rad: f64,
    /// Time since the plant was switched on \[s\].
    pub(crate) clock_s: f64,
}

impl Plant {
    /// Builds the robot with all its effects. `build` makes the backend, of the robot as it is with payloads,
    /// tilt and rotors, which is not always what `tree` and `world` declare.
    ///
    /// # Errors
    /// A list, an effect or the world does not fit the robot, a number makes no sense, or the backend can not
    /// be built.
    pub fn new(
        tree: &Tree,
        world: &World,
        setup: PlantSetup,
        build: impl FnOnce(&Tree, &World) -> Result<Box<dyn SimulationBackend>, BackendError>,
    ) -> Result<Self, PlantError> {
        let PlantSetup {
            controller,
            effects,
            actuator_noise,
            actuator_noise_correlation,
            sensors,
            timing,
            fall_tilt_rad,
        } = setup;
        world.check(tree)?;
        effects.iter().try_for_each(|effect| effect.check(tree))?;
        controller.check(tree.joint_count())?;
        sensors.check(tree)?;
        let limits = |joint: usize| tree.joint(joint).limits.effort;
        let effort: Vec<f64> = (0..tree.joint_count()).map(limits).collect();
        check_value(|| "the actuators' noise".to_owned(), actuator_noise, "≥ 0", |share| share >= 0.0)?;
        check_value(
            || "the correlation of the actuators' noise".to_owned(),
            actuator_noise_correlation,
            "between −1 and 1",
            |rho| rho.abs() < 1.0,
        )?;
        if let Some(joint) = effort.iter().position(|limit| actuator_noise > 0.0 && !limit.is_finite()) {
            return Err(PlantError::NoEffortLimit { joint: tree.joint(joint).joint.clone() });
        }
        for (what, value) in
            [("the control period", timing.control_period_s), ("the integration step", timing.longest_step_s)]
        {
            check_value(|| what.to_owned(), value, "> 0", |value| value > 0.0)?;
        }
        check_value(|| "the time to settle".to_owned(), timing.settle_s, "≥ 0", |value| value >= 0.0)?;
        check_value(|| "the tilt of a fall".to_owned(), fall_tilt_rad, "> 0", |value| value > 0.0)?;
        let (tree, world, motors) = robot_as_built(tree, world, &effects)?;
        let backend = build(&tree, &world).map_err(PlantError::Build)?;
        let coupling = |effect: &PlantEffect| match effect {
            PlantEffect::Coupling(coupling) => Some(coupling.clone()),
            _ => None,
        };
        Ok(Plant {
            drives: JointDrive::all(&effects, &motors),
            couplings: effects.iter().filter_map(coupling).collect(),
            tree,
            world,
            backend,
            controller,
            effects,
            effort,
            actuator_noise,
            actuator_noise_correlation,
            sensors,
            timing,
            fall_tilt_rad,
            clock_s: 0.0,
        })
    }

    /// The robot as built, with payloads and tilt.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// The world as built, with all rotors but those behind springs.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Time since the plant was switched on \[s\].
    pub fn clock_s(&self) -> f64 {
        self.clock_s
    }

    /// Lets time go by with the robot at rest.
    pub fn rest(&mut self, duration_s: f64) {
        self.clock_s += duration_s.max(0.0);
    }

    /// Replaces the controller, as when a better model is known.
    ///
    /// # Errors
    /// Its gains do not fit the robot.
    pub fn set_controller(&mut self, controller: ComputedTorque) -> Result<(), PlantError> {
        controller.check(self.tree.joint_count())?;
        self.controller = controller;
        Ok(())
    }

    /// Puts the robot at rest into the reference's first posture, lets it settle, and follows the reference.
    ///
    /// The first row of the log is that of the motion's start. The reference should start at rest: what it
    /// asks for at time 0 sets in at once. The same random numbers give the same run; what sensors draw does
    /// not change the motion, unless the controller sees it. On a fall the run ends, which is no error.
    ///
    /// # Errors
    /// The duration is not finite and > 0, the reference is not finite, or the backend fails.
    pub fn run(
        &mut self,
        reference: &dyn Reference,
        duration_s: f64,
        rng: &mut (impl Rng + ?Sized),
    ) -> Result<PlantRun, PlantError> {
        check_value(|| "the duration".to_owned(), duration_s, "> 0", |value| value > 0.0)?;
        let seed: u64 = rng.random();
        let stream = |number| {
            let mut stream = ChaCha8Rng::seed_from_u64(seed);
            stream.set_stream(number);
            stream
        };
        let mut active = ActiveRun::begin(self, reference, [stream(0), stream(1)])?;
        let end_s = duration_s + self.sensors.margin_s(&self.effects);
        let fell_at_s = active.follow(self, reference, [duration_s, end_s])?;
        let ActiveRun { history, tracking_error, .. } = active;
        let origin_s = self.clock_s + self.timing.settle_s;
        self.clock_s = origin_s + duration_s.min(history.end_s());
        let (recording, windows) =
            self.sensors.record(&self.tree, &history, &self.effects, [origin_s, duration_s], &mut stream(2));
        let reaction = |&[from, to]: &[f64; 2]| {
            let component = |axis| history.mean(&history.wrench, 6, axis, from, to);
            Reaction::of_wrench([0, 1, 2, 3, 4, 5].map(component))
        };
        Ok(PlantRun {
            reactions: windows.iter().map(reaction).collect(),
            recording,
            fell_at_s,
            tracking_error,
            history,
        })
    }
}
