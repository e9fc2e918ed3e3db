//! What a fitted design predicts over logs, sample by sample, in constant memory.

use crate::block_source::try_for_each_batch;
use crate::covariance::Covariance;
use crate::design::DesignScratch;
use crate::prediction_errors::BAND_95;
use crate::{BlockSource, Design, IdentificationError};
use phiw_dynamics::DimensionError;
use phiw_dynamics::check::check_size;
use phiw_telemetry::filter::FilterScratch;
use phiw_telemetry::{Block, LogError};
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
    /// Torques of the shares that were asked for ([`PredictionParts::shares`]) \[N·m, N\].
    pub shares: &'a [f64],
    /// Standard deviation of each predicted torque by what the parameters are not known to \[N·m, N\]; zero
    /// without [`PredictionParts::deviations`].
    pub parameter_std: &'a [f64],
    moves: &'a [f64],
}

/// The torque that effects of one kind deliver at one joint.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectShare {
    /// Kind of the effects.
    pub kind: String,
    /// The torque that they add to.
    pub row: usize,
    /// Their columns in an evaluation of the design, each with its parameter.
    columns: Vec<(usize, usize)>,
}

/// What is predicted beside the torque.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PredictionParts {
    /// The effects' shares, in the design's order; those of one kind at one joint are one.
    pub shares: Vec<EffectShare>,
    /// Deviations of all parameters, see
    /// [`Covariance::deviations`](crate::covariance::Covariance::deviations).
    pub deviations: Vec<Vec<f64>>,
}

impl PredictionParts {
    /// The shares of all effects of a design.
    pub fn of_effects(design: &Design) -> Self {
        let mut shares: Vec<EffectShare> = Vec::new();
        for (index, effect) in design.effects().iter().enumerate() {
            let (kind, own) = (effect.spec().kind, design.effect_parameters(index));
            for (row, layout) in design.rows().iter().enumerate() {
                let of_row = layout.parameters.iter().enumerate();
                let columns: Vec<(usize, usize)> = of_row
                    .filter(|(_, parameter)| own.contains(parameter))
                    .map(|(place, &parameter)| (layout.range.start + place, parameter))
                    .collect();
                let same = |share: &&mut EffectShare| share.kind == kind && share.row == row;
                match shares.iter_mut().find(same) {
                    _ if columns.is_empty() => {}
                    Some(share) => share.columns.extend(columns),
                    None => shares.push(EffectShare { kind: kind.clone(), row, columns }),
                }
            }
        }
        PredictionParts { shares, deviations: Vec::new() }
    }

    /// The same with the deviations of a covariance, scaled so that [`BAND_95`] of the torques' standard
    /// deviations are their 95 % band, however few folds the covariance is of.
    ///
    /// # Errors
    /// The covariance is not of this design.
    pub fn with_covariance(self, covariance: &Covariance, design: &Design) -> Result<Self, DimensionError> {
        let mut deviations = covariance.deviations(design.parameter_count())?;
        let scale = covariance.quantile_95() / BAND_95;
        deviations.iter_mut().flatten().for_each(|value| *value *= scale);
        Ok(PredictionParts { deviations, ..self })
    }
}

impl Prediction<'_> {
    /// Measured minus predicted torque \[N·m, N\].
    pub fn residual(&self, row: usize) -> f64 {
        self.measured[row] - self.predicted[row]
    }

    /// Whether the torque `row` counts in the fit: its joint moves (see [`Design::with_rest_speeds`]).
    pub fn counts(&self, row: usize) -> bool {
        crate::rests::moves(self.moves[row])
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
    let mut sink = |prediction: &Prediction<'_>| {
        sink(prediction);
        Ok::<(), IdentificationError>(())
    };
    predict_in_parts(design, parameters, &PredictionParts::default(), sources, &mut sink)
}

/// [`predict`] with the shares of effects and the uncertainty of the parameters; one more number each for
/// every share, and for every torque and deviation, goes through the filter. The sink can fail.
///
/// # Errors
/// The same, and what the sink fails with.
pub fn predict_in_parts<E: From<LogError> + From<IdentificationError>>(
    design: &Design,
    parameters: &[f64],
    parts: &PredictionParts,
    sources: &[&dyn BlockSource],
    sink: &mut dyn FnMut(&Prediction<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let check = |what, vector: &[f64]| {
        check_size(what, vector.len(), design.parameter_count()).map_err(IdentificationError::from)
    };
    check("parameters", parameters)?;
    parts.deviations.iter().try_for_each(|deviation| check("deviations of the parameters", deviation))?;
    let sums = Sums { design, parameters, parts };
    try_for_each_batch(sources, |batch| {
        let work = |predictor: &mut Predictor<'_>, block| predictor.predict(block);
        let blocks: Result<Vec<Outputs>, DimensionError> =
            batch.into_par_iter().map_init(|| Predictor::new(sums), work).collect();
        let blocks = blocks.map_err(IdentificationError::from)?;
        blocks.iter().try_for_each(|outputs| outputs.emit(sums, sink))
    })
}

/// What is summed over the columns of a sample.
#[derive(Clone, Copy)]
struct Sums<'a> {
    design: &'a Design,
    parameters: &'a [f64],
    parts: &'a PredictionParts,
}

