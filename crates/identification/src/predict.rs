//! What a fitted design predicts over logs, sample by sample, in constant memory.

use crate::block_source::try_for_each_batch;
use crate::design::DesignScratch;
use crate::{BlockSource, Design, IdentificationError};
use phiw_dynamics::DimensionError;
use phiw_dynamics::check::check_size;
use phiw_telemetry::Block;
use phiw_telemetry::filter::FilterScratch;
use rayon::prelude::*;

/// Measured and predicted torque at one moment, both after the parallel filter. Slices are over the torques.
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a> {
    /// Which log of the session.
    pub log: usize,
    /// Which segment of the log.
    pub segment: usize,
    /// Time in the log \[s\].
    pub t: f64,
    /// Measured torques \[N·m, N\].
    pub measured: &'a [f64],
    /// Torques of the model \[N·m, N\].
    pub predicted: &'a [f64],
    /// Positions at this moment \[rad, m\].
    pub q: &'a [f64],
    /// Velocities at this moment \[rad/s, m/s\].
    pub qd: &'a [f64],
    /// Accelerations at this moment \[rad/s², m/s²\].
    pub qdd: &'a [f64],
    moves: &'a [f64],
}

impl Prediction<'_> {
    /// Measured minus predicted torque \[N·m, N\].
    pub fn residual(&self, row: usize) -> f64 {
        self.measured[row] - self.predicted[row]
    }

    /// Whether the torque `row` counts in the fit: its joint moves (see [`Design::with_rest_speeds`]).
    pub fn counts(&self, row: usize) -> bool {
        crate::design::moves(self.moves[row])
    }
}

/// Hands the prediction at every output of every log to `sink`, in order.
///
/// The model's torque is summed sample by sample before the filter, which is linear: three numbers a torque
/// go through it instead of all columns.
///
/// # Errors
/// A log cannot be read, a block has not the robot's joints, or `parameters` has the wrong length.
pub fn predict(
    design: &Design,
    parameters: &[f64],
    sources: &[&dyn BlockSource],
    sink: &mut dyn FnMut(&Prediction<'_>),
) -> Result<(), IdentificationError> {
    check_size("parameters", parameters.len(), design.parameter_count())?;
    try_for_each_batch(sources, |batch| Ok(flush(design, parameters, batch, sink)?))
}

fn flush(
    design: &Design,
    parameters: &[f64],
    batch: Vec<Block>,
    sink: &mut dyn FnMut(&Prediction<'_>),
) -> Result<(), DimensionError> {
    let work = |predictor: &mut Predictor<'_>, block| predictor.predict(parameters, block);
    let blocks: Result<Vec<Outputs>, DimensionError> =
        batch.into_par_iter().map_init(|| Predictor::new(design), work).collect();
    blocks?.iter().for_each(|outputs| outputs.emit(design.rows().len(), sink));
    Ok(())
}

/// The filtered outputs of one block.
struct Outputs {
    log: usize,
    segment: usize,
    t: Vec<f64>,
    /// For each output: measured torques, predicted ones, and how much each joint moves.
    values: Vec<f64>,
    /// For each output: positions, velocities, accelerations.
    signals: Vec<f64>,
}

impl Outputs {
    fn emit(&self, torques: usize, sink: &mut dyn FnMut(&Prediction<'_>)) {
        let (log, segment) = (self.log, self.segment);
        let joints = self.signals.len() / (3 * self.t.len()).max(1);
        let both = self.values.chunks_exact(3 * torques).zip(self.signals.chunks_exact((3 * joints).max(1)));
        for (&t, (values, signals)) in self.t.iter().zip(both) {
            let (measured, rest) = values.split_at(torques);
            let (predicted, moves) = rest.split_at(torques);
            let (q, rest) = signals.split_at(joints);
            let (qd, qdd) = rest.split_at(joints);
            sink(&Prediction { log, segment, t, measured, predicted, q, qd, qdd, moves });
        }
    }
}

struct Predictor<'a> {
    design: &'a Design,
    scratch: DesignScratch<'a>,
    filter: FilterScratch,
    evaluation: Vec<f64>,
}

impl<'a> Predictor<'a> {
    fn new(design: &'a Design) -> Self {
        Predictor {
            design,
            scratch: design.scratch(),
            filter: FilterScratch::default(),
            evaluation: vec![0.0; design.evaluation_width()],
        }
    }

    fn predict(&mut self, parameters: &[f64], mut block: Block) -> Result<Outputs, DimensionError> {
        self.design.correct(&mut block);
        self.scratch.begin(&block)?;
        let (design, scratch, evaluation) = (self.design, &mut self.scratch, &mut self.evaluation);
        let torques = design.rows().len();
        let mut outputs = Outputs {
            log: block.log,
            segment: block.segment,
            t: Vec::with_capacity(block.outputs.len()),
            values: Vec::with_capacity(3 * torques * block.outputs.len()),
            signals: Vec::with_capacity(3 * block.joints * block.outputs.len()),
        };
        block.try_filter(
            3 * torques,
            &mut self.filter,
            |sample, row| {
                scratch.evaluate(&block, sample, evaluation)?;
                for (torque, layout) in design.rows().iter().enumerate() {
                    row[torque] = layout.measured_torque(evaluation);
                    row[torques + torque] = layout.torque(evaluation, parameters);
                    row[2 * torques + torque] = evaluation[design.width() + torque];
                }
                Ok::<(), DimensionError>(())
            },
            |output, t, row| {
                outputs.t.push(t);
                outputs.values.extend_from_slice(row);
                let at = block.row(block.outputs[output]);
                for signal in [&block.q, &block.qd, &block.qdd] {
                    outputs.signals.extend_from_slice(&signal[at.clone()]);
                }
                Ok(())
            },
        )?;
        Ok(outputs)
    }
}
