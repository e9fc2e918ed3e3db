//! The regressor at the samples of a block, several samples at once.

use phiw_dynamics::scalar::Lanes;
use phiw_dynamics::{DimensionError, Tree};
use phiw_regressor::{JointTorqueRegressor, RegressorScratch};
use phiw_telemetry::Block;

/// Samples side by side: two registers of AVX2, one of AVX-512.
const LANES: usize = 8;

/// Pairs of the [`JointTorqueRegressor`] at samples that are asked for one after the other.
pub(crate) struct PairsOfBlock {
    /// Whether the robot is at rest in each pose.
    at_rest: bool,
    one: RegressorScratch<f64>,
    several: RegressorScratch<Lanes<LANES>>,
    state: [Vec<Lanes<LANES>>; 3],
    pairs: Vec<Lanes<LANES>>,
    /// The first of the samples whose pairs are at hand.
    first: Option<usize>,
    rest: Vec<f64>,
}

impl PairsOfBlock {
    /// For a robot of so many velocities; `at_rest`: without its velocities and accelerations.
    pub fn new(regressor: &JointTorqueRegressor, velocities: usize, at_rest: bool) -> Self {
        let zero = Lanes([0.0; LANES]);
        PairsOfBlock {
            at_rest,
            one: regressor.scratch(),
            several: regressor.scratch(),
            state: [const { Vec::new() }; 3],
            pairs: vec![zero; regressor.buffer_size()],
            first: None,
            rest: vec![0.0; velocities],
        }
    }

    /// Another block follows.
    pub fn begin(&mut self) {
        self.first = None;
    }

    /// Writes the pairs of a sample.
    ///
    /// # Errors
    /// The block has not the robot's joints.
    pub fn put(
        &mut self,
        regressor: &JointTorqueRegressor,
        tree: &Tree,
        block: &Block,
        sample: usize,
        out: &mut [f64],
    ) -> Result<(), DimensionError> {
        let at_hand = |first: usize| (first..first + LANES).contains(&sample);
        if !self.first.is_some_and(at_hand) {
            if sample + LANES > block.t.len() {
                let row = block.row(sample);
                let q = &block.q[row.clone()];
                let (v, a) = match self.at_rest {
                    true => (self.rest.as_slice(), self.rest.as_slice()),
                    false => (&block.qd[row.clone()], &block.qdd[row]),
                };
                return regressor.compute(tree, q, v, a, &mut self.one, out);
            }
            self.compute(regressor, tree, block, sample)?;
            self.first = Some(sample);
        }
        let lane = sample - self.first.unwrap_or(sample);
        out.iter_mut().zip(&self.pairs).for_each(|(out, pairs)| *out = pairs.0[lane]);
        Ok(())
    }

    fn compute(
        &mut self,
        regressor: &JointTorqueRegressor,
        tree: &Tree,
        block: &Block,
        first: usize,
    ) -> Result<(), DimensionError> {
        let width = block.row(first).len();
        for (lanes, values) in self.state.iter_mut().zip([&block.q, &block.qd, &block.qdd]) {
            lanes.resize(width, Lanes([0.0; LANES]));
            for (place, lanes) in lanes.iter_mut().enumerate() {
                lanes.0 = std::array::from_fn(|lane| values[(first + lane) * width + place]);
            }
        }
        let [q, v, a] = &mut self.state;
        if self.at_rest {
            v.iter_mut().chain(a.iter_mut()).for_each(|lanes| *lanes = Lanes([0.0; LANES]));
        }
        regressor.compute_lanes(tree, q, v, a, &mut self.several, &mut self.pairs)
    }
}
