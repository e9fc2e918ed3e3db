//! A simulated robot on its feet, and what is measured of it.

use crate::SimulatedRobot;
use phiw_curriculum::motion::Motion;
use phiw_curriculum::standing::{Feet, VIRTUAL_JOINTS, base_coordinates};
use phiw_curriculum::{CurriculumError, Experiment, Trial};
use phiw_estimation::{MotionLog, Robot, RobotModel};
use phiw_plant::{History, Sensors};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::ops::Range;

const BASE: usize = VIRTUAL_JOINTS.len();

/// White noise of a six-axis sensor under each foot, of each mean over a control period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrenchNoise {
    /// Of each force \[N\].
    pub force_n: f64,
    /// Of each moment about the middle of the sole \[N·m\].
    pub moment_nm: f64,
}

impl WrenchNoise {
    /// Standard deviation of the noise in the rows of the virtual joints \[N, N·m\], for so many feet with
    /// `lever_m` \[m\] between their soles and the base: by this lever the forces' noise is noise of the
    /// moments at the base.
    pub fn at_base(&self, feet: usize, lever_m: f64) -> [f64; BASE] {
        let feet = (feet as f64).sqrt();
        let force = feet * self.force_n;
        let moment = feet * self.moment_nm.hypot(lever_m * self.force_n);
        [force, force, force, moment, moment, moment]
    }
}

/// A robot that stands on its feet, over any backend with contacts.
///
/// Rows in which a foot moves (noise of the motors can lift an edge of a sole) are no rows of a robot whose
/// feet stay, and do not count.
///
/// Its motions have the coordinates of the tree with virtual joints. Measured are: positions and velocities
/// of motors and base, exactly (encoders, and motion capture of the base); the commands; and what the floor
/// gives to each foot, on average over each control period, with [`WrenchNoise`]. They enter the log as the
/// generalised force u = \[0; command\] + J_cᵀ·f, of which Φ·w = u + \[0; δf\].
pub struct StandingRobot {
    /// The robot, floating, with a floor under its feet.
    pub plant: SimulatedRobot,
    /// Its feet, in the tree with virtual joints, in the order of the world's.
    pub feet: Feet,
    /// Of the sensors under the feet.
    pub wrench_noise: WrenchNoise,
}

