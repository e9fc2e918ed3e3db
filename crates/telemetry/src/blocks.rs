//! From the samples of a segment to blocks.

use crate::columns::Layout;
use crate::differentiator::Differentiator;
use crate::{Block, LogPlan, Session, Survey};

/// Takes the evenly spaced samples of a log and makes blocks of them, holding no more than one block and the
/// filters' reach.
pub(crate) struct BlockMaker<'a> {
    plan: &'a LogPlan,
    layout: Layout,
    session: Session,
    log_start: f64,
    differentiator: Differentiator,
    signals: Vec<Signal>,
    /// Samples at hand, row-major; the first is sample `first` of the segment.
    window: Vec<f64>,
    first: usize,
    /// Samples of the segment so far.
    length: usize,
    /// Outputs of the segment so far.
    outputs: usize,
    /// Segments put out so far.
    segment: usize,
}

impl<'a> BlockMaker<'a> {
    pub fn new(plan: &'a LogPlan, layout: &Layout, survey: &Survey) -> Self {
        BlockMaker {
            plan,
            layout: layout.clone(),
            session: survey.session,
            log_start: survey.time_range().0,
            signals: signals(plan, layout),
            differentiator: Differentiator::new(plan.kernel.clone()),
            window: Vec::new(),
            first: 0,
            length: 0,
            outputs: 0,
            segment: 0,
        }
    }

    /// Takes a sample; gives a block where it completes one.
    pub fn push(&mut self, values: &[f64]) -> Option<Block> {
        self.window.extend_from_slice(values);
        self.length += 1;
        let last = self.outputs + self.plan.outputs_per_block - 1;
        // The block needs the filter's reach behind its last output, and each of its samples the kernel's
        // reach: then the block's end has no influence.
        let reach = self.plan.parallel.half_length() + self.plan.kernel.half_length();
        (self.length == self.place(last) + reach + 1)
            .then(|| self.block(last + 1, self.length - self.plan.kernel.half_length()))
    }

    /// The segment is over: gives the next of the blocks that are left, `None` once there is none and the
    /// next segment can come.
    pub fn finish_segment(&mut self) -> Option<Block> {
        // Index one past the last sample that is used.
        let end = self.length.saturating_sub(self.plan.edge);
        if self.length >= self.plan.shortest && self.place(self.outputs) < end {
            let all = (end - 1 - self.plan.edge) / self.plan.decimation() + 1;
            return Some(self.block(all.min(self.outputs + self.plan.outputs_per_block), end));
        }
        self.segment += usize::from(self.outputs > 0);
        self.window.clear();
        (self.first, self.length, self.outputs) = (0, 0, 0);
        None
    }

    /// Sample of an output in the segment.
    fn place(&self, output: usize) -> usize {
        self.plan.edge + output * self.plan.decimation()
    }

    /// The block of the outputs up to `outputs_end`; samples from `end` on are not used.
    fn block(&mut self, outputs_end: usize, end: usize) -> Block {
        let reach = self.plan.parallel.half_length();
        let from = |output: usize| self.place(output).saturating_sub(reach).max(self.plan.edge);
        let halo_start = from(self.outputs);
        let start = halo_start.saturating_sub(self.plan.warm_up).max(self.plan.edge);
        let end = end.min(self.place(outputs_end - 1) + reach + 1);
        let outputs = (self.outputs..outputs_end).map(|output| self.place(output) - start).collect();
        let next_start = from(outputs_end).saturating_sub(self.plan.warm_up);

        let block = self.conditioned(start, end, halo_start - start, outputs);
        self.outputs = outputs_end;
        let keep_from =
            next_start.saturating_sub(self.plan.kernel.half_length()).max(self.first).min(self.length);
        self.window.drain(..(keep_from - self.first) * self.layout.width);
        self.first = keep_from;
        block
    }

    fn conditioned(&mut self, start: usize, end: usize, warm_up: usize, outputs: Vec<usize>) -> Block {
        let (n, width) = (self.layout.joints, self.layout.width);
        let rows = end - start;
        let (window, first) = (&self.window, self.first);
        let mut derivatives = [(); 3].map(|()| vec![0.0; rows * n]);
        let wanted: Vec<[bool; 3]> =
            self.signals.iter().map(|signal| signal.makes.map(|target| target.is_some())).collect();
        self.differentiator.apply(
            &wanted,
            self.length,
            start..end,
            |signal, k| window[(k - first) * width + self.signals[signal].place],
            |signal, order, k, value| {
                let Signal { joint, makes, .. } = self.signals[signal];
                if let Some(target) = makes[order] {
                    derivatives[target][(k - start) * n + joint] = value;
                }
            },
        );
        let [q, qd, qdd] = derivatives;
        let rows_at_hand = || window[(start - first) * width..(end - first) * width].chunks_exact(width);
        let tau = match self.layout.torque {
            true => rows_at_hand().flat_map(|row| &row[self.layout.tau()..][..n]).copied().collect(),
            false => Vec::new(),
        };
        let has_temp = self.layout.temp.iter().any(Option::is_some);
        let temps = |row: &[f64]| -> Vec<f64> {
            self.layout.temp.iter().map(|place| place.map_or(f64::NAN, |place| row[place])).collect()
        };
        Block {
            log: self.session.log,
            segment: self.segment,
            session_offset: self.session.offset,
            log_start: self.log_start,
            joints: n,
            t: rows_at_hand().map(|row| row[0]).collect(),
            temp: has_temp.then(|| rows_at_hand().flat_map(temps).collect()),
            q,
            qd,
            qdd,
            tau,
            motion_bandwidth_hz: self.plan.motion_bandwidth_hz,
            warm_up,
            outputs,
            filter: self.plan.parallel.clone(),
        }
    }
}

/// A measured signal and what its value and its derivatives make: `Some(0)` positions, `Some(1)` velocities,
/// `Some(2)` accelerations.
#[derive(Debug, Clone, Copy)]
struct Signal {
    place: usize,
    joint: usize,
    makes: [Option<usize>; 3],
}

/// A measured derivative takes the place of one by differentiation, and is differentiated itself where it can
/// be.
fn signals(plan: &LogPlan, layout: &Layout) -> Vec<Signal> {
    let mut signals = Vec::new();
    for joint in 0..layout.joints {
        let velocity = layout.qd[joint].filter(|_| plan.measured_velocity[joint]);
        let acceleration = layout.qdd[joint].filter(|_| plan.measured_acceleration[joint]);
        let last = acceleration.is_none().then_some(2);
        let mut add = |place, makes| signals.push(Signal { place, joint, makes });
        let position = layout.q() + joint;
        match velocity {
            None => add(position, [Some(0), Some(1), last]),
            Some(velocity) => {
                add(position, [Some(0), None, None]);
                add(velocity, [Some(1), last, None]);
            }
        }
        if let Some(acceleration) = acceleration {
            add(acceleration, [Some(2), None, None]);
        }
    }
    signals
}
