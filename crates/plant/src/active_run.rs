//! A run under way: the controller's periods, and the integration steps within them.
//!
//! `Plant::run` begins a motion and steps it, and each step works in the plant: the two files name each other
//! because a run cannot outlive its plant.

use crate::joint_drive::JointDrive;
use crate::plant::Plant;
use crate::sensors::normal;
use crate::standing::{standing_configuration, tilt};
use crate::step_solver::{StepSolver, StepStart};
use crate::{History, PlantEffect, PlantError, Reference};
use phiw_dynamics::{Placement, Tree, Vec3, Workspace};
use rand_chacha::ChaCha8Rng;

/// Time after which the mobility of the joints is computed anew \[s\].
const MOBILITY_AGE_S: f64 = 5e-3;

/// A run under way.
pub(crate) struct ActiveRun {
    pub(crate) history: History,
    solver: StepSolver,
    actuator_rng: ChaCha8Rng,
    encoder_rng: ChaCha8Rng,
    /// Integration steps of a control period.
    substeps: usize,
    /// Configuration and velocity of base and joints.
    q: Vec<f64>,
    v: Vec<f64>,
    drive_angle: Vec<f64>,
    drive_speed: Vec<f64>,
    /// q*, q̇*, q̈*.
    reference: [Vec<f64>; 3],
    measured: Vec<f64>,
    command: Vec<f64>,
    delivered: Vec<f64>,
    /// The actuators' own noise, of unit variance.
    actuator_noise: Vec<f64>,
    external: Vec<f64>,
    jacobian: Vec<f64>,
    placements: Vec<Placement<f64>>,
    pub(crate) tracking_error: Vec<f64>,
    tracked: usize,
}

impl ActiveRun {
    /// Puts the robot at rest into the reference's first posture.
    pub(crate) fn begin(
        plant: &mut Plant,
        reference: &dyn Reference,
        [actuator_rng, encoder_rng]: [ChaCha8Rng; 2],
    ) -> Result<Self, PlantError> {
        let Plant { tree, world, backend, drives, timing, .. } = plant;
        let joints = tree.joint_count();
        let zeros = || vec![0.0; joints];
        let mut first = [zeros(), zeros(), zeros()];
        ask(reference, 0.0, &mut first)?;
        let q = standing_configuration(tree, world, &first[0])?;
        let v = vec![0.0; tree.velocity_size()];
        let mut force = v.clone();
        tree.inverse_dynamics(&q, &v, &v, &mut Workspace::new(tree), &mut force)?;
        let holding = force[force.len() - joints..].to_vec();
        // Springs of transmissions start with what they hold, so that nothing jumps.
        let drive_angle = (0..joints)
            .map(|joint| {
                first[0][joint] + drives[joint].flexible.map_or(0.0, |spring| spring.twist(holding[joint]))
            })
            .collect();
        drives.iter_mut().for_each(JointDrive::reset);
        backend.set_state(&q, &v).map_err(|source| PlantError::Backend { t_s: -timing.settle_s, source })?;
        let substeps = (timing.control_period_s / timing.longest_step_s - 1e-9).ceil().max(1.0) as usize;
        let step_s = timing.control_period_s / substeps as f64;
        let settling = (timing.settle_s / timing.control_period_s).round();
        Ok(ActiveRun {
            history: History {
                joints,
                start_s: -settling * timing.control_period_s,
                step_s,
                ..History::default()
            },
            solver: StepSolver::new(tree, holding),
            actuator_rng,
            encoder_rng,
            substeps,
            v,
            drive_angle,
            drive_speed: zeros(),
            measured: zeros(),
            command: zeros(),
            delivered: zeros(),
            actuator_noise: zeros(),
            external: zeros(),
            jacobian: vec![0.0; 6 * tree.velocity_size()],
            placements: vec![Placement::identity(); tree.bodies().len()],
            tracking_error: zeros(),
            tracked: 0,
            reference: first,
            q,
        })
    }

