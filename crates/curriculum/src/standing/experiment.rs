//! A simulated robot on its feet, and what is measured of it.

use super::{Feet, VIRTUAL_JOINTS, base_coordinates};
use crate::{
    BuildBackend, Controller, CurriculumError, Experiment, Measured, Motion, Robot, RobotModel, Trial,
};
use phiw_dynamics::{Tree, World};
use phiw_plant::{Effect, History, Plant, PlantSetup, Sensors, Timing};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

const BASE: usize = VIRTUAL_JOINTS.len();

/// White noise of a six-axis sensor under each foot, of each mean over a control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchNoise {
    /// Of each force \[N\].
    pub force_n: f64,
    /// Of each moment about the middle of the sole \[N·m\].
    pub moment_nm: f64,
}

/// Speeds up to which a foot counts as still: of its sole \[m/s\], and turning \[rad/s\]. A foot of a kilogram that goes through them within a
/// millisecond takes 5 N.
const STILL: [f64; 2] = [5e-3, 5e-2];

/// A robot that stands on its feet, over any backend with contacts.
///
/// Rows in which a foot moves (noise of the motors can lift an edge of a sole) are no rows of a robot whose feet stay, and do not count.
///
/// Its motions have the coordinates of the tree with virtual joints. Measured are: positions and velocities of motors and base, exactly (encoders, and
/// motion capture of the base); the commands; and what the floor gives to each foot, on average over each control period, with
/// [`WrenchNoise`]. They enter the log as the generalised force u = \[0; command\] + J_cᵀ·f, of which Φ·w = u + \[0; δf\].
pub struct StandingRobot {
    /// The robot as it truly is, floating.
    pub tree: Tree,
    /// A floor under its feet.
    pub world: World,
    /// Its feet, in the tree with virtual joints, in the order of the world's.
    pub feet: Feet,
    /// What it has beside its rigid bodies.
    pub effects: Vec<Effect>,
    /// Who makes the torques.
    pub controller: Box<dyn Controller>,
    /// Standard deviation of δf over the torque limit.
    pub actuator_noise: f64,
    /// Of the sensors under the feet.
    pub wrench_noise: WrenchNoise,
    /// How time is cut.
    pub timing: Timing,
    /// Tilt of its base at which it counts as fallen \[rad\].
    pub fall_tilt_rad: f64,
    /// Makes the backend.
    pub build: Box<BuildBackend>,
}

impl Experiment for StandingRobot {
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        random: &mut ChaCha8Rng,
    ) -> Result<Trial, CurriculumError> {
        let setup = PlantSetup {
            effects: self.effects.clone(),
            actuator_noise: self.actuator_noise,
            sensors: Sensors { period_s: self.timing.control_period_s, ..Sensors::default() },
            timing: self.timing,
            fall_tilt_rad: self.fall_tilt_rad,
            ..PlantSetup::new(self.controller.controller(robot, model)?)
        };
        let mut plant = Plant::new(&self.tree, &self.world, setup, |tree, world| (self.build)(tree, world))?;
        let motors = of_motors(motion)?;
        let run = plant.run(&motors, motion.duration_s(), random)?;
        let mut noise = ChaCha8Rng::seed_from_u64(random.random());
        Ok(Trial {
            measured: self.measured(&run.history, motion.duration_s(), &mut noise)?,
            fell_at_s: run.fell_at_s,
            tracking_error: run.tracking_error,
            reactions: run.reactions,
        })
    }
}

/// The part of a motion that motors make.
fn of_motors(motion: &Motion) -> Result<Motion, CurriculumError> {
    let joints = motion.joints();
    let mut signals = [0; 3].map(|_| Vec::with_capacity(motion.samples() * joints));
    for sample in 0..motion.samples() {
        let parts = motion.sample(sample);
        signals
            .iter_mut()
            .zip(parts)
            .for_each(|(signal, part)| signal.extend_from_slice(&part[BASE.min(joints)..]));
    }
    Motion::new(&motion.name, &motion.task, joints.saturating_sub(BASE), motion.period_s(), signals)
}

