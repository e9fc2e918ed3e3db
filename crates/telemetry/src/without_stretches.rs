//! Stretches that the survey has found to say nothing, left out of all passes.

use crate::LogError;
use crate::columns::Layout;
use crate::gap::GapReason;
use crate::reader::{Row, Rows};
use crate::segments::RowCounts;
use std::path::Path;

/// Rows of which some stretches are gaps.
pub(crate) struct WithoutStretches<R> {
    rows: R,
    reason: GapReason,
    stretches: Vec<[f64; 2]>,
    next: usize,
}

impl<R: Rows> WithoutStretches<R> {
    /// `stretches` are first and last stamps \[s\], ascending.
    pub fn new(rows: R, reason: GapReason, stretches: Vec<[f64; 2]>) -> Self {
        WithoutStretches { rows, reason, stretches, next: 0 }
    }

    /// The rows with all stretches.
    pub fn into_inner(self) -> R {
        self.rows
    }
}

impl<R: Rows> Rows for WithoutStretches<R> {
    fn layout(&self) -> &Layout {
        self.rows.layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        let row = self.rows.next(values)?;
        let Row::Sample { line } = row else { return Ok(row) };
        while self.stretches.get(self.next).is_some_and(|[_, to]| values[0] > *to) {
            self.next += 1;
        }
        Ok(match self.stretches.get(self.next) {
            Some([from, _]) if values[0] >= *from => {
                Row::Gap { line, reason: self.reason, t: Some(values[0]) }
            }
            _ => row,
        })
    }

    fn progress(&self) -> (u64, u64) {
        self.rows.progress()
    }

    fn path(&self) -> &Path {
        self.rows.path()
    }

    fn account(&self, counts: &mut RowCounts) {
        self.rows.account(counts);
    }
}
