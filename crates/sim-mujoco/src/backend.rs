//! The trait over MuJoCo.

use crate::base::{self, Motion};
use crate::body_kinematics::body_joints;
use crate::error::NAME;
use crate::inertial::PrincipalInertia;
use crate::mjcf::{feet_of_corners, mjcf};
use crate::simulation::{Simulation, Sizes};
use crate::{Integrator, MujocoError};
use phiw_dynamics::body_kinematics::BodyJoint;
use phiw_dynamics::check::check_size;
use phiw_dynamics::{BackendError, DynamicsBackend, SimulationBackend, Tree, World};
use std::cell::RefCell;

/// A coordinate, speed or acceleration beyond this has diverged (MuJoCo's `mjMAXVAL`).
const DIVERGED: f64 = 1e10;

/// A robot in MuJoCo.
///
/// Two models are made of it. The robot by itself, in empty space, answers [`inverse_dynamics`] and
/// [`forward_dynamics`]; the robot in its world, with floor and limits, is moved by [`step`]. In both, **the
/// rotor inertia of the world is part of the mass matrix**: it is the robot's own, and
/// force = (M + rotor)·a + h. Friction and damping that the URDF declares are left out, as in
/// [`phiw_dynamics::AnalyticBackend`].
///
/// The robot is at rest in its neutral configuration in the beginning. Nothing is allocated per call.
///
/// [`inverse_dynamics`]: DynamicsBackend::inverse_dynamics
/// [`forward_dynamics`]: DynamicsBackend::forward_dynamics
/// [`step`]: SimulationBackend::step
pub struct MujocoBackend {
    joint_names: Vec<String>,
    floating: bool,
    /// The joint before each body, and gravity in the world.
    pub(crate) body_joints: Vec<BodyJoint>,
    pub(crate) gravity: [f64; 3],
    /// Bodies that hang on the world.
    roots: Vec<usize>,
    /// A link whose inertia is not that of a real body.
    unreal_link: Option<String>,
    integrator: Integrator,
    /// The present state, in phiw's coordinates.
    q: Vec<f64>,
    v: Vec<f64>,
    /// The robot in its world; its state is the present one.
    world: Simulation,
    /// The robot by itself; what is in it between calls is nobody's business. In a cell, since the wrench is
    /// computed in it when it is asked for.
    pub(crate) alone: RefCell<Simulation>,
    reaction: Reaction,
    /// The foot of each shape, and what each foot got in the last step; none before one.
    feet_of_shapes: Vec<usize>,
    foot_wrenches: Vec<[f64; 6]>,
    stepped: bool,
    /// What `Reaction::Needed` is to be computed from, and the start of the present step.
    motion: Motion,
    start: Motion,
}

/// What the world gives to the robot.
enum Reaction {
    /// What touches the floor.
    Ground([f64; 6]),
    /// What `motion` needs at the base: costs a pass over the bodies, so only when asked for.
    Needed,
}

impl MujocoBackend {
    /// The robot in its world, at rest in its neutral configuration.
    ///
    /// # Errors
    /// MuJoCo is not found, the world does not fit the robot, the robot has mimic joints, a link has a first
    /// moment but no mass, or MuJoCo refuses the model.
    pub fn new(tree: &Tree, world: &World) -> Result<Self, MujocoError> {
        world.check(tree)?;
        if let Some(body) = tree.bodies().iter().find(|body| body.mimic) {
            return Err(MujocoError::Mimic { joint: body.joint.clone() });
        }
        let inertias: Vec<_> = tree.bodies().iter().map(PrincipalInertia::of).collect::<Result<_, _>>()?;
        let sizes = Sizes {
            positions: tree.configuration_size(),
            velocities: tree.velocity_size(),
            bodies: tree.bodies().len(),
        };
        let simulation = |world| Simulation::new(&mjcf(tree, world), sizes, &inertias);
        let empty = World { rotor_inertia: world.rotor_inertia.clone(), ..World::default() };
        let mut alone = simulation(&empty)?;
        let mut backend = MujocoBackend {
            body_joints: body_joints(tree, &mut alone),
            gravity: tree.gravity,
            joint_names: tree.joint_names().map(str::to_owned).collect(),
            floating: tree.is_floating(),
            roots: (0..sizes.bodies).filter(|&body| tree.bodies()[body].parent.is_none()).collect(),
            unreal_link: inertias
                .iter()
                .position(|inertia| !inertia.is_positive())
                .map(|body| tree.bodies()[body].link.clone()),
            integrator: Integrator::default(),
            q: tree.neutral_configuration(),
            v: vec![0.0; sizes.velocities],
            world: simulation(world)?,
            alone: RefCell::new(alone),
            reaction: Reaction::Ground([0.0; 6]),
            feet_of_shapes: feet_of_corners(tree, world),
            foot_wrenches: vec![[0.0; 6]; world.feet.len()],
            stepped: false,
            motion: Motion::zero(sizes.positions, sizes.velocities),
            start: Motion::zero(sizes.positions, sizes.velocities),
        };
        backend.put_state();
        Ok(backend)
    }

