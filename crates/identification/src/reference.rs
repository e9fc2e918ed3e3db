//! A rigid-body model with numbers, for effects whose columns need torques (load-dependent friction, delays, offsets, …).

use crate::{BlockReference, Effect, Needs, Sample};
use phiw_dynamics::{DimensionError, Dual, Tree, Workspace};
use phiw_telemetry::Block;

/// The robot with the parameters that a fit has found so far.
pub struct ReferenceModel {
    tree: Tree,
    effects: Vec<(Box<dyn Effect>, Vec<f64>)>,
}

impl ReferenceModel {
    /// A reference with the tree's own inertial parameters.
    pub fn new(tree: Tree) -> Self {
        ReferenceModel { tree, effects: Vec::new() }
    }

    /// The same with effects and their parameters. Those that need a reference themselves are left out.
    pub fn with_effects(mut self, effects: Vec<(Box<dyn Effect>, Vec<f64>)>) -> Self {
        self.effects = effects.into_iter().filter(|(effect, _)| effect.needs().is_empty()).collect();
        self
    }

    /// The robot.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Fills in what is needed over a block (fixed base; with a floating base there is nothing to fill in).
    pub(crate) fn evaluate(
        &self,
        block: &Block,
        needs: Needs,
        out: &mut BlockReference,
    ) -> Result<(), DimensionError> {
        let joints = block.joints;
        if needs.is_empty() || self.tree.is_floating() {
            return Ok(());
        }
        let mut workspace = Workspace::new(&self.tree);
        if needs.torque || needs.derivatives {
            out.torque.resize(block.t.len() * joints, 0.0);
            for sample in 0..block.t.len() {
                let row = block.row(sample);
                let (q, v, a) = (&block.q[row.clone()], &block.qd[row.clone()], &block.qdd[row.clone()]);
                self.tree.inverse_dynamics(q, v, a, &mut workspace, &mut out.torque[row])?;
            }
            rates(&block.t, joints, &out.torque, &mut out.torque_rate, &mut out.torque_second_rate);
            out.total_torque.clone_from(&out.torque);
            self.add_effects(block, &mut out.total_torque);
            rates(&block.t, joints, &out.total_torque, &mut out.total_torque_rate, &mut Vec::new());
        }
        if needs.derivatives {
            self.derivatives(block, out)?;
        }
        if needs.gravity {
            self.gravity(block, out)?;
        }
        Ok(())
    }

    fn add_effects(&self, block: &Block, total: &mut [f64]) {
        let nothing = BlockReference::default();
        for (effect, parameters) in &self.effects {
            let entries = effect.entries();
            let mut columns = vec![0.0; entries.len()];
            let mut evaluator = effect.evaluator();
            for index in 0..block.t.len() {
                let sample = Sample { block, reference: &nothing, index, regressor: &[], statics: &[] };
                evaluator.evaluate(&sample, &mut columns);
                for (entry, column) in entries.iter().zip(&columns) {
                    total[index * block.joints + entry.row] += parameters[entry.parameter] * column;
                }
            }
        }
    }

    /// The derivatives are as smooth as the motion: computed fifty times a second, and linear in between.
    fn derivatives(&self, block: &Block, out: &mut BlockReference) -> Result<(), DimensionError> {
        let joints = block.joints;
        let size = joints * joints;
        let samples = block.t.len();
        for values in [&mut out.by_position, &mut out.by_velocity, &mut out.by_acceleration] {
            values.resize(samples * size, 0.0);
        }
        if samples == 0 {
            return Ok(());
        }
        let period =
            if samples > 1 { (block.t[samples - 1] - block.t[0]) / (samples - 1) as f64 } else { 1.0 };
        let stride = ((DERIVATIVE_PERIOD / period) as usize).max(1);
        let mut workspace = Workspace::new(&self.tree);
        let mut state = DualState::new(joints);
        let mut before = None;
        let mut sample = 0;
        loop {
            state.set(block, sample);
            let at = sample * size..(sample + 1) * size;
            state.derivatives(
                &self.tree,
                &mut workspace,
                Along::Position,
                &mut out.by_position[at.clone()],
            )?;
            state.derivatives(
                &self.tree,
                &mut workspace,
                Along::Velocity,
                &mut out.by_velocity[at.clone()],
            )?;
            state.derivatives(
                &self.tree,
                &mut workspace,
                Along::Acceleration,
                &mut out.by_acceleration[at],
            )?;
            if let Some(first) = before {
                for values in [&mut out.by_position, &mut out.by_velocity, &mut out.by_acceleration] {
                    interpolate(values, size, first, sample);
                }
            }
            if sample == samples - 1 {
                return Ok(());
            }
            before = Some(sample);
            sample = (sample + stride).min(samples - 1);
        }
    }

