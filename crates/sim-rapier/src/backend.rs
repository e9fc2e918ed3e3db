//! The trait over the engine.

use crate::articulation::Articulation;
use crate::asked_wrench::AskedWrench;
use crate::body_kinematics::LinkMotions;
use crate::floor::Soles;
use crate::probe::Probe;
use crate::{NAME, error};
use phiw_dynamics::body_kinematics::{BodyJoint, BodyMotion};
use phiw_dynamics::check::check_size;
use phiw_dynamics::{
    AnalyticBackend, BackendError, BodyKinematics, DynamicsBackend, Placement, SimulationBackend, Tree, World,
};
use rapier3d_f64::prelude::PhysicsWorld;

/// Iterations of a step unless [`RapierBackend::with_solver_iterations`] says otherwise.
///
/// At steps of 1 ms an 18-joint robot in closed loop is then within 0.2 mrad of the exact motion, which is
/// what encoders see. A robot with mimic joints has twice as many, as the engine finds the forces between
/// them by iteration.
pub const DEFAULT_SOLVER_ITERATIONS: usize = 8;

/// A robot in a [`World`], moved by Rapier's reduced-coordinate multibody.
///
/// **Inverse and forward dynamics** are exact up to rounding: they come from the engine's mass matrix and
/// accelerations, in empty worlds beside the one that is stepped.
///
/// **The motion of bodies** ([`BodyKinematics`]) comes from the poses and Jacobians of the engine's links in
/// such a world.
///
/// **A step** is made of as many smaller ones as there are solver iterations, semi-implicit Euler each, so
/// its error is of first order in `dt` over their number. The crate's README has numbers.
///
/// **[`World::rotor_inertia`]** is part of the mass matrix: of inverse and forward dynamics and of steps. It
/// gives the base no wrench.
///
/// **Mimic joints** are exact in inverse and forward dynamics (the latter allocates for them, as the engine
/// does in every step). In steps they are couplings that the engine solves iteratively, so few iterations let
/// them stray.
///
/// **The feet**: each corner of a sole is a contact point with Coulomb friction, on the floor `z = 0`.
///
/// **[`base_wrench`](DynamicsBackend::base_wrench)**: after a step of a floating base, what the contacts
/// gave, from the engine's impulses on average over the step. The engine does not tell what holds a fixed
/// base, nor has it an inverse dynamics: there, and after `inverse_dynamics`, it is the Newton-Euler sum over
/// the bodies, by this workspace's own algorithm, for the motion that the engine has made (its velocities'
/// change over the step) or that was asked for.
pub struct RapierBackend {
    /// Holds the state, and knows what a right state is.
    analytic: AnalyticBackend,
    articulation: Articulation,
    soles: Soles,
    probe: Probe,
    link_motions: LinkMotions,
    base_wrench: AskedWrench,
    /// What each foot got in the last step; none before one.
    foot_wrenches: Vec<[f64; 6]>,
    stepped: bool,
    scratch: Scratch,
}

struct Scratch {
    q: Vec<f64>,
    v: Vec<f64>,
    next_q: Vec<f64>,
    next_v: Vec<f64>,
    a: Vec<f64>,
    force: Vec<f64>,
    placements: Vec<Placement<f64>>,
}

impl RapierBackend {
    /// The robot in its world, at rest in its neutral configuration.
    ///
    /// # Errors
    /// The world does not fit the robot, or the robot is one that Rapier can not hold: no joints, a negative
    /// mass, or principal moments of inertia that are not positive or more than a million apart.
    pub fn new(tree: &Tree, world: &World) -> Result<Self, BackendError> {
        world.check(tree)?;
        let mut articulation = Articulation::new(tree, &world.rotor_inertia, world.position_limits)?;
        articulation.couple_followers()?;
        articulation.world.integration_parameters.num_solver_iterations = if articulation.has_followers() {
            2 * DEFAULT_SOLVER_ITERATIONS
        } else {
            DEFAULT_SOLVER_ITERATIONS
        };
        let soles = Soles::new(&mut articulation, tree, world);
        let (q, v) = (tree.neutral_configuration(), vec![0.0; tree.velocity_size()]);
        articulation.set_state(&q, &v)?;
        articulation.place_bodies()?;
        let scratch = Scratch {
            next_q: q.clone(),
            next_v: v.clone(),
            a: v.clone(),
            force: v.clone(),
            placements: vec![Placement::identity(); tree.bodies().len()],
            q,
            v,
        };
        let mut probe = Probe::new(tree, &world.rotor_inertia)?;
        Ok(RapierBackend {
            link_motions: LinkMotions::new(tree, probe.engine())?,
            probe,
            analytic: AnalyticBackend::new(tree.clone()),
            articulation,
            soles,
            base_wrench: AskedWrench::new(AnalyticBackend::new(tree.clone())),
            foot_wrenches: vec![[0.0; 6]; world.feet.len()],
            stepped: false,
            scratch,
        })
    }

