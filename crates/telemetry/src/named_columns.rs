//! A log in memory: named columns, as a file has them.

use crate::columns::{Columns, Layout};
use crate::gap::GapReason;
use crate::reader::{LogFile, Row, Rows, unusable};
use crate::stream::stream_opened;
use crate::survey::survey_opened;
use crate::{Block, Conditioning, LogError, StreamSummary, Survey, TorqueColumns};
use std::hash::{DefaultHasher, Hasher};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

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
    /// [`LogError::ColumnLength`].
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

    /// [`survey`](crate::survey()) of the columns.
    ///
    /// # Errors
    /// Columns that are missing, time that runs backwards, no usable row.
    pub fn survey(
        &self,
        joints: &[String],
        torque: TorqueColumns,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Survey, LogError> {
        survey_opened(&mut || self.open(joints, torque), joints, torque, progress)
    }

    /// [`stream`](crate::stream()) of the columns, which have been surveyed.
    ///
    /// # Errors
    /// [`LogError::Cutoff`] and [`LogError::NoLongSegment`].
    pub fn stream(
        &self,
        survey: &Survey,
        conditioning: &Conditioning,
        progress: &mut dyn FnMut(u64, u64),
        sink: &mut dyn FnMut(Block) -> ControlFlow<()>,
    ) -> Result<StreamSummary, LogError> {
        let joints: Vec<String> = survey.joints.iter().map(|joint| joint.name.clone()).collect();
        let mut rows = self.open(&joints, survey.torque)?;
        stream_opened(rows.as_mut(), survey, conditioning, progress, sink)
    }

    fn open<'a>(
        &'a self,
        joints: &[String],
        torque: TorqueColumns,
    ) -> Result<Box<dyn LogFile + 'a>, LogError> {
        if self.rows() == 0 {
            return Err(LogError::Empty { path: self.name.clone() });
        }
        let names = self.columns.iter().map(|(name, _)| name.clone()).collect();
        let columns = Columns::from_header(&self.name, names, joints, torque)?;
        let last = vec![f64::NAN; columns.layout.width];
        Ok(Box::new(ColumnRows { log: self, columns, next: 0, last }))
    }
}

/// The rows of columns in memory.
struct ColumnRows<'a> {
    log: &'a NamedColumns,
    columns: Columns,
    next: usize,
    /// Last known values of signals that may be missing.
    last: Vec<f64>,
}

impl Rows for ColumnRows<'_> {
    fn layout(&self) -> &Layout {
        &self.columns.layout
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        if self.next == self.log.rows() {
            return Ok(Row::End);
        }
        let row = self.next;
        self.next += 1;
        let mut reason = None;
        for (place, value) in values.iter_mut().enumerate() {
            *value = self.log.columns[self.columns.of_place[place]].1[row];
            let gap = match value.is_nan() {
                true => Some(GapReason::EmptyCell),
                false => unusable(*value),
            };
            if self.columns.layout.may_be_missing(place) {
                match gap {
                    None => self.last[place] = *value,
                    Some(_) => *value = self.last[place],
                }
            } else {
                reason = reason.or(gap);
            }
        }
        let line = self.next as u64;
        Ok(match reason {
            None => Row::Sample { line },
            Some(reason) => Row::Gap { line, reason, t: Some(values[0]).filter(|t| unusable(*t).is_none()) },
        })
    }

    fn progress(&self) -> (u64, u64) {
        (self.next as u64, self.log.rows() as u64)
    }

    fn path(&self) -> &Path {
        &self.log.name
    }
}

impl LogFile for ColumnRows<'_> {
    fn ignored_columns(&self) -> &[String] {
        &self.columns.ignored
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
