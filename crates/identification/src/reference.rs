//! A rigid-body model with numbers, for effects whose columns need torques (load-dependent friction, delays,
//! offsets, …).

use crate::Effect;
use crate::rates::{LocalRates, WindowsByWidth, interpolate};
use crate::sample::{BlockReference, Needs, Sample};
use phiw_dynamics::scalar::Lanes;
use phiw_dynamics::{DerivativesWorkspace, DimensionError, ForceDerivatives, Tree, Workspace};
use phiw_telemetry::Block;
use std::sync::Arc;

/// The robot with the parameters that a fit has found so far.
pub struct ReferenceModel {
    tree: Tree,
    effects: Vec<(Arc<dyn Effect>, Vec<f64>)>,
    windows: WindowsByWidth,
}

impl ReferenceModel {
    /// A reference with the tree's own inertial parameters.
    pub fn new(tree: Tree) -> Self {
        ReferenceModel { tree, effects: Vec::new(), windows: WindowsByWidth::default() }
    }

    /// The same with effects and their parameters. Those that need a reference themselves are left out.
    pub fn with_effects(self, effects: Vec<(Box<dyn Effect>, Vec<f64>)>) -> Self {
        self.with_shared_effects(
            effects.into_iter().map(|(effect, parameters)| (Arc::from(effect), parameters)).collect(),
        )
    }

    pub(crate) fn with_shared_effects(mut self, effects: Vec<(Arc<dyn Effect>, Vec<f64>)>) -> Self {
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
        if needs.torque || needs.total_torque || needs.rates {
            self.torque(block, &mut out.torque)?;
        }
        if needs.total_torque || needs.rates {
            out.total_torque.clone_from(&out.torque);
            self.add_effects(block, &mut out.total_torque);
        }
        if needs.rates {
            self.rates(block, out);
            differences(&block.t, joints, &out.total_torque, &mut out.total_torque_rate);
        }
        if needs.derivatives {
            self.derivatives(block, out)?;
        }
        if needs.gravity {
            self.gravity(block, out)?;
        }
        Ok(())
    }