    fn gravity(&self, block: &Block, out: &mut BlockReference) -> Result<(), DimensionError> {
        let joints = block.joints;
        out.gravity.resize(block.t.len() * 3 * joints, 0.0);
        let rest = vec![0.0; joints];
        let mut workspace = Workspace::new(&self.tree);
        for direction in 0..3 {
            let mut tree = self.tree.clone();
            tree.gravity = [0.0; 3];
            tree.gravity[direction] = 1.0;
            for sample in 0..block.t.len() {
                let start = (3 * sample + direction) * joints;
                let torque = &mut out.gravity[start..start + joints];
                tree.inverse_dynamics(&block.q[block.row(sample)], &rest, &rest, &mut workspace, torque)?;
            }
        }
        Ok(())
    }
}

/// Time between two evaluations of the derivatives \[s\].
const DERIVATIVE_PERIOD: f64 = 0.02;

/// What a torque is differentiated by.
#[derive(Clone, Copy)]
enum Along {
    Position,
    Velocity,
    Acceleration,
}

/// A state that carries a derivative.
struct DualState {
    q: Vec<Dual>,
    v: Vec<Dual>,
    a: Vec<Dual>,
    torque: Vec<Dual>,
}

impl DualState {
    fn new(joints: usize) -> Self {
        let zero = vec![Dual { value: 0.0, derivative: 0.0 }; joints];
        DualState { q: zero.clone(), v: zero.clone(), a: zero.clone(), torque: zero }
    }

    fn set(&mut self, block: &Block, sample: usize) {
        let row = block.row(sample);
        for (dual, values) in [(&mut self.q, &block.q), (&mut self.v, &block.qd), (&mut self.a, &block.qdd)] {
            for (dual, value) in dual.iter_mut().zip(&values[row.clone()]) {
                *dual = Dual { value: *value, derivative: 0.0 };
            }
        }
    }

    /// ∂τ/∂(q, q̇ or q̈), row-major, a row for each torque.
    fn derivatives(
        &mut self,
        tree: &Tree,
        workspace: &mut Workspace<Dual>,
        along: Along,
        out: &mut [f64],
    ) -> Result<(), DimensionError> {
        let joints = self.q.len();
        for joint in 0..joints {
            self.variable(along, joint).derivative = 1.0;
            tree.inverse_dynamics(&self.q, &self.v, &self.a, workspace, &mut self.torque)?;
            self.variable(along, joint).derivative = 0.0;
            for (row, torque) in self.torque.iter().enumerate() {
                out[row * joints + joint] = torque.derivative;
            }
        }
        Ok(())
    }

    fn variable(&mut self, along: Along, joint: usize) -> &mut Dual {
        match along {
            Along::Position => &mut self.q[joint],
            Along::Velocity => &mut self.v[joint],
            Along::Acceleration => &mut self.a[joint],
        }
    }
}

/// Fills in the rows between two that are known.
fn interpolate(values: &mut [f64], width: usize, first: usize, last: usize) {
    for sample in first + 1..last {
        let share = (sample - first) as f64 / (last - first) as f64;
        for column in 0..width {
            let (a, b) = (values[first * width + column], values[last * width + column]);
            values[sample * width + column] = a + share * (b - a);
        }
    }
}

/// First and second differences in time, central inside and one-sided at the ends, of rows of `width` numbers.
fn rates(t: &[f64], width: usize, values: &[f64], first: &mut Vec<f64>, second: &mut Vec<f64>) {
    first.resize(values.len(), 0.0);
    second.resize(values.len(), 0.0);
    let samples = t.len();
    for sample in 0..samples {
        let (before, after) = (sample.saturating_sub(1), (sample + 1).min(samples - 1));
        let step = t[after] - t[before];
        for column in 0..width {
            let [low, here, high] = [before, sample, after].map(|row| values[row * width + column]);
            let at = sample * width + column;
            first[at] = if step > 0.0 { (high - low) / step } else { 0.0 };
            let half = 0.5 * step;
            second[at] = if after - before == 2 { (high - 2.0 * here + low) / (half * half) } else { 0.0 };
        }
    }
}
