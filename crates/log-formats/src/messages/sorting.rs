//! Rows that come a little out of order, put in order.

use std::collections::VecDeque;

/// Rows that are held back at most. At 1 kHz these are 0.25 s, far more than messages of one topic overtake
/// each other by; at 100 joints a row has 3 kB.
pub(crate) const WINDOW: usize = 256;

/// A row with its stamp \[ns\] and its number in the file.
#[derive(Debug)]
pub(crate) struct StampedRow {
    pub stamp: i64,
    pub place: u64,
    pub values: Vec<f64>,
}

/// The latest rows, sorted by stamp; rows of one stamp stay in the order of the file.
#[derive(Default)]
pub(crate) struct Sorting {
    held: VecDeque<StampedRow>,
    unused: Vec<Vec<f64>>,
    last_given: Option<i64>,
    /// Rows that were out of order.
    pub moved: u64,
}

impl Sorting {
    /// Memory for a row of `width` values.
    pub fn row(&mut self, width: usize) -> Vec<f64> {
        let mut row = self.unused.pop().unwrap_or_default();
        row.clear();
        row.resize(width, crate::MISSING);
        row
    }

    /// Takes a row. Returns whether it came in time to be put in its place.
    #[must_use]
    pub fn push(&mut self, row: StampedRow) -> bool {
        if self.last_given.is_some_and(|last| row.stamp < last) {
            return false;
        }
        let place = self.held.iter().rposition(|other| other.stamp <= row.stamp).map_or(0, |at| at + 1);
        self.moved += u64::from(place < self.held.len());
        self.held.insert(place, row);
        true
    }

    /// Whether the first row can be given though more may come.
    pub fn is_full(&self) -> bool {
        self.held.len() > WINDOW
    }

    /// The first row, into `values`; its stamp and number.
    pub fn pop(&mut self, values: &mut [f64]) -> Option<(i64, u64)> {
        let row = self.held.pop_front()?;
        self.last_given = Some(row.stamp);
        values.copy_from_slice(&row.values);
        self.unused.push(row.values);
        Some((row.stamp, row.place))
    }
}
