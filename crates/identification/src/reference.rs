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
    pub(crate) fn evaluate(&self, block: &Block, needs: Needs, out: &mut BlockReference) -> Result<(), DimensionError> {
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

    fn derivatives(&self, block: &Block, out: &mut BlockReference) -> Result<(), DimensionError> {
        let joints = block.joints;
        let size = block.t.len() * joints * joints;
        for values in [&mut out.by_position, &mut out.by_velocity, &mut out.by_acceleration] {
            values.resize(size, 0.0);
        }
        let mut workspace = Workspace::new(&self.tree);
        let constant = |value: &f64| Dual { value: *value, derivative: 0.0 };
        let mut torque = vec![constant(&0.0); joints];
        let (mut q, mut v, mut a) = (torque.clone(), torque.clone(), torque.clone());
        for sample in 0..block.t.len() {
            let row = block.row(sample);
            for joint in 0..joints {
                q[joint] = constant(&block.q[row.start + joint]);
                v[joint] = constant(&block.qd[row.start + joint]);
                a[joint] = constant(&block.qdd[row.start + joint]);
            }
            let start = sample * joints * joints;
            for along in 0..joints {
                for (which, target) in
                    [&mut out.by_position, &mut out.by_velocity, &mut out.by_acceleration].into_iter().enumerate()
                {
                    let variable = match which {
                        0 => &mut q[along],
                        1 => &mut v[along],
                        _ => &mut a[along],
                    };
                    variable.derivative = 1.0;
                    self.tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut torque)?;
                    for (joint, value) in torque.iter().enumerate() {
                        target[start + joint * joints + along] = value.derivative;
                    }
                    match which {
                        0 => q[along].derivative = 0.0,
                        1 => v[along].derivative = 0.0,
                        _ => a[along].derivative = 0.0,
                    }
                }
            }
        }
        Ok(())
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
