//! How the force of inverse dynamics changes with the motion.

use crate::check::check_size;
use crate::inertia::Inertia;
use crate::scalar::Scalar;
use crate::{DimensionError, Placement, Spatial, Tree, Vec3};

/// Derivatives of the generalised force of [`Tree::inverse_dynamics`], each `velocity_size` ×
/// `velocity_size`, row by row: a row for each force, a column for each coordinate.
#[derive(Clone, Debug)]
pub struct ForceDerivatives<T> {
    /// ∂τ/∂q \[N·m/rad; with N and m of joints that slide\].
    pub by_position: Vec<T>,
    /// ∂τ/∂q̇ \[N·m·s/rad; with N and m of joints that slide\].
    pub by_velocity: Vec<T>,
    /// ∂τ/∂q̈, the mass matrix \[kg·m²; kg of joints that slide\].
    pub by_acceleration: Vec<T>,
}

/// Scratch memory for [`Tree::inverse_dynamics_derivatives`]: make it once per thread, reuse it for every
/// sample.
#[derive(Clone, Debug)]
pub struct DerivativesWorkspace<T> {
    bodies: Vec<BodyInWorld<T>>,
}

/// A body and its joint, all in the world's frame.
#[derive(Clone, Copy, Debug)]
struct BodyInWorld<T> {
    placement: Placement<T>,
    axis: Spatial<T>,
    velocity: Spatial<T>,
    /// Less gravity.
    acceleration: Spatial<T>,
    /// How the axis changes as the parent moves: v × S, the parent's velocity.
    axis_rate: Spatial<T>,
    /// a × S + v × (v × S), the parent's acceleration and velocity.
    axis_second_rate: Spatial<T>,
    /// Of the body and all that it carries: inertia I, force, and the columns of 2B, which say how the force
    /// changes with the velocity.
    inertia: Inertia<T>,
    force: Spatial<T>,
    by_velocity: [Spatial<T>; 6],
}

impl<T: Scalar> ForceDerivatives<T> {
    /// Zeros for `tree`.
    pub fn new(tree: &Tree) -> Self {
        let zeros = vec![T::zero(); tree.velocity_size * tree.velocity_size];
        ForceDerivatives { by_position: zeros.clone(), by_velocity: zeros.clone(), by_acceleration: zeros }
    }
}

impl<T: Scalar> DerivativesWorkspace<T> {
    /// Scratch for `tree`.
    pub fn new(tree: &Tree) -> Self {
        let zero = Spatial::zero();
        let body = BodyInWorld {
            placement: Placement::identity(),
            axis: zero,
            velocity: zero,
            acceleration: zero,
            axis_rate: zero,
            axis_second_rate: zero,
            inertia: Inertia::zero(),
            force: zero,
            by_velocity: [zero; 6],
        };
        DerivativesWorkspace { bodies: vec![body; tree.bodies.len()] }
    }
}

impl Tree {
    /// Derivatives of [`Tree::inverse_dynamics`] by position, velocity and acceleration, for a robot on a
    /// fixed base; arguments as there.
    ///
    /// Analytic, of O(joints · depth): Carpentier & Mansard 2018; in the form of Singh, Russo & Wensing 2022,
    /// all in the world's frame. A row and a column of a mimic's leader include its followers.
    ///
    /// # Errors
    /// The base floats, or a slice, the workspace or the result does not fit this robot.
    #[inline(always)]
    pub fn inverse_dynamics_derivatives<T: Scalar>(
        &self,
        q: &[T],
        v: &[T],
        a: &[T],
        workspace: &mut DerivativesWorkspace<T>,
        derivatives: &mut ForceDerivatives<T>,
    ) -> Result<(), DimensionError> {
        if self.is_floating() {
            return Err(DimensionError::FloatingBase { what: "derivatives of inverse dynamics" });
        }
        let size = self.velocity_size;
        let ForceDerivatives { by_position, by_velocity, by_acceleration } = derivatives;
        self.check_state(q, v)?;
        check_size("the acceleration a", a.len(), size)?;
        check_size("the workspace", workspace.bodies.len(), self.bodies.len())?;
        for matrix in [&*by_position, &*by_velocity, &*by_acceleration] {
            check_size("derivatives of the force", matrix.len(), size * size)?;
        }
        let bodies = workspace.bodies.as_mut_slice();
        self.outward(q, v, a, bodies);
        for matrix in [&mut *by_position, &mut *by_velocity, &mut *by_acceleration] {
            matrix.fill(T::zero());
        }
        for index in (0..bodies.len()).rev() {
            let own = bodies[index];
            let row = self.bodies[index].velocity_index;
            let two = T::constant(2.0);
            // The force on all that the joint carries, as the joint accelerates (I S), goes faster
            // (2B S + 2I v×S), and moves (2B v×S + I a×S + I v×v×S); the last for joints before it, whose
            // axes stay where they are while this force turns.
            let by_own_acceleration = own.inertia.times(own.axis);
            let by_own_velocity =
                times(&own.by_velocity, own.axis) + own.inertia.times(own.axis_rate).scale(two);
            let by_own_position =
                times(&own.by_velocity, own.axis_rate) + own.inertia.times(own.axis_second_rate);
            let with_turn = by_own_position + own.axis.cross_force(own.force);
            // This joint's force, by the velocity of all that it carries (2Bᵀ S).
            let own_by_velocity = transposed_times(&own.by_velocity, own.axis);
            by_position[row * size + row] += own.axis.dot(by_own_position);
            by_velocity[row * size + row] += own.axis.dot(by_own_velocity);
            by_acceleration[row * size + row] += own.axis.dot(by_own_acceleration);
            let mut ancestor = self.bodies[index].parent;
            while let Some(outer) = ancestor {
                let other = &bodies[outer];
                let column = self.bodies[outer].velocity_index;
                by_position[row * size + column] +=
                    own_by_velocity.dot(other.axis_rate) + by_own_acceleration.dot(other.axis_second_rate);
                by_velocity[row * size + column] +=
                    own_by_velocity.dot(other.axis) + by_own_acceleration.dot(other.axis_rate) * two;
                by_position[column * size + row] += other.axis.dot(with_turn);
                by_velocity[column * size + row] += other.axis.dot(by_own_velocity);
                let coupling = other.axis.dot(by_own_acceleration);
                by_acceleration[row * size + column] += coupling;
                by_acceleration[column * size + row] += coupling;
                ancestor = self.bodies[outer].parent;
            }
            if let Some(parent) = self.bodies[index].parent {
                let parent = &mut bodies[parent];
                parent.inertia = parent.inertia + own.inertia;
                parent.force = parent.force + own.force;
                for (sum, column) in parent.by_velocity.iter_mut().zip(own.by_velocity) {
                    *sum = *sum + column;
                }
            }
        }
        Ok(())
    }

