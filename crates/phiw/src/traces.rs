//! Measured and predicted torque over the logs, thinned for pictures while they stream by.

use phiw_identification::{BlockSource, Design, Fold, IdentificationError, Prediction, WithRests, predict};
use phiw_report::page::TorqueTrace;
use phiw_report::plot::{Decimator, LINE_POINTS};

/// Whether motion was fitted or held out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The model was fitted to it.
    Train,
    /// The model has not seen it.
    HeldOut,
}

/// What one pass over the logs with a fitted model shows.
pub struct Traces {
    parts: Vec<Part>,
    train: ErrorSums,
    held_out: ErrorSums,
}

/// The motion of one log that has one role.
struct Part {
    log: usize,
    role: Role,
    segment: usize,
    joints: Vec<JointLines>,
}

/// Measured, predicted, residual.
struct JointLines([Decimator; 3]);

/// Sums over all outputs of one role, those at rest included.
#[derive(Clone, Default)]
struct ErrorSums {
    error_squares: f64,
    torque_squares: f64,
    outputs: u64,
    /// For each torque, outputs at which its joint rests.
    rests: Vec<u64>,
}

impl Traces {
    /// Streams the logs through the model, in constant memory.
    ///
    /// # Errors
    /// A log cannot be read.
    pub fn collect(
        design: &Design,
        parameters: &[f64],
        folds: [&[Fold]; 2],
        sources: &[&dyn BlockSource],
    ) -> Result<Self, IdentificationError> {
        let sums = ErrorSums { rests: vec![0; design.rows().len()], ..ErrorSums::default() };
        let mut traces = Traces { parts: Vec::new(), train: sums.clone(), held_out: sums };
        let [train, held_out] = folds;
        predict(design, parameters, sources, &mut |prediction| {
            let within =
                |folds: &[Fold]| folds.iter().any(|fold| fold.contains(prediction.log, prediction.t));
            if within(train) {
                traces.push(Role::Train, prediction);
            } else if within(held_out) {
                traces.push(Role::HeldOut, prediction);
            }
        })?;
        Ok(traces)
    }

    fn push(&mut self, role: Role, prediction: &Prediction<'_>) {
        self.sums_mut(role).push(prediction);
        let is_its = |part: &Part| (part.log, part.role) == (prediction.log, role);
        let part = self.parts.iter().position(is_its).unwrap_or_else(|| {
            self.parts.push(Part::new(role, prediction));
            self.parts.len() - 1
        });
        self.parts[part].push(prediction);
    }

    /// The lines of a joint, one trace for each log; `name` gives the log's name.
    pub fn of_joint(&self, role: Role, joint: usize, name: impl Fn(usize) -> String) -> Vec<TorqueTrace> {
        let trace = |part: &Part| {
            let [measured, predicted, residual] = part.joints[joint].0.each_ref().map(Decimator::finish);
            TorqueTrace { log: name(part.log), measured, predicted, residual }
        };
        self.parts.iter().filter(|part| part.role == role).map(trace).collect()
    }

    /// What the outputs at which joints rest add, of so many joints.
    pub fn with_rests(&self, joints: usize) -> WithRests {
        let outputs = self.train.outputs + self.held_out.outputs;
        let rests = |joint: usize| self.train.rests[joint] + self.held_out.rests[joint];
        WithRests {
            train_relative: self.train.relative(),
            held_out_relative: self.held_out.relative(),
            share: (0..joints).map(|joint| rests(joint) as f64 / outputs.max(1) as f64).collect(),
        }
    }

    fn sums_mut(&mut self, role: Role) -> &mut ErrorSums {
        match role {
            Role::Train => &mut self.train,
            Role::HeldOut => &mut self.held_out,
        }
    }
}

impl ErrorSums {
    /// RMS of the error over RMS of the torque.
    fn relative(&self) -> f64 {
        (self.error_squares / self.torque_squares).sqrt()
    }

    fn push(&mut self, prediction: &Prediction<'_>) {
        self.outputs += 1;
        for (joint, rests) in self.rests.iter_mut().enumerate() {
            self.error_squares += prediction.residual(joint).powi(2);
            self.torque_squares += prediction.measured[joint].powi(2);
            *rests += u64::from(!prediction.counts(joint));
        }
    }
}

impl Part {
    fn new(role: Role, prediction: &Prediction<'_>) -> Self {
        let lines = || JointLines([(); 3].map(|()| Decimator::new(LINE_POINTS)));
        let joints = prediction.measured.iter().map(|_| lines()).collect();
        Part { log: prediction.log, role, segment: prediction.segment, joints }
    }

    fn push(&mut self, prediction: &Prediction<'_>) {
        let interrupted = std::mem::replace(&mut self.segment, prediction.segment) != prediction.segment;
        for (joint, JointLines(lines)) in self.joints.iter_mut().enumerate() {
            if interrupted {
                lines.iter_mut().for_each(Decimator::gap);
            }
            // A residual at rest is whatever static friction carries: it is not the model's.
            let residual = if prediction.counts(joint) { prediction.residual(joint) } else { f64::NAN };
            let values = [prediction.measured[joint], prediction.predicted[joint], residual];
            lines.iter_mut().zip(values).for_each(|(line, value)| line.push(prediction.t, value));
        }
    }
}