    /// Runs to `end_s`, and returns when the robot fell. Tracking counts up to `duration_s`.
    pub(crate) fn follow(
        &mut self,
        plant: &mut Plant,
        reference: &dyn Reference,
        [duration_s, end_s]: [f64; 2],
    ) -> Result<Option<f64>, PlantError> {
        let start_s = self.history.start_s;
        let periods = ((end_s - start_s) / plant.timing.control_period_s - 1e-9).ceil() as usize;
        let mut fell_at_s = None;
        'run: for period in 0..periods {
            let t_s = start_s + period as f64 * plant.timing.control_period_s;
            self.control(plant, reference, t_s, duration_s)?;
            for substep in 0..self.substeps {
                let t_s = t_s + substep as f64 * self.history.step_s;
                self.step(plant, t_s).map_err(|error| match error {
                    PlantError::Backend { source, .. } => PlantError::Backend { t_s, source },
                    other => other,
                })?;
                if !plant.world.feet.is_empty() && tilt(&self.q[..7]) > plant.fall_tilt_rad {
                    fell_at_s = Some(t_s + self.history.step_s);
                    break 'run;
                }
            }
        }
        self.note_state(plant.tree.is_floating());
        let tracked = self.tracked.max(1) as f64;
        self.tracking_error.iter_mut().for_each(|sum| *sum = (*sum / tracked).sqrt());
        Ok(fell_at_s)
    }

    /// The controller reads the encoders and commands; the actuators deliver what they can.
    fn control(
        &mut self,
        plant: &mut Plant,
        reference: &dyn Reference,
        t_s: f64,
        duration_s: f64,
    ) -> Result<(), PlantError> {
        ask(reference, t_s.clamp(0.0, duration_s), &mut self.reference)?;
        let moving = t_s >= -0.5 * self.history.step_s;
        if !moving {
            self.reference[1].fill(0.0);
            self.reference[2].fill(0.0);
        }
        for (joint, measured) in self.measured.iter_mut().enumerate() {
            let angle = self.drive_angle[joint] - plant.drives[joint].encoder_offset;
            *measured = plant.sensors.encode(joint, angle, &mut self.encoder_rng);
        }
        let [q, v, a] = &self.reference;
        if moving && t_s <= duration_s {
            self.tracked += 1;
            let first_joint = self.q.len() - q.len();
            for (joint, sum) in self.tracking_error.iter_mut().enumerate() {
                *sum += (self.q[first_joint + joint] - q[joint]).powi(2);
            }
        }
        plant.controller.command([q, v, a], [&self.measured, &self.drive_speed], &mut self.command)?;
        for (joint, command) in self.command.iter_mut().enumerate() {
            let limit = plant.effort[joint];
            *command = command.clamp(-limit, limit);
            self.delivered[joint] = plant.drives[joint].delivered(*command);
            if plant.actuator_noise > 0.0 {
                let correlation = plant.actuator_noise_correlation;
                let fresh = (1.0 - correlation * correlation).sqrt() * normal(&mut self.actuator_rng);
                self.actuator_noise[joint] = correlation * self.actuator_noise[joint] + fresh;
                self.delivered[joint] += plant.actuator_noise * limit * self.actuator_noise[joint];
            }
        }
        Ok(())
    }

    fn step(&mut self, plant: &mut Plant, t_s: f64) -> Result<(), PlantError> {
        let Plant { tree, world, backend, drives, couplings, effects, timing, clock_s, .. } = plant;
        let (step_s, joints) = (self.history.step_s, self.history.joints);
        let (first_q, first_v) = (self.q.len() - joints, self.v.len() - joints);
        let age = ((MOBILITY_AGE_S / step_s) as usize).max(1);
        if self.history.steps().is_multiple_of(age) {
            self.solver.refresh(tree, &self.q, &world.rotor_inertia, !world.feet.is_empty())?;
        }
        self.pull(tree, effects)?;
        let start = StepStart {
            link_angle: &self.q[first_q..],
            link_speed: &self.v[first_v..],
            drive_angle: &self.drive_angle,
            drive_speed: &self.drive_speed,
            external: &self.external,
            delivered: &self.delivered,
            rotor_inertia: &world.rotor_inertia,
            t_s: *clock_s + timing.settle_s + t_s,
            step_s,
        };
        self.solver.solve(&start, drives, couplings);
        self.note_state(tree.is_floating());
        let before = self.v[first_v..].to_vec();
        backend.step(&self.solver.torque, step_s).map_err(|source| PlantError::Backend { t_s, source })?;
        self.note_step(backend.base_wrench());
        let feet = (0..world.feet.len()).filter_map(|foot| backend.foot_wrench(foot));
        self.history.foot_wrenches.extend(feet.flatten());
        backend.state(&mut self.q, &mut self.v).map_err(|source| PlantError::Backend { t_s, source })?;
        self.solver.learn(&before, &self.v[first_v..], step_s);
        for (joint, drive) in drives.iter_mut().enumerate() {
            drive.advance(self.solver.drive_speed[joint], step_s);
            if drive.flexible.is_some() {
                let speed = self.solver.drive_speed[joint];
                self.drive_angle[joint] += 0.5 * step_s * (self.drive_speed[joint] + speed);
                self.drive_speed[joint] = speed;
            } else {
                self.drive_angle[joint] = self.q[first_q + joint];
                self.drive_speed[joint] = self.v[first_v + joint];
            }
        }
        Ok(())
    }

    /// What external forces ask of the joints: −Jᵀ·force.
    fn pull(&mut self, tree: &Tree, effects: &[PlantEffect]) -> Result<(), PlantError> {
        self.external.fill(0.0);
        let mut placed = false;
        for effect in effects {
            let PlantEffect::ExternalForce { body, point, force } = effect else { continue };
            if !placed {
                tree.forward_kinematics(&self.q, &mut self.placements)?;
                placed = true;
            }
            tree.point_jacobian(&self.placements, *body, Vec3(*point), &mut self.jacobian)?;
            let joints = self.external.len();
            for (joint, torque) in self.external.iter_mut().enumerate() {
                let along: f64 = (0..3).map(|row| self.jacobian[row * joints + joint] * force[row]).sum();
                *torque -= along;
            }
        }
        Ok(())
    }

    fn note_state(&mut self, floating: bool) {
        let (joints, history) = (self.history.joints, &mut self.history);
        history.link_angle.extend_from_slice(&self.q[self.q.len() - joints..]);
        history.link_speed.extend_from_slice(&self.v[self.v.len() - joints..]);
        history.drive_angle.extend_from_slice(&self.drive_angle);
        history.drive_speed.extend_from_slice(&self.drive_speed);
        if floating {
            history.base.extend_from_slice(&self.q[..7]);
            history.base_velocity.extend_from_slice(&self.v[..6]);
        }
    }

    fn note_step(&mut self, wrench: [f64; 6]) {
        self.history.command.extend_from_slice(&self.command);
        self.history.delivered.extend_from_slice(&self.delivered);
        self.history.joint_torque.extend_from_slice(&self.solver.torque);
        self.history.wrench.extend_from_slice(&wrench);
    }
}

/// The reference at a time, if it is finite.
fn ask(reference: &dyn Reference, t_s: f64, [q, v, a]: &mut [Vec<f64>; 3]) -> Result<(), PlantError> {
    reference.at(t_s, q, v, a);
    if q.iter().chain(&*v).chain(&*a).all(|x| x.is_finite()) {
        Ok(())
    } else {
        Err(PlantError::Reference { t_s })
    }
}
