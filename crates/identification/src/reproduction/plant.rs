//! A model as something that moves: torque in, acceleration out.

use crate::Design;
use crate::design::DesignScratch;
use crate::sample::{BlockReference, Needs};
use phiw_dynamics::check::check_size;
use phiw_dynamics::{BackendError, DimensionError, DynamicsBackend};
use phiw_telemetry::Block;

/// Why a model cannot move.
#[derive(Debug, thiserror::Error)]
pub enum PlantError {
    /// No acceleration follows from a torque.
    #[error("M(q) is not positive definite")]
    NotPositiveDefinite,
    /// The backend fails.
    #[error(transparent)]
    Backend(#[from] BackendError),
    /// Numbers that do not fit each other.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
}

/// Friction of one joint as a URDF declares it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct DeclaredFriction {
    pub damping: f64,
    pub friction: f64,
    /// Speed over which the friction turns \[rad/s, m/s\].
    pub width: f64,
}

/// The rigid body of a backend, with the effects of a design or the friction of a URDF.
pub struct Plant<'a> {
    backend: Box<dyn DynamicsBackend + 'a>,
    effects: Option<Effects<'a>>,
    friction: Vec<DeclaredFriction>,
    scratch: Scratch,
}

/// Effects at one sample after the other. What is affine in the motion goes into the mass matrix; the rest is
/// evaluated once a step, since it may remember.
struct Effects<'a> {
    design: &'a Design,
    linear: DesignScratch<'a>,
    other: DesignScratch<'a>,
    /// All parameters of the design, zero where they belong to the other half, or to the rigid body.
    linear_parameters: Vec<f64>,
    other_parameters: Vec<f64>,
    /// Whether anything is affine in the motion.
    has_linear: bool,
    /// The sample before and the present one.
    block: Block,
    evaluation: Vec<f64>,
}

struct Scratch {
    joints: usize,
    still: Vec<f64>,
    unit: Vec<f64>,
    bias: Vec<f64>,
    column: Vec<f64>,
    of_effects: Vec<f64>,
    /// Row-major; its lower half becomes Cholesky's factor.
    mass: Vec<f64>,
    rigid: Vec<f64>,
}

impl<'a> Plant<'a> {
    /// The rigid body by itself.
    pub fn new(backend: Box<dyn DynamicsBackend + 'a>) -> Self {
        let joints = backend.velocity_size();
        let zeros = || vec![0.0; joints];
        let scratch = Scratch {
            joints,
            still: zeros(),
            unit: zeros(),
            bias: zeros(),
            column: zeros(),
            of_effects: zeros(),
            mass: vec![0.0; joints * joints],
            rigid: zeros(),
        };
        Plant { backend, effects: None, friction: Vec::new(), scratch }
    }

    /// The same with the effects of a design, given all of its parameters. Those that cannot be simulated are
    /// left out; [`Plant::left_out`] names them. Columns of the rigid body are not used: a design without
    /// them ([`Design::part`]) is quicker.
    ///
    /// # Errors
    /// `parameters` are not the design's.
    pub fn with_effects(self, design: &'a Design, parameters: &[f64]) -> Result<Self, DimensionError> {
        check_size("parameters", parameters.len(), design.parameter_count())?;
        let (mut linear, mut other) = (vec![0.0; parameters.len()], vec![0.0; parameters.len()]);
        for (index, effect) in design.effects().iter().enumerate() {
            if !can_be_simulated(design, index) {
                continue;
            }
            for (place, parameter) in design.effect_parameters(index).enumerate() {
                let half = if effect.is_linear_in_motion(place) { &mut linear } else { &mut other };
                half[parameter] = parameters[parameter];
            }
        }
        let joints = self.scratch.joints;
        let mut scratch_of_other = design.scratch();
        // What needs the torques' derivatives is not simulated, but its columns are asked for all the same.
        let (zeros, matrices) = (vec![0.0; 2 * joints], vec![0.0; 2 * joints * joints]);
        *scratch_of_other.reference_mut() = BlockReference {
            by_position: matrices.clone(),
            by_velocity: matrices.clone(),
            by_acceleration: matrices,
            gravity: vec![0.0; 2 * 3 * joints],
            total_torque: zeros.clone(),
            torque: zeros.clone(),
            torque_rate: zeros.clone(),
            torque_second_rate: zeros.clone(),
            total_torque_rate: zeros,
        };
        let pair = || vec![0.0; 2 * joints];
        let block = Block::unfiltered(joints, vec![0.0; 2], [pair(), pair(), pair()], pair());
        let effects = Effects {
            design,
            linear: design.scratch(),
            other: scratch_of_other,
            has_linear: linear.iter().any(|parameter| *parameter != 0.0),
            linear_parameters: linear,
            other_parameters: other,
            block,
            evaluation: vec![0.0; design.evaluation_width()],
        };
        Ok(Plant { effects: (!design.effects().is_empty()).then_some(effects), ..self })
    }

