//! Stretches of logs that are reproduced.

use crate::block_source::try_for_each_block;
use crate::{BlockSource, IdentificationError};
use phiw_telemetry::Block;

/// A stretch of a log without a gap: evenly spaced samples, row-major `[sample × joint]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Window {
    /// Which log of the session.
    pub log: usize,
    /// Its first moment in the log \[s\].
    pub start: f64,
    /// Distance of the samples \[s\].
    pub period: f64,
    /// Joints in a row.
    pub joints: usize,
    /// Positions \[rad, m\].
    pub q: Vec<f64>,
    /// Velocities \[rad/s, m/s\].
    pub qd: Vec<f64>,
    /// Measured torques, unfiltered \[N·m, N\].
    pub tau: Vec<f64>,
}

impl Window {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.q.len() / self.joints.max(1)
    }

    /// Whether it has no samples.
    pub fn is_empty(&self) -> bool {
        self.q.is_empty()
    }

    /// A row of one of its arrays, between the samples on a straight line; `at` \[s\] from its first sample.
    pub(super) fn interpolate(&self, values: &[f64], at: f64, out: &mut [f64]) {
        let place = (at / self.period).clamp(0.0, (self.len() - 1) as f64);
        let sample = (place as usize).min(self.len().saturating_sub(2));
        let share = place - sample as f64;
        for (joint, out) in out.iter_mut().enumerate() {
            let value = |sample: usize| values[sample.min(self.len() - 1) * self.joints + joint];
            *out = value(sample) * (1.0 - share) + value(sample + 1) * share;
        }
    }
}

/// Windows of `seconds` from blocks whose samples are all outputs, side by side; at most `most` of them,
/// spread evenly over the `total` seconds of all logs. Logs without torque have none.
///
/// # Errors
/// A log cannot be read.
pub fn collect_windows(
    sources: &[&dyn BlockSource],
    seconds: f64,
    total: f64,
    most: usize,
) -> Result<Vec<Window>, IdentificationError> {
    // Every `stride`th window is kept.
    let stride = (total / seconds / most.max(1) as f64).ceil().max(1.0) as usize;
    let mut windows = Vec::new();
    let mut collector = Collector { seconds, stride, place: None, open: None, complete: 0 };
    try_for_each_block(sources, |block| {
        collector.take(&block, &mut windows);
        Ok::<(), IdentificationError>(())
    })?;
    Ok(windows)
}

struct Collector {
    seconds: f64,
    stride: usize,
    /// Log and segment of the samples.
    place: Option<(usize, usize)>,
    open: Option<Window>,
    /// Windows that have been full, kept or not.
    complete: usize,
}

impl Collector {
    fn take(&mut self, block: &Block, windows: &mut Vec<Window>) {
        if block.tau.is_empty() || block.len() < 2 {
            return;
        }
        if self.place != Some((block.log, block.segment)) {
            self.place = Some((block.log, block.segment));
            self.open = None;
        }
        let period = (block.t[block.len() - 1] - block.t[0]) / (block.len() - 1) as f64;
        let needed = (self.seconds / period).round() as usize + 1;
        for &sample in &block.outputs {
            let row = block.row(sample);
            let window = self.open.get_or_insert_with(|| Window {
                log: block.log,
                start: block.t[sample],
                period,
                joints: block.joints,
                q: Vec::new(),
                qd: Vec::new(),
                tau: Vec::new(),
            });
            window.q.extend_from_slice(&block.q[row.clone()]);
            window.qd.extend_from_slice(&block.qd[row.clone()]);
            window.tau.extend_from_slice(&block.tau[row]);
            if window.len() == needed {
                let full = self.open.take();
                if self.complete.is_multiple_of(self.stride) {
                    windows.extend(full);
                }
                self.complete += 1;
            }
        }
    }
}