impl StandingRobot {
    /// The log of a history from the motion's start to `end_s`.
    fn measured(
        &self,
        history: &History,
        end_s: f64,
        random: &mut ChaCha8Rng,
    ) -> Result<Measured, CurriculumError> {
        let period_s = self.timing.control_period_s;
        let (joints, feet) = (history.joints + BASE, self.feet.all().len());
        let told = 6 * feet * history.steps();
        if history.foot_wrenches.len() != told {
            let problem = "the engine does not tell what the floor gives to each foot".to_owned();
            return Err(CurriculumError::Motion { name: "as measured".to_owned(), problem });
        }
        let steps = (period_s / history.step_s).round().max(1.0) as usize;
        let first = (-history.start_s / history.step_s).round().max(0.0) as usize;
        let last = history.steps().min(first + (end_s / history.step_s).round() as usize);
        let mut measured = Measured { joints, period_s, ..Measured::default() };
        let boundaries: Vec<usize> = (first..=last).step_by(steps).collect();
        for &row in &boundaries {
            let (base, velocity) = (&history.base[7 * row..], &history.base_velocity[6 * row..]);
            let base: [f64; 7] = std::array::from_fn(|k| base[k]);
            let velocity: [f64; 6] = std::array::from_fn(|k| velocity[k]);
            let [position, speed] = base_coordinates(&base, &velocity);
            let own = row * history.joints..(row + 1) * history.joints;
            measured.q.extend(position.iter().chain(&history.link_angle[own.clone()]));
            measured.qd.extend(speed.iter().chain(&history.link_speed[own]));
        }
        let mut rest = Vec::with_capacity(boundaries.len());
        for index in 0..boundaries.len() {
            let own = index * joints..(index + 1) * joints;
            let speeds = self.feet.speeds(&measured.q[own.clone()], &measured.qd[own])?;
            rest.push(speeds.iter().zip(STILL).all(|(speed, still)| *speed <= still));
        }
        measured.still =
            (0..rest.len()).map(|row| rest[row] && rest.get(row + 1).copied().unwrap_or(true)).collect();
        let (mut middle, mut force) = (vec![0.0; joints], vec![0.0; joints]);
        let mut wrenches = vec![[0.0; 6]; feet];
        let mut normal = |deviation: f64| -> f64 {
            let draw: f64 = StandardNormal.sample(&mut *random);
            deviation * draw
        };
        for (index, &row) in boundaries.iter().enumerate() {
            if index + 1 == boundaries.len() {
                // Nothing is held after the last row.
                measured.tau.extend_from_within(measured.tau.len().saturating_sub(joints)..);
                break;
            }
            for (foot, wrench) in wrenches.iter_mut().enumerate() {
                let mean = |axis: usize| {
                    let values =
                        (row..row + steps).map(|step| history.foot_wrenches[6 * (feet * step + foot) + axis]);
                    values.sum::<f64>() / steps as f64
                };
                let standing = &self.feet.all()[foot];
                let [x, y, z] = standing.placement.point(standing.sole).0;
                let [fx, fy, fz] = [0; 3].map(|_| normal(self.wrench_noise.force_n));
                let [mx, my, mz] = [0; 3].map(|_| normal(self.wrench_noise.moment_nm));
                let noise = [fx, fy, fz, mx + y * fz - z * fy, my + z * fx - x * fz, mz + x * fy - y * fx];
                *wrench = std::array::from_fn(|axis| mean(axis) + noise[axis]);
            }
            let (now, next) = (index * joints, (index + 1) * joints);
            for (joint, middle) in middle.iter_mut().enumerate() {
                let [q0, q1] = [now, next].map(|at| measured.q[at + joint]);
                let [v0, v1] = [now, next].map(|at| measured.qd[at + joint]);
                *middle = 0.5 * (q0 + q1) - 0.125 * period_s * (v1 - v0);
            }
            force[..BASE].fill(0.0);
            force[BASE..].copy_from_slice(&history.command[row * history.joints..(row + 1) * history.joints]);
            self.feet.add_load(&middle, &wrenches, &mut force)?;
            measured.tau.extend_from_slice(&force);
        }
        Ok(measured)
    }
}
