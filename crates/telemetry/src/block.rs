//! A stretch of conditioned samples that can be worked on by itself.

use crate::parallel_filter::{FilterScratch, ParallelFilter};
use std::convert::Infallible;
use std::ops::Range;
use std::sync::Arc;

/// Consecutive conditioned samples of one segment, with all that is needed to filter and decimate what is
/// computed from them.
///
/// A block owns its arrays, so it can be sent to another thread, and depends on no other block: it overlaps
/// its neighbours by the parallel filter's half-length. The outputs of all blocks together are those of the
/// whole segment, each once, whatever the size of the blocks.
///
/// Arrays of joints are row-major, `[sample × joints]`.
#[derive(Debug, Clone)]
pub struct Block {
    /// Which log of the session it is from, counted from 0.
    pub log: usize,
    /// Which segment of the log, counted from 0 over those long enough for the filter.
    pub segment: usize,
    /// What to add to `t` to get the session's time, in seconds.
    pub session_offset: f64,
    /// Time of the log's first usable sample, in seconds.
    pub log_start: f64,
    /// Joints in a row.
    pub joints: usize,
    /// Time of each sample, in seconds.
    pub t: Vec<f64>,
    /// Positions, smoothed, in rad or m.
    pub q: Vec<f64>,
    /// Velocities, in rad/s or m/s.
    pub qd: Vec<f64>,
    /// Accelerations, in rad/s² or m/s².
    pub qdd: Vec<f64>,
    /// Torques as measured, in N·m or N: the parallel filter treats them together with the columns. Empty
    /// where the log has none.
    pub tau: Vec<f64>,
    /// Temperatures as measured, the last known one where a cell is empty, in °C; NaN for a joint without.
    /// `None` where no joint has any.
    pub temp: Option<Vec<f64>>,
    /// Frequency up to which the positions move, in Hz: a part of the cut-off of their low-pass.
    pub motion_bandwidth_hz: f64,
    /// Leading samples that no output covers: for effects with memory to warm up on.
    pub warm_up: usize,
    /// Samples to put out, ascending.
    pub outputs: Vec<usize>,
    pub(crate) filter: Arc<ParallelFilter>,
}

/// The signals of a sample, or of an output after the parallel filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Signals<'a> {
    /// Time, in seconds.
    pub t: f64,
    /// Positions, in rad or m.
    pub q: &'a [f64],
    /// Velocities, in rad/s or m/s.
    pub qd: &'a [f64],
    /// Accelerations, in rad/s² or m/s².
    pub qdd: &'a [f64],
    /// Torques, in N·m or N; empty where the log has none.
    pub tau: &'a [f64],
}

impl Block {
    /// Samples as they are, all of them outputs and none filtered: for signals that need no conditioning,
    /// such as those of a planned motion or of a simulator.
    ///
    /// `signals` are positions, velocities and accelerations, row-major `[sample × joints]`; `tau` likewise,
    /// or empty.
    pub fn unfiltered(joints: usize, t: Vec<f64>, signals: [Vec<f64>; 3], tau: Vec<f64>) -> Self {
        let [q, qd, qdd] = signals;
        let period = match t.as_slice() {
            [first, .., last] => (last - first) / (t.len() - 1) as f64,
            _ => 1.0,
        };
        Block {
            log: 0,
            segment: 0,
            session_offset: 0.0,
            log_start: t.first().copied().unwrap_or_default(),
            joints,
            outputs: (0..t.len()).collect(),
            t,
            q,
            qd,
            qdd,
            tau,
            temp: None,
            motion_bandwidth_hz: 0.1 / period,
            warm_up: 0,
            filter: Arc::new(ParallelFilter::identity()),
        }
    }

    /// Samples in the block.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether it has no samples.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Where a sample's values lie in the arrays of joints.
    pub fn row(&self, sample: usize) -> Range<usize> {
        sample * self.joints..(sample + 1) * self.joints
    }