    /// The rigid body's torque over a block, several samples at once.
    fn torque(&self, block: &Block, torque: &mut Vec<f64>) -> Result<(), DimensionError> {
        let (joints, samples) = (block.joints, block.t.len());
        torque.resize(samples * joints, 0.0);
        let mut workspace = Workspace::new(&self.tree);
        let mut state = LanesOfMotion::default();
        let mut of_samples = vec![Lanes([0.0; SAMPLES]); joints];
        for first in (0..samples).step_by(SAMPLES) {
            // Lanes beyond the last sample repeat it.
            state.set(block, |lane| (first + lane).min(samples - 1));
            let LanesOfMotion { q, v, a } = &state;
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || self.tree.inverse_dynamics(q, v, a, &mut workspace, &mut of_samples),
            )?;
            for (lane, row) in
                torque[first * joints..].chunks_exact_mut(joints.max(1)).take(SAMPLES).enumerate()
            {
                row.iter_mut().zip(&of_samples).for_each(|(value, lanes)| *value = lanes.0[lane]);
            }
        }
        Ok(())
    }

    /// The rates of the rigid body's torque over a block.
    fn rates(&self, block: &Block, out: &mut BlockReference) {
        let (first, second) = (&mut out.torque_rate, &mut out.torque_second_rate);
        self.local_rates(block).apply(block.joints, &out.torque, first, second);
    }

    /// What differentiates the torques over a block.
    fn local_rates(&self, block: &Block) -> LocalRates {
        let period = match block.t.as_slice() {
            [first, .., last] => (last - first) / (block.t.len() - 1) as f64,
            _ => 1.0,
        };
        LocalRates::new(period, RATE_BAND * block.motion_bandwidth_hz, &self.windows)
    }

    /// Where the links are behind compliant joints whose encoders sit on the motors: q − τ/k, with τ at the
    /// link's own position, by iteration.
    pub(crate) fn deflected(
        &self,
        block: &Block,
        compliances: &[(usize, f64)],
    ) -> Result<Block, DimensionError> {
        let mut links = block.clone();
        let mut out = BlockReference::default();
        for _ in 0..DEFLECTION_STEPS {
            self.torque(&links, &mut out.torque)?;
            self.rates(&links, &mut out);
            for &(joint, compliance) in compliances {
                let signals = [
                    (&mut links.q, &block.q, &out.torque),
                    (&mut links.qd, &block.qd, &out.torque_rate),
                    (&mut links.qdd, &block.qdd, &out.torque_second_rate),
                ];
                for (link, encoder, torque) in signals {
                    let at = (joint..link.len()).step_by(block.joints);
                    at.for_each(|at| link[at] = encoder[at] - compliance * torque[at]);
                }
            }
        }
        Ok(links)
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
        let at: Vec<usize> = (0..samples - 1).step_by(stride).chain([samples - 1]).collect();
        let mut workspace = DerivativesWorkspace::new(&self.tree);
        let mut found = ForceDerivatives::new(&self.tree);
        let mut state = LanesOfMotion::default();
        for several in at.chunks(SAMPLES) {
            // Lanes beyond the last sample repeat it.
            state.set(block, |lane| several[lane.min(several.len() - 1)]);
            let LanesOfMotion { q, v, a } = &state;
            pulp::Arch::new().dispatch(
                #[inline(always)]
                || self.tree.inverse_dynamics_derivatives(q, v, a, &mut workspace, &mut found),
            )?;
            for (values, found) in [
                (&mut out.by_position, &found.by_position),
                (&mut out.by_velocity, &found.by_velocity),
                (&mut out.by_acceleration, &found.by_acceleration),
            ] {
                for (lane, &sample) in several.iter().enumerate() {
                    let row = &mut values[sample * size..(sample + 1) * size];
                    row.iter_mut().zip(found).for_each(|(value, lanes)| *value = lanes.0[lane]);
                }
            }
        }
        for pair in at.windows(2) {
            for values in [&mut out.by_position, &mut out.by_velocity, &mut out.by_acceleration] {
                interpolate(values, size, pair[0], pair[1]);
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

/// Steps of the iteration for a link's deflection: each adds one order in the compliance.
const DEFLECTION_STEPS: usize = 2;

/// Band of torques' rates over the motion's bandwidth.
const RATE_BAND: f64 = 2.5;

/// Time between two evaluations of the derivatives \[s\].
const DERIVATIVE_PERIOD: f64 = 0.02;

/// Samples at which torques, and their derivatives, are computed at a time.
const SAMPLES: usize = 8;

/// The motion at several samples, side by side.
#[derive(Default)]
struct LanesOfMotion {
    q: Vec<Lanes<SAMPLES>>,
    v: Vec<Lanes<SAMPLES>>,
    a: Vec<Lanes<SAMPLES>>,
}

impl LanesOfMotion {
    /// Takes for each lane the sample that `of_lane` says.
    fn set(&mut self, block: &Block, of_lane: impl Fn(usize) -> usize) {
        let joints = block.joints;
        for (lanes, values) in [(&mut self.q, &block.q), (&mut self.v, &block.qd), (&mut self.a, &block.qdd)]
        {
            let at = |joint: usize, lane: usize| values[of_lane(lane) * joints + joint];
            lanes.clear();
            lanes.extend((0..joints).map(|joint| Lanes(std::array::from_fn(|lane| at(joint, lane)))));
        }
    }
}

/// Differences in time, central inside and one-sided at the ends, of rows of `width` numbers.
///
/// For the total torque: it jumps where a friction turns round, and is to be differentiated as it is.
fn differences(t: &[f64], width: usize, values: &[f64], rates: &mut Vec<f64>) {
    rates.resize(values.len(), 0.0);
    let samples = t.len();
    for sample in 0..samples {
        let (before, after) = (sample.saturating_sub(1), (sample + 1).min(samples - 1));
        let step = t[after] - t[before];
        for column in 0..width {
            let [low, high] = [before, after].map(|row| values[row * width + column]);
            rates[sample * width + column] = if step > 0.0 { (high - low) / step } else { 0.0 };
        }
    }
}