impl Experiment for StandingRobot {
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<Trial, CurriculumError> {
        if self.plant.sensors != Sensors::exact(self.plant.timing.control_period_s) {
            let problem = "motors and base of a robot on its feet are measured exactly: leave its sensors \
                 at Sensors::exact, and set wrench_noise"
                .to_owned();
            return Err(CurriculumError::Motion { name: "as measured".to_owned(), problem });
        }
        let run = self.plant.run(robot, model, &of_motors(motion)?, rng)?;
        let mut noise = ChaCha8Rng::seed_from_u64(rng.random());
        Ok(Trial {
            measured: self.measured(&run.history, motion.duration_s(), &mut noise)?,
            fell_at_s: run.fell_at_s,
            tracking_error: run.tracking_error,
            kept: None,
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

/// How far an engine's positions are ahead of its velocities \[s\].
///
/// A step is Δq = h·(v₁ − λ·(v₁ − v₀)). A semi-implicit one has λ = 0: read as what it is, a leapfrog, its
/// velocities belong to the middles between its positions. Taken for those of one instant they do harm where
/// noise moves the robot: the mean velocity over a period then follows the noise of the period by more than
/// half of what the noise does to the velocity, and the estimate takes the difference for negative friction
/// (−1.6 N·m·s/rad in a waist that has 1.3, from 4 N·m of noise and periods of two steps). λ is computed from
/// the history.
fn position_lead_s(history: &History) -> f64 {
    let (mut along, mut square) = (0.0, 0.0);
    let next = history.link_speed.iter().zip(&history.link_angle).skip(history.joints);
    for ((v0, q0), (v1, q1)) in history.link_speed.iter().zip(&history.link_angle).zip(next) {
        let change = v1 - v0;
        along += change * (v1 - (q1 - q0) / history.step_s);
        square += change * change;
    }
    let lambda = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.5 };
    (0.5 - lambda) * history.step_s
}

/// The steps of a history that are rows of a log.
struct Rows {
    /// The step at which each row begins.
    starts: Vec<usize>,
    /// Steps over which one command is held.
    steps: usize,
}

impl StandingRobot {
    /// The log of a history from the motion's start to `end_s`.
    fn measured(
        &self,
        history: &History,
        end_s: f64,
        rng: &mut ChaCha8Rng,
    ) -> Result<MotionLog, CurriculumError> {
        let period_s = self.plant.timing.control_period_s;
        if history.foot_wrenches.len() != 6 * self.feet.all().len() * history.steps() {
            let problem = "the engine does not tell what the floor gives to each foot".to_owned();
            return Err(CurriculumError::Motion { name: "as measured".to_owned(), problem });
        }
        let steps = (period_s / history.step_s).round().max(1.0) as usize;
        let first = (-history.start_s / history.step_s).round().max(0.0) as usize;
        let last = history.steps().min(first + (end_s / history.step_s).round() as usize);
        let rows = Rows { starts: (first..=last).step_by(steps).collect(), steps };
        let joints = history.joints + BASE;
        let mut measured = MotionLog { joints, period_s, ..MotionLog::default() };
        [measured.q, measured.qd] = motion(history, &rows);
        measured.still = self.still(&measured)?;
        measured.tau = self.forces(history, &rows, &measured, rng)?;
        Ok(measured)
    }

    /// For each row, whether no foot moves in it and in the next.
    fn still(&self, measured: &MotionLog) -> Result<Vec<bool>, CurriculumError> {
        let stillness = &self.plant.stillness;
        let limits = [stillness.foot_speed, stillness.foot_turning];
        let joints = measured.joints;
        let mut rest = Vec::with_capacity(measured.rows());
        for (q, qd) in measured.q.chunks_exact(joints).zip(measured.qd.chunks_exact(joints)) {
            let speeds = self.feet.speeds(q, qd)?;
            rest.push(speeds.iter().zip(limits).all(|(speed, limit)| *speed <= limit));
        }
        Ok((0..rest.len()).map(|row| rest[row] && rest.get(row + 1).copied().unwrap_or(true)).collect())
    }

    /// The generalised forces of all rows, `[row × joint]`: the commands, and what the floor gives to the
    /// feet in the middle of a period.
    fn forces(
        &self,
        history: &History,
        rows: &Rows,
        measured: &MotionLog,
        rng: &mut ChaCha8Rng,
    ) -> Result<Vec<f64>, CurriculumError> {
        let (joints, period_s) = (measured.joints, measured.period_s);
        let (mut middle, mut force) = (vec![0.0; joints], vec![0.0; joints]);
        let mut forces = Vec::with_capacity(rows.starts.len() * joints);
        let periods = rows.starts.len().saturating_sub(1);
        for (index, &start) in rows.starts.iter().take(periods).enumerate() {
            let wrenches: Vec<[f64; 6]> = (0..self.feet.all().len())
                .map(|foot| self.wrench(history, start..start + rows.steps, foot, rng))
                .collect();
            let (now, next) = (index * joints, (index + 1) * joints);
            for (joint, middle) in middle.iter_mut().enumerate() {
                let [q0, q1] = [now, next].map(|at| measured.q[at + joint]);
                let [v0, v1] = [now, next].map(|at| measured.qd[at + joint]);
                *middle = 0.5 * (q0 + q1) - 0.125 * period_s * (v1 - v0);
            }
            force[..BASE].fill(0.0);
            let command = start * history.joints..(start + 1) * history.joints;
            force[BASE..].copy_from_slice(&history.command[command]);
            self.feet.add_load(&middle, &wrenches, &mut force)?;
            forces.extend_from_slice(&force);
        }
        // Nothing is held after the last row.
        if !rows.starts.is_empty() {
            forces.extend_from_within(forces.len().saturating_sub(joints)..);
        }
        Ok(forces)
    }

    /// What the sensor under a foot measures over some steps: the mean of force \[N\] and moment about the
    /// world's origin \[N·m\], with its noise.
    fn wrench(&self, history: &History, steps: Range<usize>, foot: usize, rng: &mut ChaCha8Rng) -> [f64; 6] {
        let feet = self.feet.all().len();
        let count = steps.len() as f64;
        let mean = |axis: usize| {
            let values = steps.clone().map(|step| history.foot_wrenches[6 * (feet * step + foot) + axis]);
            values.sum::<f64>() / count
        };
        let mut normal = |deviation: f64| -> f64 {
            let draw: f64 = StandardNormal.sample(&mut *rng);
            deviation * draw
        };
        let standing = &self.feet.all()[foot];
        let [x, y, z] = standing.placement.point(standing.sole).0;
        let [fx, fy, fz] = [0; 3].map(|_| normal(self.wrench_noise.force_n));
        let [mx, my, mz] = [0; 3].map(|_| normal(self.wrench_noise.moment_nm));
        let noise = [fx, fy, fz, mx + y * fz - z * fy, my + z * fx - x * fz, mz + x * fy - y * fx];
        std::array::from_fn(|axis| mean(axis) + noise[axis])
    }
}

/// Positions and velocities of base and motors at the rows, `[row × joint]`.
fn motion(history: &History, rows: &Rows) -> [Vec<f64>; 2] {
    let lead_s = position_lead_s(history);
    let (mut q, mut qd) = (Vec::new(), Vec::new());
    for &row in &rows.starts {
        let (base, velocity) = (&history.base[7 * row..], &history.base_velocity[6 * row..]);
        let base: [f64; 7] = std::array::from_fn(|k| base[k]);
        let velocity: [f64; 6] = std::array::from_fn(|k| velocity[k]);
        let [position, speed] = base_coordinates(&base, &velocity);
        let own = row * history.joints..(row + 1) * history.joints;
        let positions = position.iter().chain(&history.link_angle[own.clone()]);
        let speeds = || speed.iter().chain(&history.link_speed[own.clone()]);
        q.extend(positions.zip(speeds()).map(|(position, speed)| position - lead_s * speed));
        qd.extend(speeds());
    }
    [q, qd]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Steps of a pendulum, each as λ says.
    #[test]
    fn positions_lead_by_half_a_step_where_steps_are_semi_implicit() {
        for (lambda, lead) in [(0.0, 0.5), (0.5, 0.0), (1.0, -0.5)] {
            let step_s = 1e-3;
            let mut history = History { joints: 1, step_s, ..History::default() };
            let (mut q, mut v) = (0.3_f64, 0.0);
            for _ in 0..500 {
                history.link_angle.push(q);
                history.link_speed.push(v);
                let next = v - step_s * 9.0 * q.sin();
                q += step_s * (next - lambda * (next - v));
                v = next;
            }
            assert!((position_lead_s(&history) / step_s - lead).abs() < 1e-6, "{lambda}");
        }
        // A robot at rest tells nothing, and nothing is lost.
        let rest = History {
            joints: 1,
            step_s: 1e-3,
            link_angle: vec![0.1; 9],
            link_speed: vec![0.0; 9],
            ..History::default()
        };
        assert_eq!(position_lead_s(&rest), 0.0);
    }
}
