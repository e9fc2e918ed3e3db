//! Logs as text: cells separated by commas, semicolons or tabs, perhaps packed by gzip or zstd.

use crate::table::{Column, MISSING, Step, Table};
use crate::text_stream::{Packing, SharedPassed, TextStream, head};
use crate::{FormatError, number};
use phiw_limits::Limits;
use std::fs::File;
use std::path::{Path, PathBuf};

/// Rows of a CSV file.
pub(crate) struct CsvTable {
    path: PathBuf,
    columns: Vec<Column>,
    selected: Vec<usize>,
    csv: csv::Reader<TextStream>,
    passed: SharedPassed,
    separator: u8,
    packing: Packing,
    bytes: u64,
    /// One row read ahead, since the last one is treated apart.
    ahead: csv::ByteRecord,
    record: csv::ByteRecord,
    has_ahead: bool,
}

impl CsvTable {
    /// Reads the header. `file` is at its beginning, and has `bytes` bytes.
    pub fn new(path: &Path, mut file: File, bytes: u64, packing: Packing) -> Result<Self, FormatError> {
        let unreadable = |source| packing.error(path, source);
        let separator = separator(&head(path, &mut file, packing).map_err(unreadable)?);
        let stream = TextStream::new(file, packing).map_err(unreadable)?;
        let passed = stream.passed();
        // Quoting is off: a stray quote would make the rest of the file one cell, held in memory.
        let mut csv = csv::ReaderBuilder::new()
            .flexible(true)
            .has_headers(false)
            .quoting(false)
            .delimiter(separator)
            .buffer_capacity(1 << 16)
            .from_reader(stream);
        let mut record = csv::ByteRecord::new();
        let unreadable = |error: csv::Error| packing.error(path, error.into());
        if !csv.read_byte_record(&mut record).map_err(unreadable)? {
            return Err(FormatError::Empty { path: path.into() });
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
            let header = ", line 1".to_owned();
            return Err(FormatError::TooManyColumns { path: path.into(), header, columns: record.len() });
        }
        let columns: Vec<Column> = record.iter().map(name).map(Column::named).collect();
        let mut ahead = csv::ByteRecord::new();
        let has_ahead = csv.read_byte_record(&mut ahead).map_err(unreadable)?;
        Ok(CsvTable {
            path: path.into(),
            selected: (0..columns.len()).collect(),
            columns,
            csv,
            passed,
            separator,
            packing,
            bytes,
            ahead,
            record,
            has_ahead,
        })
    }

    fn parse(&self, line: u64, values: &mut [f64]) -> Result<(), FormatError> {
        for (value, &column) in values.iter_mut().zip(&self.selected) {
            let cell = unquoted(self.record[column].trim_ascii());
            *value = if cell.is_empty() {
                MISSING
            } else {
                self.number(cell).ok_or_else(|| FormatError::NotANumber {
                    path: self.path.clone(),
                    line,
                    column: self.columns[column].name.clone(),
                    cell: String::from_utf8_lossy(cell).chars().take(40).collect(),
                })?
            };
        }
        Ok(())
    }

    /// Where commas do not separate cells, they may separate decimals.
    fn number(&self, cell: &[u8]) -> Option<f64> {
        let parsed = number::parse(cell);
        if parsed.is_some() || self.separator == b',' {
            return parsed;
        }
        let with_point: Vec<u8> = cell.iter().map(|&byte| if byte == b',' { b'.' } else { byte }).collect();
        number::parse(&with_point)
    }
}

/// What separates the names in the first line: a comma where there is one.
fn separator(head: &[u8]) -> u8 {
    let line = head.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let found = [b',', b';', b'\t'].into_iter().find(|separator| line.contains(separator));
    found.unwrap_or(b',')
}

impl Table for CsvTable {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        self.selected = columns.to_vec();
        Ok(())
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        if !self.has_ahead {
            return Ok(Step::End);
        }
        std::mem::swap(&mut self.record, &mut self.ahead);
        self.has_ahead = self
            .csv
            .read_byte_record(&mut self.ahead)
            .map_err(|error| self.packing.error(&self.path, error.into()))?;
        let line = self.record.position().map_or(0, csv::Position::line);
        let is_last = !self.has_ahead;
        let (expected, found) = (self.columns.len(), self.record.len());
        // At the end all bytes have passed: without a line feed the last cell may be cut.
        if is_last && (found < expected || !self.passed.borrow().ends_with_line_feed()) {
            return Ok(Step::Truncated { place: line });
        }
        if found != expected {
            return Err(FormatError::WrongCellCount { path: self.path.clone(), line, expected, found });
        }
        self.parse(line, values)?;
        Ok(Step::Row { place: line })
    }

    fn progress(&self) -> (u64, u64) {
        match self.packing {
            Packing::None => (self.csv.position().byte(), self.bytes),
            _ => (self.passed.borrow().bytes_of_file().min(self.bytes), self.bytes),
        }
    }

    fn content_hash(&self) -> u64 {
        self.passed.borrow().hash()
    }

    fn rows_are(&self) -> &'static str {
        "line"
    }

    fn header(&self) -> String {
        ", line 1".into()
    }
}

/// A cell without the quotes that spreadsheets put round numbers.
fn unquoted(cell: &[u8]) -> &[u8] {
    match cell {
        [b'"', inside @ .., b'"'] => inside.trim_ascii(),
        cell => cell,
    }
}
