//! The rows of a log in any format: from its columns to the signals of joints, and to gaps.

use crate::LogError;
use crate::columns::{Columns, Layout, TorqueColumns};
use crate::gap::GapReason;
use crate::log_source::LogSource;
use crate::map::{Expression, LogFacts, LogPart, Signal};
use crate::reader::{Row, Rows, unusable};
use phiw_log_formats::{OpenOptions, Step, Table, is_missing};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::{Path, PathBuf};

/// A log, read row by row.
pub(crate) struct LogRows {
    path: PathBuf,
    table: Box<dyn Table>,
    columns: Columns,
    /// The columns of the table that are read, of one row.
    raw: Vec<f64>,
    /// Whether signals are the columns as they are.
    is_plain: bool,
    /// Last known values of signals that may be missing.
    last: Vec<f64>,
    /// Which stretches are read; `None` where all are.
    facts: Option<LogFacts>,
    /// [`LogSource::disturbed`].
    disturbed: Vec<[f64; 2]>,
    part: LogPart,
    first_stamp: Option<f64>,
}

/// Opens a log at its first row.
pub(crate) fn open_log(
    source: &LogSource,
    joints: &[String],
    torque: TorqueColumns,
) -> Result<LogRows, LogError> {
    open_log_of(source, joints, (torque, Signal::Torque))
}

/// The same with another signal in the torques' place.
pub(crate) fn open_log_of(
    source: &LogSource,
    joints: &[String],
    torque: (TorqueColumns, Signal),
) -> Result<LogRows, LogError> {
    let LogSource { path, map, part, columns: in_memory, disturbed, decoded, .. } = source;
    let map = map.as_deref();
    let options = OpenOptions { topic: map.and_then(|map| map.topic()).map(str::to_owned) };
    let mut table = match in_memory {
        Some(columns) => columns.table(),
        None => decoded.open(path, &options)?,
    };
    let mut columns = Columns::find(path, table.as_ref(), map, joints, torque)?;
    // A column is read once, whatever it is used for.
    let mut selected: Vec<usize> = Vec::new();
    for expression in &mut columns.of_place {
        expression.visit_columns(&mut |column| {
            let known = selected.iter().position(|selected| selected == column);
            *column = known.unwrap_or_else(|| {
                selected.push(*column);
                selected.len() - 1
            });
        });
    }
    table.select(&selected)?;
    let is_plain = columns
        .of_place
        .iter()
        .enumerate()
        .all(|(place, expression)| *expression == Expression::Column(place));
    let facts = map.map(|_| source.facts()).filter(|facts| !facts.holds_all(*part));
    Ok(LogRows {
        path: path.clone(),
        last: vec![f64::NAN; columns.layout.width],
        raw: vec![0.0; selected.len()],
        table,
        columns,
        is_plain,
        facts,
        disturbed: disturbed.clone(),
        part: *part,
        first_stamp: None,
    })
}

impl LogRows {
    /// Columns that are not used.
    pub fn ignored_columns(&self) -> &[String] {
        &self.columns.ignored
    }

    /// What the results should say of how the rows came about.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = self.columns.notes.clone();
        notes.extend(self.table.notes());
        notes
    }

    /// A hash of all content read so far: of the whole log once the rows are at their end. Logs are read
    /// again for every pass, so this says whether it is still the same.
    pub fn content_hash(&self) -> u64 {
        let hash = self.table.content_hash();
        if self.facts.is_none() {
            return hash;
        }
        let mut hasher = DefaultHasher::new();
        (hash, self.part).hash(&mut hasher);
        hasher.finish()
    }

    /// Signals into `values`; why the row cannot be used, and its time where that is known.
    fn signals(&mut self, values: &mut [f64]) -> (Option<GapReason>, Option<f64>) {
        if self.is_plain {
            values.copy_from_slice(&self.raw);
        } else {
            for (value, expression) in values.iter_mut().zip(&self.columns.of_place) {
                *value = expression.value(&self.raw);
            }
        }
        let mut reason = None;
        let mut t = None;
        for (place, value) in values.iter_mut().enumerate() {
            let mut gap = unusable(*value);
            if gap == Some(GapReason::NotFinite) && self.is_empty(place, *value) {
                gap = Some(GapReason::EmptyCell);
            }
            if self.columns.layout.may_be_missing(place) {
                match gap {
                    None => self.last[place] = *value,
                    Some(_) => *value = self.last[place],
                }
            } else if gap.is_some() {
                reason = reason.or(gap);
            } else if place == 0 {
                t = Some(*value);
            }
        }
        (reason, t)
    }

    /// Whether a signal that is no number is so since a cell is empty.
    fn is_empty(&mut self, place: usize, value: f64) -> bool {
        let raw = &self.raw;
        let mut empty = is_missing(value);
        self.columns.of_place[place].visit_columns(&mut |column| empty |= is_missing(raw[*column]));
        empty
    }

    fn is_left_out(&mut self, t: f64) -> bool {
        let first = *self.first_stamp.get_or_insert(t);
        self.facts.as_ref().is_some_and(|facts| !facts.holds(self.part, t - first))
    }
}

impl Rows for LogRows {
    fn layout(&self) -> &Layout {
        &self.columns.layout
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        let line = match self.table.next(&mut self.raw)? {
            Step::End => return Ok(Row::End),
            Step::Truncated { place } => {
                return Ok(Row::Gap { line: place, reason: GapReason::TruncatedLastRow, t: None });
            }
            Step::Row { place } => place,
        };
        let (mut reason, t) = self.signals(values);
        if let Some(t) = t {
            if self.disturbed.iter().any(|[from, to]| (*from..=*to).contains(&t)) {
                reason = Some(GapReason::Disturbed);
            }
            if self.is_left_out(t) {
                reason = Some(GapReason::LeftOut);
            }
        }
        Ok(match reason {
            None => Row::Sample { line },
            Some(reason) => Row::Gap { line, reason, t },
        })
    }

    fn progress(&self) -> (u64, u64) {
        self.table.progress()
    }

    fn path(&self) -> &Path {
        &self.path
    }

    fn rows_are(&self) -> &'static str {
        self.table.rows_are()
    }
}
