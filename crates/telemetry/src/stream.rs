//! The second pass over a log: conditioned blocks, one after the other.

use crate::blocks::BlockMaker;
use crate::clock::Resampler;
use crate::log_rows::open_log;
use crate::mending::without;
use crate::reader::Rows;
use crate::segments::Segment;
use crate::segments::{RowCounts, SegmentSink, split};
use crate::{Block, Conditioning, LogError, LogPlan, Survey};
use std::ops::ControlFlow;

/// What a [`stream`] gave.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct StreamSummary {
    /// Blocks handed out.
    pub blocks: usize,
    /// Outputs in them.
    pub outputs: usize,
    /// Segments in them.
    pub segments: usize,
    /// Segments too short for the filter.
    pub short_segments: usize,
    /// Usable rows in those.
    pub rows_in_short_segments: u64,
    /// Whether the sink broke off.
    pub stopped: bool,
}

/// Reads a surveyed log again and hands its conditioned samples to `sink`, block by block, in order.
///
/// Memory is that of one block and the filters' reach, whatever the length of the log. `progress` is called
/// with the bytes done and the bytes in total now and then. The sink can break off.
///
/// # Errors
/// What [`survey`](crate::survey()) finds, if the file has changed since; [`LogError::Cutoff`] and
/// [`LogError::NoLongSegment`].
pub fn stream(
    survey: &Survey,
    conditioning: &Conditioning,
    progress: &mut dyn FnMut(u64, u64),
    sink: &mut dyn FnMut(Block) -> ControlFlow<()>,
) -> Result<StreamSummary, LogError> {
    let joints: Vec<String> = survey.joints.iter().map(|joint| joint.name.clone()).collect();
    let mut rows = open_log(&survey.source, &joints, survey.torque)?;
    let summary = stream_rows(&mut rows, survey, conditioning, progress, sink)?;
    if !summary.stopped && rows.content_hash() != survey.content_hash {
        return Err(LogError::Changed { path: survey.path.clone() });
    }
    Ok(summary)
}

pub(crate) fn stream_rows(
    rows: &mut dyn Rows,
    survey: &Survey,
    conditioning: &Conditioning,
    progress: &mut dyn FnMut(u64, u64),
    sink: &mut dyn FnMut(Block) -> ControlFlow<()>,
) -> Result<StreamSummary, LogError> {
    let plan = conditioning.plan(survey)?;
    let mut streamer = Streamer {
        resampler: plan.resample.then(|| Resampler::new(plan.period, rows.layout())),
        maker: BlockMaker::new(&plan, rows.layout(), survey),
        plan: &plan,
        outlet: Outlet { sink, summary: StreamSummary::default() },
        progress,
        longest: 0,
    };
    let counts = usable_rows(rows, survey, &mut streamer)?;
    if !streamer.outlet.summary.stopped && (counts.rows, counts.used) != (survey.rows, survey.used_rows) {
        return Err(LogError::Changed { path: survey.path.clone() });
    }
    let summary = streamer.outlet.summary;
    if summary.segments == 0 && !summary.stopped {
        return Err(LogError::NoLongSegment {
            path: survey.path.clone(),
            longest: streamer.longest,
            needed: plan.shortest,
            cutoff_hz: conditioning.cutoff_hz,
        });
    }
    Ok(summary)
}

/// Hands the rows that the survey has found usable to `sink`.
pub(crate) fn usable_rows(
    rows: &mut dyn Rows,
    survey: &Survey,
    sink: &mut dyn SegmentSink,
) -> Result<RowCounts, LogError> {
    if survey.mending.is_none()
        && survey.spike_bounds.is_empty()
        && survey.still.is_empty()
        && survey.repeated.is_empty()
    {
        return split(rows, survey.longest_step, sink);
    }
    let rows = survey.mending.of(rows);
    let mut without = without(rows, &survey.spike_bounds, &survey.still, &survey.repeated);
    split(&mut without, survey.longest_step, sink)
}

struct Streamer<'a> {
    plan: &'a LogPlan,
    resampler: Option<Resampler>,
    maker: BlockMaker<'a>,
    outlet: Outlet<'a>,
    progress: &'a mut dyn FnMut(u64, u64),
    longest: usize,
}

/// Where blocks go.
struct Outlet<'a> {
    sink: &'a mut dyn FnMut(Block) -> ControlFlow<()>,
    summary: StreamSummary,
}

impl Outlet<'_> {
    fn put(&mut self, block: Block) {
        if self.summary.stopped {
            return;
        }
        self.summary.blocks += 1;
        self.summary.outputs += block.outputs.len();
        self.summary.segments = block.segment + 1;
        self.summary.stopped = (self.sink)(block).is_break();
    }
}

impl SegmentSink for Streamer<'_> {
    fn sample(&mut self, values: &[f64]) -> bool {
        let Streamer { maker, outlet, .. } = self;
        let mut take = |values: &[f64]| {
            if let Some(block) = maker.push(values) {
                outlet.put(block);
            }
        };
        match &mut self.resampler {
            Some(resampler) => resampler.push(values, take),
            None => take(values),
        }
        !self.outlet.summary.stopped
    }

    fn end(&mut self, segment: Segment) -> bool {
        let Streamer { maker, outlet, .. } = self;
        if let Some(resampler) = &mut self.resampler {
            resampler.end_segment(|values| {
                if let Some(block) = maker.push(values) {
                    outlet.put(block);
                }
            });
        }
        let segments = outlet.summary.segments;
        while let Some(block) = maker.finish_segment() {
            outlet.put(block);
        }
        self.longest = self.longest.max(segment.rows);
        if segment.rows < self.plan.shortest && outlet.summary.segments == segments {
            outlet.summary.short_segments += 1;
            outlet.summary.rows_in_short_segments += segment.rows as u64;
        }
        !self.outlet.summary.stopped
    }

    fn progress(&mut self, done: u64, total: u64) {
        (self.progress)(done, total);
    }
}
