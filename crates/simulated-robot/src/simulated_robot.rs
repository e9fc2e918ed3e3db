//! A simulated robot that tries motions, over any backend.

use crate::kept_balance::kept_balance;
use crate::measuring::{KnownOfController, asked};
use crate::{Controller, Measuring};
use phiw_curriculum::motion::Motion;
use phiw_curriculum::{CurriculumError, Experiment, Trial};
use phiw_dynamics::{BackendError, SimulationBackend, Tree, World};
use phiw_estimation::{Asked, KnownEffect, Logged, MotionLog, Robot, RobotModel};
use phiw_identification::effect::JointProperty;
use phiw_plant::{Friction, History, Plant, PlantEffect, PlantRun, PlantSetup, Sensors, Timing};
use phiw_zmp::Stance;
use rand::Rng;

/// Makes a backend of the robot as it is built.
pub type BuildBackend =
    dyn Fn(&Tree, &World) -> Result<Box<dyn SimulationBackend>, BackendError> + Send + Sync;

/// A simulated robot: the plant of the paper's Figure 2, over any backend.
///
/// Each trial builds it anew, so that nothing that an engine remembers goes from one trial to the next, and a
/// run that is taken up again is the same run.
pub struct SimulatedRobot {
    /// The robot as it truly is; its base may float where the world has a floor.
    pub tree: Tree,
    /// Its world.
    pub world: World,
    /// What it has beside its rigid bodies, declared or not.
    pub effects: Vec<PlantEffect>,
    /// Who makes the torques.
    pub controller: Box<dyn Controller>,
    /// Standard deviation of δf over the torque limit: 0.05 in the paper.
    pub actuator_noise: f64,
    /// What the log says of the motion and of the torques, a row every control period. The controller sees
    /// the encoders, too.
    pub sensors: Sensors,
    /// Correlation ρ of δf from one command to the next, between −1 and 1; 0 in the paper.
    pub noise_correlation: f64,
    /// What the log is like, where it is not all of the motion and the command, exactly.
    pub measuring: Measuring,
    /// How time is cut.
    pub timing: Timing,
    /// Tilt of its base at which it counts as fallen \[rad\].
    pub fall_tilt_rad: f64,
    /// What a robot that is bolted down would stand on, for [`Trial::kept`]; none if nobody asks.
    pub stance: Option<Stance>,
    /// When what it stands with counts as still.
    pub stillness: Stillness,
    /// Makes the backend.
    pub build: Box<BuildBackend>,
}

/// When a base or a foot counts as still: rows in which it moves are no rows of a robot that stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stillness {
    /// Turning rate of a base \[rad/s\]. Default: 0.01, what a gyroscope can distinguish from its own noise.
    pub base_turning: f64,
    /// Time around a movement of the base that does not count either, since it lands before it rests \[s\].
    /// Default: 0.1.
    pub settles_s: f64,
    /// Speed of a foot's sole \[m/s\]. Default: 0.005. A foot of a kilogram that goes through that within a
    /// millisecond takes 5 N.
    pub foot_speed: f64,
    /// Turning rate of a foot \[rad/s\]. Default: 0.05, the same over a lever of 0.1 m.
    pub foot_turning: f64,
}

impl Default for Stillness {
    fn default() -> Self {
        Stillness { base_turning: 0.01, settles_s: 0.1, foot_speed: 5e-3, foot_turning: 5e-2 }
    }
}

/// An effect of a model that has no counterpart in a plant.
#[derive(Debug, thiserror::Error)]
#[error(
    "no plant is built with {kind} from a model: leave it out there, and add it to the effects of the simulated robot"
)]
struct NotSimulated {
    kind: String,
}