    /// The same robot with another number of iterations in each step: accuracy and time grow in proportion.
    ///
    /// # Errors
    /// The number is zero.
    pub fn with_solver_iterations(mut self, iterations: usize) -> Result<Self, BackendError> {
        if iterations == 0 {
            return Err(error("a step needs at least one solver iteration"));
        }
        self.articulation.world.integration_parameters.num_solver_iterations = iterations;
        Ok(self)
    }

    /// The engine's world with the robot in it, to go on with by hand. The torques of the last step stay.
    pub fn into_physics_world(self) -> PhysicsWorld {
        self.articulation.world
    }

    /// The robot.
    pub fn tree(&self) -> &Tree {
        self.analytic.tree()
    }

    /// The wrench at the base in the step from `(q, v)` to `(next_q, next_v)` of the scratch.
    fn wrench_of_step(&mut self, dt: f64) -> Result<[f64; 6], BackendError> {
        let Scratch { q, v, next_v, a, force, placements, .. } = &mut self.scratch;
        let tree = self.analytic.tree();
        if tree.is_floating() {
            tree.forward_kinematics(q, placements)?;
            let feet = &mut self.foot_wrenches;
            self.soles.wrenches(&self.articulation, tree.bodies(), placements, dt, feet);
            return Ok(std::array::from_fn(|axis| feet.iter().map(|wrench| wrench[axis]).sum()));
        }
        for ((a, next), v) in a.iter_mut().zip(next_v).zip(v.iter()) {
            *a = (*next - v) / dt;
        }
        self.analytic.inverse_dynamics(q, v, a, force)?;
        Ok(self.analytic.base_wrench())
    }
}

impl DynamicsBackend for RapierBackend {
    fn name(&self) -> &str {
        NAME
    }

    fn joint_names(&self) -> &[String] {
        self.analytic.joint_names()
    }

    fn velocity_size(&self) -> usize {
        self.analytic.velocity_size()
    }

    fn configuration_size(&self) -> usize {
        self.analytic.configuration_size()
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        force: &mut [f64],
    ) -> Result<(), BackendError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the velocity v", v.len(), self.velocity_size())?;
        check_size("the acceleration a", a.len(), self.velocity_size())?;
        check_size("the generalised force", force.len(), self.velocity_size())?;
        self.probe.inverse_dynamics(q, v, a, force)?;
        self.base_wrench.ask(q, v, a);
        Ok(())
    }

    fn forward_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the velocity v", v.len(), self.velocity_size())?;
        check_size("the generalised force", force.len(), self.velocity_size())?;
        check_size("the acceleration", acceleration.len(), self.velocity_size())?;
        self.probe.forward_dynamics(q, v, force, acceleration)
    }

    fn base_wrench(&self) -> [f64; 6] {
        self.base_wrench.get()
    }
}

impl SimulationBackend for RapierBackend {
    fn state(&self, q: &mut [f64], v: &mut [f64]) -> Result<(), BackendError> {
        self.analytic.state(q, v)
    }

    fn set_state(&mut self, q: &[f64], v: &[f64]) -> Result<(), BackendError> {
        self.analytic.set_state(q, v)?;
        self.articulation.set_state(q, v)?;
        self.articulation.place_bodies()
    }

    fn step(&mut self, torque: &[f64], dt: f64) -> Result<(), BackendError> {
        self.check_step(torque, dt)?;
        self.analytic.state(&mut self.scratch.q, &mut self.scratch.v)?;
        self.articulation.set_torque(torque)?;
        self.articulation.world.integration_parameters.dt = dt;
        self.articulation.world.step();
        self.articulation.state(&mut self.scratch.next_q, &mut self.scratch.next_v)?;
        let Scratch { q, v, next_q, next_v, .. } = &self.scratch;
        if self.articulation.check_mass().is_err() || self.analytic.set_state(next_q, next_v).is_err() {
            // Back to where the motion was still finite.
            self.articulation.set_state(q, v)?;
            self.articulation.place_bodies()?;
            return Err(BackendError::Singular);
        }
        if self.articulation.has_followers() {
            // The couplings leave a little; it must not add up.
            self.articulation.set_state(next_q, next_v)?;
        }
        let wrench = self.wrench_of_step(dt)?;
        self.base_wrench.set(wrench);
        self.stepped = true;
        Ok(())
    }

    fn foot_wrench(&self, foot: usize) -> Option<[f64; 6]> {
        self.foot_wrenches.get(foot).copied().filter(|_| self.stepped)
    }
}

impl BodyKinematics for RapierBackend {
    type Error = BackendError;

    fn body_count(&self) -> usize {
        self.link_motions.joints().len()
    }

    fn body_joint(&self, body: usize) -> BodyJoint {
        self.link_motions.joints()[body]
    }

    fn gravity(&self) -> [f64; 3] {
        self.tree().gravity
    }

    fn body_motions(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        motions: &mut [BodyMotion<f64>],
    ) -> Result<(), BackendError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the velocity v", v.len(), self.velocity_size())?;
        check_size("the acceleration a", a.len(), self.velocity_size())?;
        check_size("the motions of bodies", motions.len(), self.body_count())?;
        self.link_motions.compute(self.probe.engine(), [q, v, a], motions)
    }
}
