//! Rows of a log, one at a time.

use crate::columns::{Columns, Layout, TorqueColumns};
use crate::gap::GapReason;
use crate::{LogError, number};
use phiw_limits::Limits;
use std::cell::RefCell;
use std::fs::File;
use std::hash::{DefaultHasher, Hasher};
use std::io::{self, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::rc::Rc;

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
}

/// Rows of a CSV file.
pub(crate) struct LogReader {
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

impl LogReader {
    pub fn open(path: &Path, joints: &[String], torque: TorqueColumns) -> Result<Self, LogError> {
        let unreadable = |source| LogError::reading(path.into(), source);
        // Asked before it is opened: a pipe without a writer would block for ever.
        let metadata = path.metadata().map_err(unreadable)?;
        if !metadata.is_file() {
            let what = if metadata.is_dir() { "a folder" } else { "no regular file" };
            return Err(unreadable(io::Error::other(format!("it is {what}; name a file"))));
        }
        let mut file = File::open(path).map_err(unreadable)?;
        let bytes = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
        if bytes == 0 {
            return Err(LogError::Empty { path: path.into() });
        }
        let mut last_byte = [0];
        file.seek(SeekFrom::End(-1)).and_then(|_| file.read_exact(&mut last_byte)).map_err(unreadable)?;
        file.rewind().map_err(unreadable)?;
        let mut head = [0; 4];
        let length = file.read(&mut head).map_err(unreadable)?;
        if let Some(kind) = looks_like(&head[..length]) {
            return Err(LogError::NotText { path: path.into(), kind });
        }
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
        Ok(LogReader {
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

    pub fn columns(&self) -> &Columns {
        &self.columns
    }

    /// A hash of all bytes read so far: of the whole file once the rows are at their end.
    pub fn content_hash(&self) -> u64 {
        self.hasher.borrow().finish()
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

/// Why a number can't be a measurement.
pub(crate) fn unusable(value: f64) -> Option<GapReason> {
    match value {
        x if !x.is_finite() => Some(GapReason::NotFinite),
        x if x.abs() > HUGE => Some(GapReason::Huge),
        _ => None,
    }
}

impl Rows for LogReader {
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

/// What a file that is not UTF-8 text is by its first bytes, where they tell.
pub fn looks_like(bytes: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 9] = [
        (b"\xff\xfe", "UTF-16"),
        (b"\xfe\xff", "UTF-16"),
        (b"\x1f\x8b", "gzip: unpack it"),
        (b"\x28\xb5\x2f\xfd", "zstd: unpack it"),
        (b"PK\x03\x04", "a zip archive: unpack it"),
        (b"BZh", "bzip2: unpack it"),
        (b"\x89HDF", "HDF5: export it as CSV"),
        (b"PAR1", "Parquet: export it as CSV"),
        (b"\x7fELF", "a program"),
    ];
    let known = kinds.into_iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, kind)| kind);
    known.or_else(|| bytes.iter().take(4).any(|&byte| byte == 0).then_some("binary data"))
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
            // The reader behind would hold all of the line in memory.
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