impl SimulatedRobot {
    /// The robot that `truth` describes, on its fixed base: what its bodies and its effects are is stated
    /// there alone. Its actuators add no noise, its sensors are exact, and its time is cut as
    /// [`Timing::default`] says: set what should be otherwise.
    ///
    /// # Errors
    /// `truth` is not of this robot, or has an effect that no plant is built with from a model: add such a
    /// one to [`Self::effects`].
    pub fn new(
        robot: &Robot,
        truth: &RobotModel,
        controller: impl Controller + 'static,
        build: impl Fn(&Tree, &World) -> Result<Box<dyn SimulationBackend>, BackendError> + Send + Sync + 'static,
    ) -> Result<Self, CurriculumError> {
        let timing = Timing::default();
        Ok(SimulatedRobot {
            tree: truth.tree(robot)?,
            world: World::default(),
            effects: plant_effects(robot, truth)?,
            controller: Box::new(controller),
            actuator_noise: 0.0,
            noise_correlation: 0.0,
            measuring: Measuring::default(),
            sensors: Sensors::exact(timing.control_period_s),
            timing,
            fall_tilt_rad: 0.3,
            stance: None,
            stillness: Stillness::default(),
            build: Box::new(build),
        })
    }

    /// Standard deviation of each torque's noise \[N·m, N\]: what the actuator adds and what its sensor adds.
    pub fn torque_noise(&self) -> Vec<f64> {
        let noise = |joint: usize| {
            let sensor = self.sensors.torque_noise.get(joint).copied().unwrap_or(0.0);
            let sensor = match self.measuring.torque_noise {
                0.0 => sensor,
                share => sensor.hypot(share * self.tree.joint(joint).limits.effort),
            };
            match self.actuator_noise {
                0.0 => sensor,
                share => sensor.hypot(share * self.tree.joint(joint).limits.effort),
            }
        };
        (0..self.tree.joint_count()).map(noise).collect()
    }

    /// Builds a plant and has it follow a motion of the motors.
    pub(crate) fn run(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<PlantRun, CurriculumError> {
        let sensors = self.measuring.sensors(&self.sensors, self.tree.joint_count());
        let period_s = self.sensors.period_s;
        if (period_s / self.timing.control_period_s - 1.0).abs() > 1e-9 {
            let must_be =
                "the control period, since a row's torque is the one that is held until the next row";
            return Err(CurriculumError::Value { what: "the sensors' period", value: period_s, must_be });
        }
        let setup = PlantSetup {
            effects: self.effects.clone(),
            actuator_noise: self.actuator_noise,
            actuator_noise_correlation: self.noise_correlation,
            sensors,
            timing: self.timing,
            fall_tilt_rad: self.fall_tilt_rad,
            ..PlantSetup::new(self.controller.controller(robot, model)?)
        };
        let mut plant = Plant::new(&self.tree, &self.world, setup, |tree, world| (self.build)(tree, world))
            .map_err(CurriculumError::of_experiment)?;
        let reference = |t_s: f64, q: &mut [f64], v: &mut [f64], a: &mut [f64]| motion.at(t_s, q, v, a);
        plant.run(&reference, motion.duration_s(), rng).map_err(CurriculumError::of_experiment)
    }

    /// What the controller was asked for at each row of a log.
    fn asked(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        log: &MotionLog,
    ) -> Result<Asked, CurriculumError> {
        let mut controller = self.controller.controller(robot, model)?;
        asked(motion, log, |reference, torque| {
            controller.feed_forward(reference, torque).map_err(CurriculumError::from)
        })
    }

    /// For each row of the log, whether the base stood still until the next, as a gyroscope in it would
    /// measure; empty on a fixed base.
    fn still(&self, history: &History) -> Vec<bool> {
        let period_s = self.timing.control_period_s;
        let row = |t_s: f64| ((t_s - history.start_s) / history.step_s).round() as usize;
        let orientation = |t_s: f64| history.base.get(7 * row(t_s) + 3..7 * row(t_s) + 7);
        let rate = |t_s: f64| -> Option<f64> {
            let (before, after) = (orientation(t_s)?, orientation(t_s + period_s)?);
            let along: f64 = before.iter().zip(after).map(|(a, b)| a * b).sum();
            // 1 − cos² in this form keeps the digits of small angles.
            let difference: f64 = before.iter().zip(after).map(|(a, b)| (a - along * b).powi(2)).sum();
            Some(2.0 * difference.sqrt() / period_s)
        };
        let moves: Vec<bool> = (0_u32..)
            .map_while(|row| rate(f64::from(row) * period_s))
            .map(|rate| rate > self.stillness.base_turning)
            .collect();
        let reach = (self.stillness.settles_s / period_s).round() as usize;
        let around = |row: usize| &moves[row.saturating_sub(reach)..(row + reach + 1).min(moves.len())];
        (0..moves.len()).map(|row| !around(row).contains(&true)).collect()
    }
}

impl Experiment for SimulatedRobot {
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<Trial, CurriculumError> {
        let run = self.run(robot, model, motion, rng)?;
        self.trial(&run, robot, model, motion, rng)
    }

