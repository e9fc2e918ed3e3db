//! A simulated robot on its feet, and what is measured of it.

use crate::SimulatedRobot;
use phiw_curriculum::standing::{Feet, VIRTUAL_JOINTS, base_coordinates};
use phiw_curriculum::{CurriculumError, Experiment, Measured, Motion, Robot, RobotModel, Trial};
use phiw_plant::{History, Sensors};
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
        random: &mut ChaCha8Rng,
    ) -> Result<Trial, CurriculumError> {
        if self.plant.sensors != Sensors::exact(self.plant.timing.control_period_s) {
            let problem = "motors and base of a robot on its feet are measured exactly: leave its sensors at Sensors::exact, and set wrench_noise".to_owned();
            return Err(CurriculumError::Motion { name: "as measured".to_owned(), problem });
        }
        let run = self.plant.run(robot, model, &of_motors(motion)?, random)?;
        let mut noise = ChaCha8Rng::seed_from_u64(random.random());
        Ok(Trial {
            measured: self.measured(&run.history, motion.duration_s(), &mut noise)?,
            fell_at_s: run.fell_at_s,
            tracking_error: run.tracking_error,
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
/// (−1.6 N·m·s/rad in a waist that has 1.3, from 4 N·m of noise and periods of two steps). The history tells
/// λ.
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

impl StandingRobot {
    /// The log of a history from the motion's start to `end_s`.
    fn measured(
        &self,
        history: &History,
        end_s: f64,
        random: &mut ChaCha8Rng,
    ) -> Result<Measured, CurriculumError> {
        let period_s = self.plant.timing.control_period_s;
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
        let lead_s = position_lead_s(history);
        let boundaries: Vec<usize> = (first..=last).step_by(steps).collect();
        for &row in &boundaries {
            let (base, velocity) = (&history.base[7 * row..], &history.base_velocity[6 * row..]);
            let base: [f64; 7] = std::array::from_fn(|k| base[k]);
            let velocity: [f64; 6] = std::array::from_fn(|k| velocity[k]);
            let [position, speed] = base_coordinates(&base, &velocity);
            let own = row * history.joints..(row + 1) * history.joints;
            let positions = position.iter().chain(&history.link_angle[own.clone()]);
            let speeds = || speed.iter().chain(&history.link_speed[own.clone()]);
            measured.q.extend(positions.zip(speeds()).map(|(position, speed)| position - lead_s * speed));
            measured.qd.extend(speeds());
        }
        let mut rest = Vec::with_capacity(boundaries.len());
        for index in 0..boundaries.len() {
            let own = index * joints..(index + 1) * joints;
            let speeds = self.feet.speeds(&measured.q[own.clone()], &measured.qd[own])?;
            rest.push(
                speeds
                    .iter()
                    .zip([self.plant.stillness.foot_speed, self.plant.stillness.foot_turning])
                    .all(|(speed, still)| *speed <= still),
            );
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
