//! Some samples of the logs.

use crate::identify::Data;
use phiw_telemetry::{Block, LogError};
use std::ops::ControlFlow;

/// Samples over the training folds, `[sample × joint]`.
pub(super) struct Samples {
    pub joints: usize,
    pub q: Vec<f64>,
    pub qd: Vec<f64>,
    pub qdd: Vec<f64>,
    pub tau: Vec<f64>,
}

/// Part of a period of the fastest motion over which torques are averaged, to either side.
const AVERAGED_SHARE: f64 = 0.06;

impl Samples {
    /// About `count` of them, evenly in time.
    pub fn of(data: &Data<'_>, joints: usize, count: usize) -> Result<Self, LogError> {
        let mut samples = Samples { joints, q: Vec::new(), qd: Vec::new(), qdd: Vec::new(), tau: Vec::new() };
        let seconds: f64 = data.train.iter().map(|fold| fold.end - fold.start).sum();
        let step = seconds / count.max(1) as f64;
        for (log, source) in data.sources.iter().enumerate() {
            let mut next = f64::NEG_INFINITY;
            let in_training =
                |t: f64| data.train.iter().any(|fold| fold.log == log && fold.start <= t && t < fold.end);
            source.stream(&mut |block| {
                for &sample in block.outputs.iter().filter(|_| block.tau.len() == block.q.len()) {
                    let t = block.t[sample];
                    if t >= next && in_training(t) {
                        samples.take(&block, sample);
                        next = if next.is_finite() { (next + step).max(t) } else { t + step };
                    }
                }
                ControlFlow::Continue(())
            })?;
        }
        Ok(samples)
    }

    pub fn len(&self) -> usize {
        self.q.len() / self.joints.max(1)
    }

    fn take(&mut self, block: &Block, sample: usize) {
        let row = block.row(sample);
        for (own, signal) in [(&mut self.q, &block.q), (&mut self.qd, &block.qd), (&mut self.qdd, &block.qdd)]
        {
            own.extend_from_slice(&signal[row.clone()]);
        }
        let last = block.t.len() - 1;
        let period = (block.t[last] - block.t[0]) / last.max(1) as f64;
        let half = (AVERAGED_SHARE / (block.motion_bandwidth_hz * period).max(f64::MIN_POSITIVE)) as usize;
        let around = sample.saturating_sub(half)..=(sample + half).min(last);
        let count = around.clone().count() as f64;
        for joint in 0..self.joints {
            let sum: f64 = around.clone().map(|other| block.tau[other * block.joints + joint]).sum();
            self.tau.push(sum / count);
        }
    }
}
