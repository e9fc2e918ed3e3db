//! Splitting a log where samples are missing.

pub use crate::gap::GapReason;

use crate::LogError;
use crate::reader::{Row, Rows};
use serde::{Deserialize, Serialize};

/// How often a log is interrupted for one reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct GapCount {
    /// The reason.
    pub reason: GapReason,
    /// Rows skipped for it; for [`GapReason::TimeJump`], which skips no row, the number of jumps.
    pub count: u64,
    /// The first line of the file where it happened, counted from 1.
    pub first_line: u64,
}

/// Spikes of one column.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct SpikeCount {
    /// The column, such as `q.joint_1`.
    pub column: String,
    /// Samples that are spikes.
    pub samples: u64,
    /// The line of the first, counted from 1.
    pub first_line: u64,
}

/// A stretch of samples without a gap.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Segment {
    /// Line of its first row in the file, counted from 1.
    pub first_line: u64,
    /// Samples in it.
    pub rows: usize,
    /// First time stamp, in seconds.
    #[serde(with = "crate::any_number")]
    pub t_start: f64,
    /// Last time stamp, in seconds.
    #[serde(with = "crate::any_number")]
    pub t_end: f64,
}

/// What takes the samples of a log, segment by segment.
pub(crate) trait SegmentSink {
    /// One sample `[t, q…, …]` of the current segment. Returns whether to go on.
    fn sample(&mut self, values: &[f64]) -> bool;
    /// The current segment is over. Returns whether to go on.
    fn end(&mut self, segment: Segment) -> bool;
    /// Called now and then with [`Rows::progress`].
    fn progress(&mut self, done: u64, total: u64);
}

/// Totals over the rows of a log.
#[derive(Debug, Clone, Default)]
pub(crate) struct RowCounts {
    pub rows: u64,
    pub used: u64,
    pub gaps: Vec<GapCount>,
}

impl RowCounts {
    fn gap(&mut self, reason: GapReason, line: u64) {
        match self.gaps.iter_mut().find(|gap| gap.reason == reason) {
            Some(gap) => gap.count += 1,
            None => self.gaps.push(GapCount { reason, count: 1, first_line: line }),
        }
    }

    /// Rows for a reason that splits nothing; none is no gap.
    pub fn add(&mut self, reason: GapReason, count: u64, first_line: u64) {
        if count > 0 {
            self.gaps.push(GapCount { reason, count, first_line });
            self.gaps.sort_by_key(|gap| gap.first_line);
        }
    }

    /// The reasons in words, starting with a separator; empty where there are none.
    pub fn reasons(&self, rows_are: &str) -> String {
        let words: Vec<_> = GapReason::ALL
            .iter()
            .filter_map(|reason| self.gaps.iter().find(|gap| gap.reason == *reason))
            .map(|gap| format!("{} × {} (first in {rows_are} {})", gap.count, gap.reason, gap.first_line))
            .collect();
        if words.is_empty() { String::new() } else { format!(": {}", words.join(", ")) }
    }
}

/// Rows between two calls of [`SegmentSink::progress`].
const ROWS_PER_PROGRESS: u64 = 1 << 13;

/// Hands all samples of `rows` to `sink`, in segments split at gaps, duplicate stamps and steps in time
/// longer than `longest_step` seconds.
///
/// # Errors
/// What [`Rows::next`] finds; time that runs backwards.
pub(crate) fn split(
    rows: &mut dyn Rows,
    longest_step: f64,
    sink: &mut dyn SegmentSink,
) -> Result<RowCounts, LogError> {
    let mut counts = RowCounts::default();
    let mut values = vec![0.0; rows.layout().width];
    let mut current: Option<Segment> = None;
    let mut previous: Option<f64> = None;
    loop {
        let row = rows.next(&mut values)?;
        if row == Row::End {
            break;
        }
        counts.rows += 1;
        if counts.rows.is_multiple_of(ROWS_PER_PROGRESS) {
            let (done, total) = rows.progress();
            sink.progress(done, total);
        }
        let (line, t, mut reason) = match row {
            Row::Sample { line } => (line, Some(values[0]), None),
            Row::Gap { line, reason, t } => (line, t, Some(reason)),
            Row::End => break,
        };
        if let (Some(t), Some(previous)) = (t, previous) {
            if t < previous {
                return Err(LogError::TimeBackwards {
                    path: rows.path().into(),
                    rows_are: rows.rows_are(),
                    line,
                    previous,
                    stamp: t,
                });
            }
            if t == previous && reason.is_none() {
                reason = Some(GapReason::DuplicateStamp);
            }
        }
        previous = t.or(previous);
        if let Some(reason) = reason {
            counts.gap(reason, line);
            if let Some(segment) = current.take()
                && !sink.end(segment)
            {
                return Ok(counts);
            }
            continue;
        }
        counts.used += 1;
        let t = values[0];
        if let Some(segment) = current
            && t - segment.t_end > longest_step
        {
            counts.gap(GapReason::TimeJump, line);
            current = None;
            if !sink.end(segment) {
                return Ok(counts);
            }
        }
        match &mut current {
            Some(segment) => {
                segment.rows += 1;
                segment.t_end = t;
            }
            None => current = Some(Segment { first_line: line, rows: 1, t_start: t, t_end: t }),
        }
        if !sink.sample(&values) {
            return Ok(counts);
        }
    }
    if let Some(segment) = current {
        sink.end(segment);
    }
    rows.account(&mut counts);
    let (_, total) = rows.progress();
    sink.progress(total, total);
    Ok(counts)
}