    /// The same robot, moved by another integrator.
    pub fn with_integrator(mut self, integrator: Integrator) -> Self {
        self.integrator = integrator;
        self.world.set_integrator(integrator);
        self
    }

    /// How steps go on in time.
    pub fn integrator(&self) -> Integrator {
        self.integrator
    }

    /// `mj_inverse` by itself, on whatever is in the scratch: what a benchmark holds the trait against.
    #[doc(hidden)]
    pub fn call_inverse_alone(&mut self) {
        self.alone.get_mut().inverse();
    }

    /// `mj_step` by itself: what a benchmark holds the trait against. The state is then MuJoCo's alone.
    #[doc(hidden)]
    pub fn call_step_alone(&mut self) {
        self.world.step();
    }

    /// Writes the present state into the world.
    fn put_state(&mut self) {
        let MujocoBackend { floating, q, v, world, .. } = self;
        put(*floating, q, v, world);
        // Contacts must not depend on what was before.
        world.warm_start_mut().fill(0.0);
    }

    /// Writes a motion into the robot by itself.
    pub(crate) fn put_motion(&mut self, q: &[f64], v: &[f64], a: &[f64]) {
        let alone = self.alone.get_mut();
        put(self.floating, q, v, alone);
        alone.acceleration_mut().copy_from_slice(a);
        if self.floating {
            let moving = base::acceleration_to(base::rotation(q), v, a);
            alone.acceleration_mut()[..6].copy_from_slice(&moving);
        }
    }

    pub(crate) fn check_motion(&self, q: &[f64], v: &[f64]) -> Result<(), BackendError> {
        check_size("the configuration q", q.len(), self.q.len())?;
        check_size("the velocity v", v.len(), self.v.len())?;
        Ok(())
    }

    /// Why the mass matrix could not be inverted.
    fn singular(&self) -> BackendError {
        match &self.unreal_link {
            None => BackendError::Singular,
            Some(link) => BackendError::Backend {
                backend: NAME,
                message: format!(
                    "the mass matrix is not positive definite, as the inertial parameters of {link} are those of no \
                     real body (a mass or principal moment is negative): identify with physical consistency"
                ),
            },
        }
    }

    /// Moves the world on from `start`.
    fn advance(&mut self, torque: &[f64], dt: f64) -> Result<(), BackendError> {
        let MujocoBackend { world, start, .. } = self;
        world.set_time_step(dt);
        let applied = world.applied_force_mut();
        let first_joint = applied.len() - torque.len();
        applied[first_joint..].copy_from_slice(torque);
        let solved = world.forward();
        start.acceleration.copy_from_slice(world.acceleration());
        self.foot_wrenches.fill([0.0; 6]);
        world.add_contact_wrenches(&self.feet_of_shapes, &mut self.foot_wrenches);
        let ground = std::array::from_fn(|axis| self.foot_wrenches.iter().map(|wrench| wrench[axis]).sum());
        if !(solved && world.integrate(self.integrator)) {
            return Err(self.singular());
        }
        let tame = |values: &[f64]| values.iter().all(|x| x.abs() < DIVERGED);
        let MujocoBackend { world, start, .. } = self;
        if !(tame(&start.acceleration) && tame(world.position()) && tame(world.velocity())) {
            return Err(BackendError::Singular);
        }
        self.reaction = if self.floating { Reaction::Ground(ground) } else { Reaction::Needed };
        self.stepped = true;
        Ok(())
    }
}

/// Writes a state in phiw's coordinates into a simulation.
fn put(floating: bool, q: &[f64], v: &[f64], simulation: &mut Simulation) {
    let (first_q, first_v) = if floating { (7, 6) } else { (0, 0) };
    simulation.position_mut()[first_q..].copy_from_slice(&q[first_q..]);
    simulation.velocity_mut()[first_v..].copy_from_slice(&v[first_v..]);
    if floating {
        simulation.position_mut()[..7].copy_from_slice(&base::position_to(q));
        simulation.velocity_mut()[..6].copy_from_slice(&base::velocity_to(base::rotation(q), v));
    }
}

