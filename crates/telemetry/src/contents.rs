//! What columns a log has, before anything is known of what they mean.

use crate::LogError;
use phiw_log_formats::{Column, OpenOptions, Step};
use std::path::Path;

/// A log's columns and its first rows.
#[derive(Debug, Clone)]
pub struct LogContents {
    /// The columns.
    pub columns: Vec<Column>,
    /// The first rows, one after the other, a value for each column: NaN where there is none.
    pub values: Vec<f64>,
    /// How many rows these are.
    pub rows: usize,
}

/// Numbers that are looked at: a minute at 1 kHz with 70 columns.
const MOST_NUMBERS: usize = 1 << 22;
/// Rows that are looked at.
const MOST_ROWS: usize = 60_000;

impl LogContents {
    /// Reads the beginning of a log; `topic` is which one, where it has several.
    ///
    /// # Errors
    /// It cannot be read, or holds what is no number.
    pub fn read(path: &Path, topic: Option<&str>) -> Result<Self, LogError> {
        let options = OpenOptions { topic: topic.map(str::to_owned) };
        let mut table = phiw_log_formats::open(path, &options)?;
        let columns = table.columns().to_vec();
        table.select(&(0..columns.len()).collect::<Vec<_>>())?;
        let mut row = vec![f64::NAN; columns.len()];
        let (mut values, mut rows) = (Vec::new(), 0);
        while rows < MOST_ROWS && values.len() + columns.len() <= MOST_NUMBERS {
            match table.next(&mut row)? {
                Step::Row { .. } => values.extend_from_slice(&row),
                Step::Truncated { .. } => continue,
                Step::End => break,
            }
            rows += 1;
        }
        Ok(LogContents { columns, values, rows })
    }

    /// The first values of a column, those that are numbers.
    pub fn column(&self, column: usize) -> Vec<f64> {
        let all = self.values.iter().skip(column).step_by(self.columns.len().max(1));
        all.copied().filter(|value| value.is_finite()).collect()
    }
}
