//! A log in memory: named columns, as a file has them.

use crate::LogError;
use phiw_log_formats::{Column, FormatError, Step, Table};
use std::hash::{DefaultHasher, Hasher};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A log in memory: columns under the names that they would have in a file (`t`, `q.<joint>`, …), each of as
/// many values as there are rows. A value that is not finite is a gap.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedColumns {
    name: PathBuf,
    columns: Vec<(String, Vec<f64>)>,
}

impl NamedColumns {
    /// Columns as a log of this name, which stands in messages where a file has its path.
    ///
    /// # Errors
    /// [`LogError::ColumnLength`]; [`LogError::Empty`] without rows.
    pub fn new(name: impl Into<PathBuf>, columns: Vec<(String, Vec<f64>)>) -> Result<Self, LogError> {
        let name = name.into();
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        match columns.iter().find(|(_, values)| values.len() != rows) {
            Some((column, values)) => Err(LogError::ColumnLength {
                path: name,
                column: column.clone(),
                found: values.len(),
                first: columns[0].0.clone(),
                rows,
            }),
            None if rows == 0 => Err(LogError::Empty { path: name }),
            None => Ok(NamedColumns { name, columns }),
        }
    }

    /// The log's name.
    pub fn name(&self) -> &Path {
        &self.name
    }

    /// The columns, in order.
    pub fn columns(&self) -> &[(String, Vec<f64>)] {
        &self.columns
    }

    /// Rows of each column.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |(_, values)| values.len())
    }

    /// The log as files are read.
    pub(crate) fn table(self: &Arc<Self>) -> Box<dyn Table> {
        let columns = self.columns.iter().map(|(name, _)| Column::named(name)).collect();
        Box::new(ColumnTable { log: self.clone(), columns, selected: Vec::new(), next: 0 })
    }
}

/// The rows of columns in memory.
struct ColumnTable {
    log: Arc<NamedColumns>,
    columns: Vec<Column>,
    selected: Vec<usize>,
    next: usize,
}

impl Table for ColumnTable {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        self.selected = columns.to_vec();
        Ok(())
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        if self.next == self.log.rows() {
            return Ok(Step::End);
        }
        for (value, &column) in values.iter_mut().zip(&self.selected) {
            *value = self.log.columns[column].1[self.next];
        }
        self.next += 1;
        Ok(Step::Row { place: self.next as u64 })
    }

    fn progress(&self) -> (u64, u64) {
        (self.next as u64, self.log.rows() as u64)
    }

    fn content_hash(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for (name, values) in &self.log.columns {
            hasher.write(name.as_bytes());
            hasher.write_u8(b'\n');
            values.iter().for_each(|value| hasher.write_u64(value.to_bits()));
        }
        hasher.finish()
    }
}