    /// The same with the friction that the URDF declares, which turns within `widths` \[rad/s, m/s\].
    pub fn with_declared_friction(self, tree: &phiw_dynamics::Tree, widths: &[f64]) -> Self {
        let of_joint = |joint: usize| DeclaredFriction {
            damping: tree.joint(joint).damping,
            friction: tree.joint(joint).friction,
            width: widths.get(joint).copied().unwrap_or_default(),
        };
        Plant { friction: (0..tree.joint_count()).map(of_joint).collect(), ..self }
    }

    /// Kinds of effects that have no place in a simulation: they correct what sensors say, depend on what
    /// comes later, or need what a simulation has not.
    pub fn left_out(design: &Design) -> Vec<String> {
        let left_out = (0..design.effects().len()).filter(|&index| !can_be_simulated(design, index));
        let mut kinds: Vec<String> = Vec::new();
        for kind in left_out.map(|index| design.effects()[index].spec().kind) {
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        kinds
    }

    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.scratch.joints
    }

    /// The acceleration under a torque, at `t` \[s\] and in a motion whose last acceleration was `before`.
    /// The effects that remember take this for the next moment.
    ///
    /// # Errors
    /// [`PlantError::NotPositiveDefinite`], or the backend fails.
    pub fn accelerate(
        &mut self,
        t: f64,
        [q, v, torque, before]: [&[f64]; 4],
        acceleration: &mut [f64],
    ) -> Result<(), PlantError> {
        self.assemble(q, v)?;
        let Plant { backend, effects, friction, scratch } = self;
        for (joint, bias) in scratch.bias.iter_mut().enumerate() {
            if let Some(own) = friction.get(joint) {
                let sign = (v[joint] / own.width.max(f64::MIN_POSITIVE)).tanh();
                *bias += own.damping * v[joint] + own.friction * sign;
            }
        }
        if let Some(effects) = effects {
            backend.inverse_dynamics(q, v, before, &mut scratch.rigid)?;
            effects.add_other(t, [q, v, before], &scratch.rigid, &mut scratch.bias)?;
        }
        for (joint, acceleration) in acceleration.iter_mut().enumerate() {
            let factor = effects.as_ref().map_or(1.0, |effects| effects.design.logged_factors()[joint]);
            *acceleration = torque[joint] / factor - scratch.bias[joint];
        }
        scratch.factorise()?;
        scratch.solve(acceleration);
        Ok(())
    }

    /// Whether M(q) is positive definite, with all that adds to it; and its diagonal \[kg·m², kg\].
    ///
    /// # Errors
    /// The backend fails.
    pub fn inertia(&mut self, q: &[f64], diagonal: &mut [f64]) -> Result<bool, PlantError> {
        let still = self.scratch.still.clone();
        self.assemble(q, &still)?;
        let joints = self.scratch.joints;
        diagonal
            .iter_mut()
            .enumerate()
            .for_each(|(joint, own)| *own = self.scratch.mass[joint * joints + joint]);
        Ok(self.scratch.factorise().is_ok())
    }

