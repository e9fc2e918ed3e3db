//! Where measurements come from: a trait, and a simulated robot over any backend.

use crate::{Controller, CurriculumError, Measured, Motion, Robot, RobotModel};
use phiw_dynamics::{BackendError, SimulationBackend, Tree, World};
use phiw_plant::{Effect, History, Plant, PlantSetup, Reaction, Run as PlantRun, Sensors, Timing};
use rand_chacha::ChaCha8Rng;

/// What happened when a motion was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The log.
    pub measured: Measured,
    /// When the robot fell, since the motion's start \[s\].
    pub fell_at_s: Option<f64>,
    /// RMS of each joint's tracking error \[rad, m\].
    pub tracking_error: Vec<f64>,
    /// What the floor gave, row by row; empty if it was not measured.
    pub reactions: Vec<Reaction>,
}

/// Tries motions on a robot: line 13 of Algorithm 1.
pub trait Experiment: Send + Sync {
    /// Lets the robot follow a motion with what is believed of it. The same `random` gives the same trial.
    ///
    /// # Errors
    /// The robot can not be run. A fall is no error.
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        random: &mut ChaCha8Rng,
    ) -> Result<Trial, CurriculumError>;
}

/// Makes a backend of the robot as it is built.
pub type BuildBackend =
    dyn Fn(&Tree, &World) -> Result<Box<dyn SimulationBackend>, BackendError> + Send + Sync;

/// A simulated robot: the plant of the paper's Figure 2, over any backend.
///
/// Each trial builds it anew, so that nothing that an engine remembers goes from one trial to the next, and a run that is taken up again is
/// the same run.
pub struct SimulatedRobot {
    /// The robot as it truly is; its base may float where the world has a floor.
    pub tree: Tree,
    /// Its world.
    pub world: World,
    /// What it has beside its rigid bodies, declared or not.
    pub effects: Vec<Effect>,
    /// Who makes the torques.
    pub controller: Box<dyn Controller>,
    /// Standard deviation of δf over the torque limit: 0.05 in the paper.
    pub actuator_noise: f64,
    /// How time is cut.
    pub timing: Timing,
    /// Tilt of its base at which it counts as fallen \[rad\].
    pub fall_tilt_rad: f64,
    /// When what it stands with counts as still.
    pub stillness: Stillness,
    /// Makes the backend.
    pub build: Box<BuildBackend>,
}

/// When a base or a foot counts as still: rows in which it moves are no rows of a robot that stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stillness {
    /// Turning rate of a base \[rad/s\]. Default: 0.01, what a gyroscope tells from its own noise.
    pub base_turning: f64,
    /// Time around a movement of the base that does not count either, since it lands before it rests \[s\]. Default: 0.1.
    pub settles_s: f64,
    /// Speed of a foot's sole \[m/s\]. Default: 0.005. A foot of a kilogram that goes through that within a millisecond takes 5 N.
    pub foot_speed: f64,
    /// Turning rate of a foot \[rad/s\]. Default: 0.05, the same over a lever of 0.1 m.
    pub foot_turning: f64,
}

impl Default for Stillness {
    fn default() -> Self {
        Stillness { base_turning: 0.01, settles_s: 0.1, foot_speed: 5e-3, foot_turning: 5e-2 }
    }
}

impl SimulatedRobot {
    /// Lets a plant of its own follow a motion of its motors.
    pub(crate) fn run(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        random: &mut ChaCha8Rng,
    ) -> Result<PlantRun, CurriculumError> {
        let setup = PlantSetup {
            effects: self.effects.clone(),
            actuator_noise: self.actuator_noise,
            // The command itself: a mean around the stamp would mix two of them.
            sensors: Sensors {
                period_s: self.timing.control_period_s,
                torque_window_s: 0.0,
                derivatives: true,
                ..Sensors::default()
            },
            timing: self.timing,
            fall_tilt_rad: self.fall_tilt_rad,
            ..PlantSetup::new(self.controller.controller(robot, model)?)
        };
        let mut plant = Plant::new(&self.tree, &self.world, setup, |tree, world| (self.build)(tree, world))?;
        Ok(plant.run(motion, motion.duration_s(), random)?)
    }

    /// For each row of the log, whether the base stood still until the next, as a gyroscope in it would tell; empty on a fixed base.
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
        random: &mut ChaCha8Rng,
    ) -> Result<Trial, CurriculumError> {
        let run = self.run(robot, model, motion, random)?;
        // A robot that falls at once has no log.
        let measured = match run.recording.len() {
            0 | 1 => Measured {
                joints: motion.joints(),
                period_s: self.timing.control_period_s,
                ..Measured::default()
            },
            _ => Measured { still: self.still(&run.history), ..Measured::from_recording(&run.recording)? },
        };
        Ok(Trial {
            measured,
            fell_at_s: run.fell_at_s,
            tracking_error: run.tracking_error,
            reactions: run.reactions,
        })
    }
}
