//! The robot's own equation, read off the engine.
//!
//! A step treats the Coriolis forces semi-implicitly: what it accelerates with is off by a term in dt. In a
//! second world, empty, one step of 1e-15 s leaves nothing of that term, and its generalised acceleration is
//! the forward dynamics. Inverse dynamics is `M·a + h`: M = Σ Jᵀ·diag(m, I)·J over the bodies' Jacobians, and
//! `h = −(M + B)·a₀` from the acceleration `a₀` without forces in a third world, whose coordinates have the
//! inertia B on top.

use crate::articulation::Articulation;
use crate::base_frame::{self, engine_acceleration, engine_force, own_acceleration, own_force};
use phiw_dynamics::{BackendError, Mat3, Spatial, Tree, Vec3};
use rapier3d_f64::math::Vector;
use rapier3d_f64::na::{DMatrix, DVector};
use rapier3d_f64::utils::AngularInertiaOps;

/// Length of the step \[s\]; with zero the engine does not compute.
const INSTANT: f64 = 1e-15;

/// Inertia that the coordinates have on top in the world for inverse dynamics \[kg·m², kg\].
///
/// The forces at rest do not depend on it, and with it the mass matrix is regular even where a joint moves
/// nothing.
const BALLAST: f64 = 1.0;

/// Two worlds that are only asked, never moved on.
pub(crate) struct Probe {
    forward: Articulation,
    inverse: Articulation,
    /// One for each joint.
    rotor_inertia: Vec<f64>,
    /// In the engine's coordinates.
    acceleration: Vec<f64>,
    force: Vec<f64>,
    /// In the robot's: a force, and the mass matrix of a robot with mimic joints.
    bias: Vec<f64>,
    mass: Vec<f64>,
}

impl Probe {
    pub(crate) fn new(tree: &Tree, rotor_inertia: &[f64]) -> Result<Self, BackendError> {
        let still = |rotor_inertia: &[f64]| -> Result<Articulation, BackendError> {
            let mut articulation = Articulation::new(tree, rotor_inertia, false)?;
            articulation.world.integration_parameters.dt = INSTANT;
            articulation.world.integration_parameters.num_solver_iterations = 1;
            Ok(articulation)
        };
        let mut inverse = still(&[])?;
        inverse.add_armature(BALLAST)?;
        let engine_size = inverse.engine_size();
        let size = tree.velocity_size();
        Ok(Probe {
            forward: still(rotor_inertia)?,
            inverse,
            rotor_inertia: rotor_inertia.to_vec(),
            acceleration: vec![0.0; engine_size],
            force: vec![0.0; engine_size],
            bias: vec![0.0; size],
            mass: vec![0.0; if tree.has_mimic() { size * size } else { 0 }],
        })
    }

    /// The robot in empty space, to be asked about any state.
    pub(crate) fn engine(&mut self) -> &mut Articulation {
        &mut self.inverse
    }