impl Sums<'_> {
    /// Measured torques, predicted ones, how much each joint moves, the shares, and for each torque its
    /// deviations.
    fn width(self) -> usize {
        let torques = self.design.rows().len();
        (3 + self.parts.deviations.len()) * torques + self.parts.shares.len()
    }

    /// The same with one standard deviation for each torque.
    fn width_of_output(self) -> usize {
        4 * self.design.rows().len() + self.parts.shares.len()
    }

    /// A filtered row of sums as an output has it.
    fn put_output(self, row: &[f64], out: &mut Vec<f64>) {
        let (kept, deviations) = row.split_at(3 * self.design.rows().len() + self.parts.shares.len());
        out.extend_from_slice(kept);
        let each = self.parts.deviations.len();
        out.extend((0..self.design.rows().len()).map(|torque| {
            let own = &deviations[torque * each..(torque + 1) * each];
            own.iter().map(|deviation| deviation * deviation).sum::<f64>().sqrt()
        }));
    }

    fn of(self, evaluation: &[f64], out: &mut [f64]) {
        let torques = self.design.rows().len();
        let (main, rest) = out.split_at_mut(3 * torques);
        let (shares, deviations) = rest.split_at_mut(self.parts.shares.len());
        for (torque, layout) in self.design.rows().iter().enumerate() {
            main[torque] = layout.measured_torque(evaluation);
            main[torques + torque] = layout.torque(evaluation, self.parameters);
            main[2 * torques + torque] = evaluation[self.design.width() + torque];
        }
        for (value, share) in shares.iter_mut().zip(&self.parts.shares) {
            let terms = share.columns.iter();
            *value = terms.map(|&(column, parameter)| evaluation[column] * self.parameters[parameter]).sum();
        }
        let each = self.parts.deviations.len().max(1);
        for (values, layout) in deviations.chunks_exact_mut(each).zip(self.design.rows()) {
            for (value, deviation) in values.iter_mut().zip(&self.parts.deviations) {
                *value = layout.torque(evaluation, deviation);
            }
        }
    }
}

/// The filtered outputs of one block.
struct Outputs {
    log: usize,
    segment: usize,
    t: Vec<f64>,
    /// For each output what [`Sums::of`] gives, but one standard deviation for each torque in the place of
    /// all of its deviations.
    values: Vec<f64>,
    /// For each output: positions, velocities, accelerations.
    signals: Vec<f64>,
}

impl Outputs {
    fn emit<E>(
        &self,
        sums: Sums<'_>,
        sink: &mut dyn FnMut(&Prediction<'_>) -> Result<(), E>,
    ) -> Result<(), E> {
        let (log, segment, torques) = (self.log, self.segment, sums.design.rows().len());
        let joints = self.signals.len() / (3 * self.t.len()).max(1);
        let values = self.values.chunks_exact(sums.width_of_output().max(1));
        let both = values.zip(self.signals.chunks_exact((3 * joints).max(1)));
        for (&t, (values, signals)) in self.t.iter().zip(both) {
            let (measured, rest) = values.split_at(torques);
            let (predicted, rest) = rest.split_at(torques);
            let (moves, rest) = rest.split_at(torques);
            let (shares, parameter_std) = rest.split_at(sums.parts.shares.len());
            let (q, rest) = signals.split_at(joints);
            let (qd, qdd) = rest.split_at(joints);
            let prediction =
                Prediction { log, segment, t, measured, predicted, q, qd, qdd, shares, parameter_std, moves };
            sink(&prediction)?;
        }
        Ok(())
    }
}

struct Predictor<'a> {
    sums: Sums<'a>,
    scratch: DesignScratch<'a>,
    filter: FilterScratch,
    evaluation: Vec<f64>,
}

impl<'a> Predictor<'a> {
    fn new(sums: Sums<'a>) -> Self {
        Predictor {
            sums,
            scratch: sums.design.scratch(),
            filter: FilterScratch::default(),
            evaluation: vec![0.0; sums.design.evaluation_width()],
        }
    }

    fn predict(&mut self, mut block: Block) -> Result<Outputs, DimensionError> {
        let sums = self.sums;
        sums.design.correct(&mut block);
        self.scratch.begin(&block)?;
        let (scratch, evaluation) = (&mut self.scratch, &mut self.evaluation);
        let mut outputs = Outputs {
            log: block.log,
            segment: block.segment,
            t: Vec::with_capacity(block.outputs.len()),
            values: Vec::with_capacity(sums.width_of_output() * block.outputs.len()),
            signals: Vec::with_capacity(3 * block.joints * block.outputs.len()),
        };
        block.try_filter(
            sums.width(),
            &mut self.filter,
            |sample, row| {
                scratch.evaluate(&block, sample, evaluation)?;
                sums.of(evaluation, row);
                Ok::<(), DimensionError>(())
            },
            |output, t, row| {
                outputs.t.push(t);
                sums.put_output(row, &mut outputs.values);
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