    /// The mass matrix, and the torque without acceleration.
    fn assemble(&mut self, q: &[f64], v: &[f64]) -> Result<(), PlantError> {
        let Plant { backend, effects, scratch, .. } = self;
        let joints = scratch.joints;
        backend.inverse_dynamics(q, v, &scratch.still, &mut scratch.bias)?;
        backend.mass_matrix(q, &mut scratch.mass)?;
        let Some(effects) = effects.as_mut().filter(|effects| effects.has_linear) else { return Ok(()) };
        scratch.of_effects.fill(0.0);
        effects.add_linear([q, v, &scratch.still], &mut scratch.of_effects)?;
        for joint in 0..joints {
            scratch.unit[joint] = 1.0;
            scratch.column.fill(0.0);
            effects.add_linear([q, v, &scratch.unit], &mut scratch.column)?;
            scratch.unit[joint] = 0.0;
            for row in 0..joints {
                scratch.mass[row * joints + joint] += scratch.column[row] - scratch.of_effects[row];
            }
        }
        scratch.bias.iter_mut().zip(&scratch.of_effects).for_each(|(bias, own)| *bias += own);
        Ok(())
    }
}

/// Whether an effect follows from the motion up to the present moment alone.
fn can_be_simulated(design: &Design, index: usize) -> bool {
    let effect = &design.effects()[index];
    let simulated = Needs { torque: true, total_torque: true, statics: true, ..Needs::default() };
    let needs = effect.needs().union(simulated) == simulated;
    needs && effect.is_causal() && effect.compliance().is_none() && !design.corrects_signals(index)
}

impl Effects<'_> {
    fn set(&mut self, t: f64, [q, v, a]: [&[f64]; 3]) {
        let joints = q.len();
        let last = self.block.t[1].min(t);
        self.block.t.copy_from_slice(&[last, t]);
        for (signal, values) in [(&mut self.block.q, q), (&mut self.block.qd, v), (&mut self.block.qdd, a)] {
            signal[joints..].copy_from_slice(values);
        }
    }

    fn add_linear(&mut self, state: [&[f64]; 3], torque: &mut [f64]) -> Result<(), DimensionError> {
        let t = self.block.t[1];
        self.set(t, state);
        self.linear.evaluate(&self.block, 1, &mut self.evaluation)?;
        self.add(&self.linear_parameters, torque);
        Ok(())
    }

    fn add_other(
        &mut self,
        t: f64,
        state: [&[f64]; 3],
        rigid: &[f64],
        torque: &mut [f64],
    ) -> Result<(), DimensionError> {
        self.set(t, state);
        let reference = self.other.reference_mut();
        for torques in [&mut reference.torque, &mut reference.total_torque] {
            torques.chunks_exact_mut(rigid.len()).for_each(|sample| sample.copy_from_slice(rigid));
        }
        self.other.evaluate(&self.block, 1, &mut self.evaluation)?;
        self.add(&self.other_parameters, torque);
        Ok(())
    }

    fn add(&self, parameters: &[f64], torque: &mut [f64]) {
        // What the log says of a torque is not what moves the robot.
        let rows = self.design.rows().iter().zip(self.design.logged_factors());
        for (torque, (layout, factor)) in torque.iter_mut().zip(rows) {
            *torque += layout.torque(&self.evaluation, parameters) / factor;
        }
    }
}

/// Share of a diagonal element below which what Cholesky's decomposition leaves of it is rounding.
const SINGULAR: f64 = 1e-10;

impl Scratch {
    /// Cholesky's factor into the lower half of the mass matrix.
    fn factorise(&mut self) -> Result<(), PlantError> {
        let n = self.joints;
        for column in 0..n {
            let own = self.mass[column * n + column];
            let squares: f64 = (0..column).map(|k| self.mass[column * n + k].powi(2)).sum();
            let left = own - squares;
            if !(own > 0.0 && left > SINGULAR * own) {
                return Err(PlantError::NotPositiveDefinite);
            }
            let root = left.sqrt();
            self.mass[column * n + column] = root;
            for row in column + 1..n {
                let told: f64 = (0..column).map(|k| self.mass[row * n + k] * self.mass[column * n + k]).sum();
                self.mass[row * n + column] = (self.mass[row * n + column] - told) / root;
            }
        }
        Ok(())
    }

    /// `x` ← M⁻¹·x.
    fn solve(&self, x: &mut [f64]) {
        let n = self.joints;
        for row in 0..n {
            let told: f64 = (0..row).map(|k| self.mass[row * n + k] * x[k]).sum();
            x[row] = (x[row] - told) / self.mass[row * n + row];
        }
        for row in (0..n).rev() {
            let told: f64 = (row + 1..n).map(|k| self.mass[k * n + row] * x[k]).sum();
            x[row] = (x[row] - told) / self.mass[row * n + row];
        }
    }
}
