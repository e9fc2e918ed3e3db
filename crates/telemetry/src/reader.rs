//! Rows of a log, one at a time, from a file or from memory.

use crate::LogError;
use crate::columns::Layout;
use crate::gap::GapReason;
use crate::segments::RowCounts;
use std::path::Path;

/// Beyond this magnitude a value is taken for rubbish (an uninitialised cell reads 1e279), not for a
/// measurement.
const HUGE: f64 = 1e100;

/// What came next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Row {
    /// All values needed are there.
    Sample { line: u64 },
    /// The row can't be used. `t` is kept where it is known, to see time running backwards.
    Gap { line: u64, reason: GapReason, t: Option<f64> },
    /// No more rows.
    End,
}

/// A source of samples: a file or arrays in memory.
pub(crate) trait Rows {
    fn layout(&self) -> &Layout;

    /// Reads the next row into `values`, whose length is the layout's width.
    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError>;

    /// How far along: done and total, in bytes or rows.
    fn progress(&self) -> (u64, u64);

    /// Name in error messages.
    fn path(&self) -> &Path;

    /// What the lines of [`Row`] count: `line`, `message` or `row`.
    fn rows_are(&self) -> &'static str {
        "line"
    }

    /// Adds to `counts` the rows that did not come, or not as they were, though nothing is split there.
    fn account(&self, counts: &mut RowCounts) {
        let _ = counts;
    }
}

impl<R: Rows + ?Sized> Rows for &mut R {
    fn layout(&self) -> &Layout {
        (**self).layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        (**self).next(values)
    }

    fn progress(&self) -> (u64, u64) {
        (**self).progress()
    }

    fn path(&self) -> &Path {
        (**self).path()
    }

    fn rows_are(&self) -> &'static str {
        (**self).rows_are()
    }

    fn account(&self, counts: &mut RowCounts) {
        (**self).account(counts);
    }
}

impl<R: Rows + ?Sized> Rows for Box<R> {
    fn layout(&self) -> &Layout {
        (**self).layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        (**self).next(values)
    }

    fn progress(&self) -> (u64, u64) {
        (**self).progress()
    }

    fn path(&self) -> &Path {
        (**self).path()
    }

    fn rows_are(&self) -> &'static str {
        (**self).rows_are()
    }

    fn account(&self, counts: &mut RowCounts) {
        (**self).account(counts);
    }
}

/// Why a number can't be a measurement.
pub(crate) fn unusable(value: f64) -> Option<GapReason> {
    match value {
        x if !x.is_finite() => Some(GapReason::NotFinite),
        x if x.abs() > HUGE => Some(GapReason::Huge),
        _ => None,
    }
}