    /// Motions and forces of the single bodies.
    #[inline(always)]
    fn outward<T: Scalar>(&self, q: &[T], v: &[T], a: &[T], bodies: &mut [BodyInWorld<T>]) {
        let [x, y, z] = self.gravity;
        let gravity = Spatial { linear: Vec3::constant([-x, -y, -z]), angular: Vec3::zero() };
        for (index, body) in self.bodies.iter().enumerate() {
            let (outer, velocity, acceleration) = match body.parent {
                Some(parent) => {
                    (bodies[parent].placement, bodies[parent].velocity, bodies[parent].acceleration)
                }
                None => (Placement::identity(), Spatial::zero(), gravity),
            };
            let placement = outer.compose(body.placement(self.joint_position(body, q)));
            let axis = placement.motion(body.motion_axis());
            let axis_rate = velocity.cross_motion(axis);
            let axis_second_rate = acceleration.cross_motion(axis) + velocity.cross_motion(axis_rate);
            let speed = v[body.velocity_index];
            let velocity = velocity + axis.scale(speed);
            let acceleration = acceleration + axis.scale(a[body.velocity_index]) + axis_rate.scale(speed);
            let inertia = Inertia::from_parameters(&body.inertial).moved(placement);
            let momentum = inertia.times(velocity);
            bodies[index] = BodyInWorld {
                placement,
                axis,
                velocity,
                acceleration,
                axis_rate,
                axis_second_rate,
                inertia,
                force: inertia.times(acceleration) + velocity.cross_force(momentum),
                by_velocity: by_velocity(inertia, velocity, momentum),
            };
        }
    }
}

/// The columns of 2B: u ↦ v ×* (I u) − I (v × u) + u ×* (I v).
#[inline(always)]
fn by_velocity<T: Scalar>(
    inertia: Inertia<T>,
    velocity: Spatial<T>,
    momentum: Spatial<T>,
) -> [Spatial<T>; 6] {
    let mut columns = [Spatial::zero(); 6];
    for (place, column) in columns.iter_mut().enumerate() {
        let mut unit = [T::zero(); 6];
        unit[place] = T::one();
        let [x, y, z, rx, ry, rz] = unit;
        let unit = Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) };
        let carried = inertia.times(velocity.cross_motion(unit));
        let carried = Spatial { linear: -carried.linear, angular: -carried.angular };
        *column = velocity.cross_force(inertia.times(unit)) + carried + unit.cross_force(momentum);
    }
    columns
}

/// A matrix by its columns, times a motion.
#[inline(always)]
fn times<T: Scalar>(columns: &[Spatial<T>; 6], motion: Spatial<T>) -> Spatial<T> {
    let ([x, y, z], [rx, ry, rz]) = (motion.linear.0, motion.angular.0);
    let mut sum = Spatial::zero();
    for (column, factor) in columns.iter().zip([x, y, z, rx, ry, rz]) {
        sum = sum + column.scale(factor);
    }
    sum
}

/// The transpose of a matrix that is given by its columns, times a motion.
#[inline(always)]
fn transposed_times<T: Scalar>(columns: &[Spatial<T>; 6], motion: Spatial<T>) -> Spatial<T> {
    let mut products = [T::zero(); 6];
    for (product, column) in products.iter_mut().zip(columns) {
        *product = column.dot(motion);
    }
    let [x, y, z, rx, ry, rz] = products;
    Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) }
}