impl DynamicsBackend for MujocoBackend {
    fn name(&self) -> &str {
        NAME
    }

    fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    fn velocity_size(&self) -> usize {
        self.v.len()
    }

    fn configuration_size(&self) -> usize {
        self.q.len()
    }

    fn inverse_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        force: &mut [f64],
    ) -> Result<(), BackendError> {
        self.check_motion(q, v)?;
        check_size("the acceleration a", a.len(), self.v.len())?;
        check_size("the generalised force", force.len(), self.v.len())?;
        self.put_motion(q, v, a);
        let alone = self.alone.get_mut();
        alone.inverse();
        force.copy_from_slice(alone.inverse_force());
        if self.floating {
            force[..6].copy_from_slice(&base::velocity_from(base::rotation(q), alone.inverse_force()));
        }
        self.motion.position.copy_from_slice(alone.position());
        self.motion.velocity.copy_from_slice(alone.velocity());
        self.motion.acceleration.copy_from_slice(alone.acceleration());
        self.reaction = Reaction::Needed;
        Ok(())
    }

    fn forward_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError> {
        self.check_motion(q, v)?;
        check_size("the generalised force", force.len(), self.v.len())?;
        check_size("the acceleration", acceleration.len(), self.v.len())?;
        let alone = self.alone.get_mut();
        put(self.floating, q, v, alone);
        alone.applied_force_mut().copy_from_slice(force);
        if self.floating {
            let pushed = base::velocity_to(base::rotation(q), force);
            alone.applied_force_mut()[..6].copy_from_slice(&pushed);
        }
        let solved = alone.forward();
        acceleration.copy_from_slice(alone.acceleration());
        if self.floating {
            let own = base::acceleration_from(base::rotation(q), v, alone.acceleration());
            acceleration[..6].copy_from_slice(&own);
        }
        if solved && acceleration.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(self.singular()) }
    }

    fn base_wrench(&self) -> [f64; 6] {
        match self.reaction {
            Reaction::Ground(wrench) => wrench,
            Reaction::Needed => {
                let mut alone = self.alone.borrow_mut();
                alone.position_mut().copy_from_slice(&self.motion.position);
                alone.velocity_mut().copy_from_slice(&self.motion.velocity);
                alone.acceleration_mut().copy_from_slice(&self.motion.acceleration);
                alone.inverse();
                alone.joint_wrench(self.roots.iter().copied())
            }
        }
    }
}

impl SimulationBackend for MujocoBackend {
    fn state(&self, q: &mut [f64], v: &mut [f64]) -> Result<(), BackendError> {
        self.check_motion(q, v)?;
        q.copy_from_slice(&self.q);
        v.copy_from_slice(&self.v);
        Ok(())
    }

    fn set_state(&mut self, q: &[f64], v: &[f64]) -> Result<(), BackendError> {
        self.check_state(q, v)?;
        self.q.copy_from_slice(q);
        self.v.copy_from_slice(v);
        self.put_state();
        Ok(())
    }

    fn step(&mut self, torque: &[f64], dt: f64) -> Result<(), BackendError> {
        self.check_step(torque, dt)?;
        self.start.position.copy_from_slice(self.world.position());
        self.start.velocity.copy_from_slice(self.world.velocity());
        if let Err(error) = self.advance(torque, dt) {
            self.world.position_mut().copy_from_slice(&self.start.position);
            self.world.velocity_mut().copy_from_slice(&self.start.velocity);
            self.world.warm_start_mut().fill(0.0);
            return Err(error);
        }
        std::mem::swap(&mut self.motion, &mut self.start);
        self.q.copy_from_slice(self.world.position());
        self.v.copy_from_slice(self.world.velocity());
        if self.floating {
            self.q[..7].copy_from_slice(&base::position_from(self.world.position()));
            let own = base::velocity_from(base::rotation(&self.q), self.world.velocity());
            self.v[..6].copy_from_slice(&own);
        }
        Ok(())
    }

    fn foot_wrench(&self, foot: usize) -> Option<[f64; 6]> {
        self.foot_wrenches.get(foot).copied().filter(|_| self.stepped)
    }
}

impl std::fmt::Debug for MujocoBackend {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("MujocoBackend")
            .field("joint_names", &self.joint_names)
            .field("floating", &self.floating)
            .field("integrator", &self.integrator)
            .field("q", &self.q)
            .field("v", &self.v)
            .finish_non_exhaustive()
    }
}
