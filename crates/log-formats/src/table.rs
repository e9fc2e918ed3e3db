//! A log as a table: named columns of numbers, read row by row.

use crate::FormatError;

/// A cell without a value: a NaN whose bits no computation gives.
pub const MISSING: f64 = f64::from_bits(0x7ff8_0000_6d69_7373);

/// Whether a cell is [`MISSING`], and not a NaN that was logged.
pub fn is_missing(value: f64) -> bool {
    value.to_bits() == MISSING.to_bits()
}

/// A column of a [`Table`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Column {
    /// Its name in the file, such as `effort[elbow]`, `observation.state[3]`, `q.elbow`.
    pub name: String,
    /// What it is by the definition of its format, in the names of our own logs: `effort[elbow]` of a
    /// `JointState` is `tau.elbow`.
    pub signal: Option<String>,
}

impl Column {
    /// A column of which no more than the name is known.
    pub fn named(name: impl Into<String>) -> Self {
        Column { name: name.into(), signal: None }
    }

    /// A column that is known by its format to be a signal of our own logs.
    pub fn with_signal(name: impl Into<String>, signal: impl Into<String>) -> Self {
        Column { name: name.into(), signal: Some(signal.into()) }
    }
}

/// What came next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// A row. `place` is what [`Table::rows_are`] counts, from 1.
    Row {
        /// The line of a text, the number of a message, the number of a row.
        place: u64,
    },
    /// The last row, and it is cut short, or may be.
    Truncated {
        /// As of a row.
        place: u64,
    },
    /// No more rows.
    End,
}

/// The rows of a log, whatever its format. Memory does not grow with their number.
pub trait Table {
    /// What there is to read.
    fn columns(&self) -> &[Column];

    /// Chooses the columns that [`next`](Table::next) gives, in this order. Called once, before the first
    /// row.
    ///
    /// # Errors
    /// The columns cannot be read together.
    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError>;

    /// Reads the next row into `values`, one for each column chosen; [`MISSING`] where there is none.
    ///
    /// # Errors
    /// The file is damaged, or holds what is no number.
    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError>;

    /// How far along: done and total, in bytes or rows.
    fn progress(&self) -> (u64, u64);

    /// A hash of all that was read so far: of the whole content once the rows are at their end.
    fn content_hash(&self) -> u64;

    /// What [`Step::Row`] counts: `line`, `message` or `row`.
    fn rows_are(&self) -> &'static str {
        "row"
    }

    /// Where the columns' names stand, in words that follow the file's name in a message; may be empty.
    fn header(&self) -> String {
        String::new()
    }

    /// What a reader of the results should know of how the rows came about; complete at the end.
    fn notes(&self) -> Vec<String> {
        Vec::new()
    }
}