    fn known_torque_noise(&self) -> Option<Vec<f64>> {
        Some(self.torque_noise())
    }
}

impl SimulatedRobot {
    /// A trial, and what a logger on the robot writes down of it: a row for each reading of the encoders.
    ///
    /// # Errors
    /// As [`Experiment::perform`].
    pub fn perform_logged(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<(Trial, Logged), CurriculumError> {
        let run = self.run(robot, model, motion, rng)?;
        let trial = self.trial(&run, robot, model, motion, rng)?;
        let logged = self.measuring.logged(&run.recording, &trial.measured);
        Ok((trial, logged))
    }

    fn trial(
        &self,
        run: &PlantRun,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<Trial, CurriculumError> {
        // A robot that falls at once has no log.
        let measured = match run.recording.len() {
            0 | 1 => MotionLog {
                joints: motion.joints(),
                period_s: self.timing.control_period_s,
                ..MotionLog::default()
            },
            _ => MotionLog {
                still: self.still(&run.history),
                ..self.measuring.log(run, &self.tree, &self.timing, rng)?
            },
        };
        let measured = match self.measuring.controller == KnownOfController::Reference && measured.rows() > 1
        {
            true => MotionLog { asked: Some(self.asked(robot, model, motion, &measured)?), ..measured },
            false => measured,
        };
        let kept = |stance| kept_balance(&run.history, &self.tree, robot.base_link(), stance);
        Ok(Trial {
            measured,
            fell_at_s: run.fell_at_s,
            tracking_error: run.tracking_error.clone(),
            kept: self.stance.as_ref().map(kept).transpose()?.flatten(),
        })
    }
}

/// The effects of a model as a plant has them: those that simulators express as a property of a joint.
fn plant_effects(robot: &Robot, model: &RobotModel) -> Result<Vec<PlantEffect>, CurriculumError> {
    robot.design(&model.specs())?;
    let effect = |known: &KnownEffect| {
        let property = robot.catalogue().joint_property(&known.spec);
        let joint = known.spec.joints.first().and_then(|joint| robot.tree().joint_index(joint));
        let (Some(property), Some(joint), &[value]) = (property, joint, known.parameters.as_slice()) else {
            return Err(CurriculumError::of_experiment(NotSimulated { kind: known.spec.kind.clone() }));
        };
        let width = known.spec.constants.get("sign_width").copied().unwrap_or(0.0);
        Ok(match property {
            JointProperty::Damping => {
                PlantEffect::Friction { joint, law: Friction::Viscous { coefficient: value } }
            }
            JointProperty::Friction => {
                PlantEffect::Friction { joint, law: Friction::Coulomb { torque: value, width } }
            }
            JointProperty::Armature => PlantEffect::RotorInertia { joint, inertia: value },
        })
    };
    model.effects.iter().map(effect).collect()
}