    /// The acceleration under a generalised force. Sizes are the caller's duty.
    pub(crate) fn forward_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError> {
        if self.forward.has_followers() {
            self.solve_mass(q, v, force, acceleration)?;
        } else {
            self.accelerate(q, v, force, acceleration)?;
        }
        if acceleration.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(BackendError::Singular) }
    }

    /// The engine's own forward dynamics.
    fn accelerate(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError> {
        let engine = &mut self.forward;
        let base = base_of(engine, q);
        let first_joint = base.map_or(0, |_| 6);
        engine.set_state(q, v)?;
        if let Some((rotation, center)) = base {
            engine.push_base(engine_force(rotation, center, base_frame::spatial(force)))?;
        }
        engine.set_torque(&force[first_joint..])?;
        engine.world.step();
        engine.check_mass()?;
        let found = engine.multibody()?.generalized_acceleration();
        if let Some((rotation, center)) = base {
            let own = own_acceleration(
                rotation,
                center,
                base_frame::spatial(v),
                base_frame::spatial(found.as_slice()),
            );
            base_frame::store(own, acceleration);
        }
        engine.gather(found.as_slice(), &mut acceleration[first_joint..]);
        Ok(())
    }

    /// Forward dynamics of a robot whose followers the engine does not know: `M·a = force − h`, with M from
    /// its Jacobians.
    fn solve_mass(
        &mut self,
        q: &[f64],
        v: &[f64],
        force: &[f64],
        acceleration: &mut [f64],
    ) -> Result<(), BackendError> {
        let size = force.len();
        acceleration.fill(0.0);
        let mut bias = std::mem::take(&mut self.bias);
        self.inverse_dynamics(q, v, acceleration, &mut bias)?;
        let still = Spatial::zero();
        let base = base_of(&self.inverse, q);
        let first_joint = base.map_or(0, |_| 6);
        for column in 0..size {
            acceleration.fill(0.0);
            acceleration[column] = 1.0;
            spread_acceleration(&self.inverse, base, still, acceleration, &mut self.acceleration);
            self.force.fill(0.0);
            add_mass_times(&self.inverse, &self.acceleration, &mut self.force)?;
            let row = &mut self.mass[column * size..(column + 1) * size];
            gather_force(&self.inverse, base, &self.force, row);
            if let Some(inertia) =
                column.checked_sub(first_joint).and_then(|joint| self.rotor_inertia.get(joint))
            {
                row[column] += inertia;
            }
        }
        let right = DVector::from_iterator(size, force.iter().zip(&bias).map(|(force, bias)| force - bias));
        self.bias = bias;
        let mass = DMatrix::from_column_slice(size, size, &self.mass);
        let solution = mass.cholesky().ok_or(BackendError::Singular)?.solve(&right);
        acceleration.copy_from_slice(solution.as_slice());
        Ok(())
    }

    /// The generalised force that a motion needs. Sizes are the caller's duty.
    pub(crate) fn inverse_dynamics(
        &mut self,
        q: &[f64],
        v: &[f64],
        a: &[f64],
        force: &mut [f64],
    ) -> Result<(), BackendError> {
        let Probe { inverse: engine, acceleration, force: needed, rotor_inertia, .. } = self;
        engine.set_state(q, v)?;
        engine.world.step();
        let base = base_of(engine, q);
        let first_joint = base.map_or(0, |_| 6);
        let velocity = if base.is_some() { base_frame::spatial(v) } else { Spatial::zero() };
        spread_acceleration(engine, base, velocity, a, acceleration);
        let free = engine.multibody()?.generalized_acceleration();
        for (index, (difference, needed)) in acceleration.iter_mut().zip(needed.iter_mut()).enumerate() {
            *difference -= free[index];
            *needed = -BALLAST * free[index];
        }
        add_mass_times(engine, acceleration, needed)?;
        gather_force(engine, base, needed, force);
        for (joint, inertia) in rotor_inertia.iter().enumerate() {
            force[first_joint + joint] += inertia * a[first_joint + joint];
        }
        if force.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(BackendError::Singular) }
    }
}

/// Orientation of a floating base, and its centre of mass in its own frame.
type Base = Option<(Mat3<f64>, Vec3<f64>)>;

fn base_of(engine: &Articulation, q: &[f64]) -> Base {
    engine.base_center().map(|center| (base_frame::placement(q).rotation, center))
}

/// The robot's acceleration, with its base moving at `velocity`, in the engine's coordinates.
fn spread_acceleration(
    engine: &Articulation,
    base: Base,
    velocity: Spatial<f64>,
    own: &[f64],
    acceleration: &mut [f64],
) {
    if let Some((rotation, center)) = base {
        let moved = engine_acceleration(rotation, center, velocity, base_frame::spatial(own));
        base_frame::store(moved, acceleration);
    }
    engine.spread(&own[base.map_or(0, |_| 6)..], acceleration);
}

/// The engine's generalised force in the robot's coordinates.
fn gather_force(engine: &Articulation, base: Base, needed: &[f64], own: &mut [f64]) {
    if let Some((rotation, center)) = base {
        base_frame::store(own_force(rotation, center, base_frame::spatial(needed)), own);
    }
    engine.gather(needed, &mut own[base.map_or(0, |_| 6)..]);
}

/// Adds M·acceleration to `force`, both in the engine's coordinates, where the engine stands.
fn add_mass_times(
    engine: &Articulation,
    acceleration: &[f64],
    force: &mut [f64],
) -> Result<(), BackendError> {
    let multibody = engine.multibody()?;
    for (link, body) in engine.rigid_bodies() {
        let jacobian = multibody.body_jacobian(link);
        let mut moved = [0.0; 6];
        for (column, acceleration) in jacobian.column_iter().zip(acceleration) {
            for row in 0..6 {
                moved[row] += column[row] * acceleration;
            }
        }
        let properties = body.mass_properties();
        let push = properties.effective_mass() * Vector::new(moved[0], moved[1], moved[2]);
        let turn = properties
            .effective_angular_inertia()
            .transform_vector(Vector::new(moved[3], moved[4], moved[5]));
        let wrench = [push.x, push.y, push.z, turn.x, turn.y, turn.z];
        for (column, force) in jacobian.column_iter().zip(force.iter_mut()) {
            for row in 0..6 {
                *force += column[row] * wrench[row];
            }
        }
    }
    Ok(())
}
