//! Logs as CSV files.

use crate::columns::{Columns, Layout, TorqueColumns};
use crate::gap::GapReason;
use crate::reader::{LogFile, Row, Rows, unusable};
use crate::{LogError, number};
use phiw_limits::Limits;
use std::cell::RefCell;
use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::rc::Rc;

/// Rows of a CSV file.
pub(crate) struct CsvLog {
    path: PathBuf,
    columns: Columns,
    csv: csv::Reader<Tap>,
    hasher: Rc<RefCell<DefaultHasher>>,
    bytes: u64,
    /// The last line has no line feed: its last cell may be cut.
    cut_short: bool,
    /// One row read ahead, since the last one is treated apart.
    ahead: csv::ByteRecord,
    record: csv::ByteRecord,
    has_ahead: bool,
    /// Last known values of signals that may be missing.
    last: Vec<f64>,
}

impl CsvLog {
    /// Reads the header. `file` is at its beginning, and has `bytes` bytes.
    pub fn new(
        path: &Path,
        mut file: File,
        bytes: u64,
        joints: &[String],
        torque: TorqueColumns,
    ) -> Result<Self, LogError> {
        let unreadable = |source| LogError::reading(path.into(), source);
        let mut last_byte = [0];
        file.seek(SeekFrom::End(-1)).and_then(|_| file.read_exact(&mut last_byte)).map_err(unreadable)?;
        file.rewind().map_err(unreadable)?;

        let hasher = Rc::new(RefCell::new(DefaultHasher::new()));
        // Quoting is off: a stray quote would make the rest of the file one cell, held in memory.
        let mut csv = csv::ReaderBuilder::new()
            .flexible(true)
            .has_headers(false)
            .quoting(false)
            .buffer_capacity(1 << 16)
            .from_reader(Tap { file, hasher: hasher.clone(), line: 1, line_bytes: 0 });
        let mut record = csv::ByteRecord::new();
        let unreadable = |error: csv::Error| LogError::reading(path.into(), error.into());
        if !csv.read_byte_record(&mut record).map_err(unreadable)? {
            return Err(LogError::Empty { path: path.into() });
        }
        let name = |cell: &[u8]| {
            String::from_utf8_lossy(cell)
                .trim_start_matches('\u{feff}')
                .trim()
                .trim_matches('"')
                .trim()
                .to_owned()
        };
        if record.len() > Limits::default().log_columns {
            return Err(LogError::TooManyColumns { path: path.into(), columns: record.len() });
        }
        let columns = Columns::from_header(path, record.iter().map(name).collect(), joints, torque)?;
        let mut ahead = csv::ByteRecord::new();
        let has_ahead = csv.read_byte_record(&mut ahead).map_err(unreadable)?;
        let last = vec![f64::NAN; columns.layout.width];
        Ok(CsvLog {
            path: path.into(),
            columns,
            csv,
            hasher,
            bytes,
            cut_short: last_byte[0] != b'\n',
            ahead,
            record,
            has_ahead,
            last,
        })
    }

    fn parse(&mut self, line: u64, values: &mut [f64]) -> Result<Row, LogError> {
        let mut reason = None;
        let mut t = None;
        for (place, value) in values.iter_mut().enumerate() {
            let column = self.columns.of_place[place];
            let cell = unquoted(self.record[column].trim_ascii());
            let (parsed, gap) = if cell.is_empty() {
                (f64::NAN, Some(GapReason::EmptyCell))
            } else {
                let number = number::parse(cell).ok_or_else(|| LogError::NotANumber {
                    path: self.path.clone(),
                    line,
                    column: self.columns.names[column].clone(),
                    cell: String::from_utf8_lossy(cell).chars().take(40).collect(),
                })?;
                (number, unusable(number))
            };
            *value = parsed;
            if self.columns.layout.may_be_missing(place) {
                match gap {
                    None => self.last[place] = parsed,
                    Some(_) => *value = self.last[place],
                }
            } else if gap.is_some() {
                reason = reason.or(gap);
            } else if place == 0 {
                t = Some(parsed);
            }
        }
        Ok(match reason {
            None => Row::Sample { line },
            Some(reason) => Row::Gap { line, reason, t },
        })
    }
}

impl LogFile for CsvLog {
    fn ignored_columns(&self) -> &[String] {
        &self.columns.ignored
    }

    fn content_hash(&self) -> u64 {
        self.hasher.borrow().finish()
    }
}

impl Rows for CsvLog {
    fn layout(&self) -> &Layout {
        &self.columns.layout
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        if !self.has_ahead {
            return Ok(Row::End);
        }
        std::mem::swap(&mut self.record, &mut self.ahead);
        self.has_ahead = self
            .csv
            .read_byte_record(&mut self.ahead)
            .map_err(|error| LogError::reading(self.path.clone(), error.into()))?;
        let line = self.record.position().map_or(0, csv::Position::line);
        let is_last = !self.has_ahead;
        let (expected, found) = (self.columns.names.len(), self.record.len());
        if is_last && (self.cut_short || found < expected) {
            return Ok(Row::Gap { line, reason: GapReason::TruncatedLastRow, t: None });
        }
        if found != expected {
            return Err(LogError::WrongCellCount { path: self.path.clone(), line, expected, found });
        }
        self.parse(line, values)
    }

    fn progress(&self) -> (u64, u64) {
        (self.csv.position().byte(), self.bytes)
    }

    fn path(&self) -> &Path {
        &self.path
    }
}

/// A cell without the quotes that spreadsheets put round numbers.
fn unquoted(cell: &[u8]) -> &[u8] {
    match cell {
        [b'"', inside @ .., b'"'] => inside.trim_ascii(),
        cell => cell,
    }
}

/// A file whose bytes are hashed as they pass, and whose lines are as long as a log's can be.
struct Tap {
    file: File,
    hasher: Rc<RefCell<DefaultHasher>>,
    /// Which line the next byte is on, and how many bytes of it have passed.
    line: u64,
    line_bytes: usize,
}

impl Read for Tap {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(buffer)?;
        self.hasher.borrow_mut().write(&buffer[..count]);
        let most = Limits::default().log_line_bytes;
        for part in buffer[..count].split_inclusive(|&byte| byte == b'\n') {
            self.line_bytes += part.len();
            // The CSV reader holds a whole line in memory, so its length is limited here.
            if self.line_bytes > most {
                let line = self.line;
                return Err(io::Error::other(format!(
                    "line {line} has more than {most} bytes; this is no log"
                )));
            }
            if part.ends_with(b"\n") {
                (self.line, self.line_bytes) = (self.line + 1, 0);
            }
        }
        Ok(count)
    }
}