    /// The signals of a sample, unfiltered.
    ///
    /// # Panics
    /// For a sample that is not there.
    pub fn signals(&self, sample: usize) -> Signals<'_> {
        let row = self.row(sample);
        Signals {
            t: self.t[sample],
            q: &self.q[row.clone()],
            qd: &self.qd[row.clone()],
            qdd: &self.qdd[row.clone()],
            tau: if self.tau.is_empty() { &[] } else { &self.tau[row] },
        }
    }

    /// The same samples with another filter over columns and torque; the outputs lie its decimation apart.
    ///
    /// It must not reach further than the present one, whose reach the block overlaps its neighbours by: then
    /// the outputs of all blocks together are again those of the whole segment.
    pub fn with_filter(&self, filter: &Arc<ParallelFilter>) -> Self {
        let own = |first: usize, last: usize| first..(last + self.filter.decimation()).min(self.len());
        let own = match self.outputs.as_slice() {
            [] => 0..0,
            [first, .., last] => own(*first, *last),
            [only] => own(*only, *only),
        };
        let outputs = own.step_by(filter.decimation()).collect();
        Block { outputs, filter: filter.clone(), ..self.clone() }
    }

    /// Blocks of those outputs alone whose time is `wanted`, one for each run of them, with no more samples
    /// than they need: what the filter covers, and up to `warm_up` samples before. Filtered they are the same
    /// as here.
    pub fn narrowed(&self, warm_up: usize, wanted: impl Fn(f64) -> bool) -> Vec<Self> {
        let is_wanted = |output: &usize| wanted(self.t[*output]);
        let runs = self.outputs.chunk_by(|a, b| is_wanted(a) == is_wanted(b));
        let runs = runs.filter(|run| run.first().is_some_and(is_wanted));
        runs.filter_map(|run| self.cut(run, warm_up)).collect()
    }

    /// The same outputs in `parts` blocks of about as many each, with the samples that they need as in
    /// [`narrowed`](Block::narrowed).
    pub fn in_parts(self, parts: usize, warm_up: usize) -> Vec<Self> {
        if parts < 2 || self.outputs.len() < parts {
            return vec![self];
        }
        let outputs = self.outputs.chunks(self.outputs.len().div_ceil(parts));
        outputs.filter_map(|outputs| self.cut(outputs, warm_up)).collect()
    }

    /// The samples that these of its outputs need.
    fn cut(&self, outputs: &[usize], warm_up: usize) -> Option<Self> {
        let reach = self.filter.half_length();
        let covered = outputs.first()?.saturating_sub(reach).max(self.warm_up);
        let start = covered.saturating_sub(warm_up);
        let end = (outputs.last()? + reach + 1).min(self.len());
        let of_joints = |values: &[f64]| values[start * self.joints..end * self.joints].to_vec();
        Some(Block {
            t: self.t[start..end].to_vec(),
            q: of_joints(&self.q),
            qd: of_joints(&self.qd),
            qdd: of_joints(&self.qdd),
            tau: if self.tau.is_empty() { Vec::new() } else { of_joints(&self.tau) },
            temp: self.temp.as_deref().map(of_joints),
            warm_up: covered - start,
            outputs: outputs.iter().map(|output| output - start).collect(),
            filter: Arc::clone(&self.filter),
            ..*self
        })
    }

    /// The filter that goes over columns and torque.
    pub fn parallel_filter(&self) -> &ParallelFilter {
        &self.filter
    }

    /// Low-passes and decimates rows of any `width`: regressor columns, torques, whatever is computed from a
    /// sample.
    ///
    /// `evaluate(sample, row)` fills the row of a sample; it is called once for each sample from
    /// [`warm_up`](Block::warm_up) on, ascending. An effect with memory first runs over the samples before by
    /// itself. `emit(output, t, row)` gets each filtered row, with its place in [`outputs`](Block::outputs)
    /// and its time. Nothing is allocated per sample, and in `scratch` only when it is used for the first
    /// time or for wider rows.
    pub fn filter(
        &self,
        width: usize,
        scratch: &mut FilterScratch,
        mut evaluate: impl FnMut(usize, &mut [f64]),
        mut emit: impl FnMut(usize, f64, &[f64]),
    ) {
        let evaluate = |sample: usize, row: &mut [f64]| {
            evaluate(sample, row);
            Ok::<(), Infallible>(())
        };
        let emit = |output: usize, t: f64, row: &[f64]| {
            emit(output, t, row);
            Ok(())
        };
        match self.try_filter(width, scratch, evaluate, emit) {
            Ok(()) => {}
            Err(never) => match never {},
        }
    }

    /// [`filter`](Block::filter) with an `evaluate` and an `emit` that can fail; it stops at the first error.
    ///
    /// # Errors
    /// What either of them returns.
    pub fn try_filter<E>(
        &self,
        width: usize,
        scratch: &mut FilterScratch,
        evaluate: impl FnMut(usize, &mut [f64]) -> Result<(), E>,
        mut emit: impl FnMut(usize, f64, &[f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let range = self.warm_up..self.len();
        let emit = |output: usize, row: &[f64]| emit(output, self.t[self.outputs[output]], row);
        self.filter.run(range, &self.outputs, width, scratch, evaluate, emit)
    }

    /// [`filter`](Block::filter) of the signals themselves: `emit` gets each output's place in
    /// [`outputs`](Block::outputs) and its signals.
    pub fn filter_signals(&self, scratch: &mut FilterScratch, mut emit: impl FnMut(usize, Signals)) {
        let n = self.joints;
        let with_torque = !self.tau.is_empty();
        let width = if with_torque { 4 * n } else { 3 * n };
        let evaluate = |sample: usize, row: &mut [f64]| {
            let signals = self.signals(sample);
            let parts = [signals.q, signals.qd, signals.qdd, signals.tau];
            for (target, part) in row.chunks_exact_mut(n.max(1)).zip(parts) {
                target.copy_from_slice(part);
            }
        };
        self.filter(width, scratch, evaluate, |output, t, row| {
            let (q, rest) = row.split_at(n);
            let (qd, rest) = rest.split_at(n);
            let (qdd, tau) = rest.split_at(n);
            emit(output, Signals { t, q, qd, qdd, tau });
        });
    }
}
