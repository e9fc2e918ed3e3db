//! One column of a Parquet file, row by row.

use crate::MISSING;
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::DataType;
use parquet::errors::{ParquetError, Result};

/// Rows that are decoded at once.
const BATCH: usize = 512;

/// The numbers of a column in one group of rows.
pub(crate) struct Leaf {
    reader: ColumnReader,
    /// Numbers in a row.
    width: usize,
    max_definition: i16,
    max_repetition: i16,
    /// Decoded rows, and how many of their numbers are used up.
    cells: Vec<f64>,
    at: usize,
}

impl Leaf {
    /// Of so many numbers a row.
    pub fn new(reader: ColumnReader, width: usize, max_definition: i16, max_repetition: i16) -> Self {
        Leaf { reader, width, max_definition, max_repetition, cells: Vec::new(), at: 0 }
    }

    /// The next row.
    pub fn row(&mut self) -> Result<&[f64]> {
        if self.at == self.cells.len() {
            self.cells.clear();
            self.at = 0;
            let lengths = self.decode(BATCH)?;
            if let Some(length) = lengths.into_iter().find(|length| *length != self.width) {
                return Err(general(format!("a row has {length} entries, others {}", self.width)));
            }
            if self.cells.is_empty() {
                return Err(general("a column ends before the others".into()));
            }
        }
        let row = &self.cells[self.at..self.at + self.width];
        self.at += self.width;
        Ok(row)
    }

    /// Numbers in the first row of a column of which that is not known.
    pub fn first_width(&mut self) -> Result<usize> {
        Ok(self.decode(1)?.first().copied().unwrap_or(0))
    }

    /// Decodes rows; gives how many numbers each has.
    fn decode(&mut self, rows: usize) -> Result<Vec<usize>> {
        let levels = (self.max_definition, self.max_repetition);
        let (cells, width) = (&mut self.cells, self.width);
        match &mut self.reader {
            ColumnReader::BoolColumnReader(reader) => {
                read(reader, rows, levels, width, cells, |x| f64::from(u8::from(*x)))
            }
            ColumnReader::Int32ColumnReader(reader) => {
                read(reader, rows, levels, width, cells, |x| f64::from(*x))
            }
            ColumnReader::Int64ColumnReader(reader) => {
                read(reader, rows, levels, width, cells, |x| *x as f64)
            }
            ColumnReader::FloatColumnReader(reader) => {
                read(reader, rows, levels, width, cells, |x| f64::from(*x))
            }
            ColumnReader::DoubleColumnReader(reader) => read(reader, rows, levels, width, cells, |x| *x),
            _ => Err(general("a column is not of numbers".into())),
        }
    }
}

fn general(what: String) -> ParquetError {
    ParquetError::General(what)
}

fn read<T: DataType>(
    reader: &mut ColumnReaderImpl<T>,
    rows: usize,
    (max_definition, max_repetition): (i16, i16),
    width: usize,
    cells: &mut Vec<f64>,
    number: impl Fn(&T::T) -> f64,
) -> Result<Vec<usize>> {
    let (mut definitions, mut repetitions, mut values) = (Vec::new(), Vec::new(), Vec::new());
    let (_, _, levels) = reader.read_records(
        rows,
        (max_definition > 0).then_some(&mut definitions),
        (max_repetition > 0).then_some(&mut repetitions),
        &mut values,
    )?;
    let mut values = values.iter();
    let mut lengths = Vec::new();
    for level in 0..levels {
        let is_there = max_definition == 0 || definitions.get(level) == Some(&max_definition);
        let begins = max_repetition == 0 || repetitions.get(level) == Some(&0);
        if begins {
            lengths.push(0);
        }
        if !is_there && begins && next_begins(&repetitions, level, levels) && width > 1 {
            // A row without a list: all of it is missing.
            cells.extend(std::iter::repeat_n(MISSING, width));
            lengths.pop();
            lengths.push(width);
            continue;
        }
        let value = if is_there { values.next().map(&number) } else { Some(MISSING) };
        cells.push(value.ok_or_else(|| general("a column has fewer values than it says".into()))?);
        if let Some(length) = lengths.last_mut() {
            *length += 1;
        }
    }
    Ok(lengths)
}

fn next_begins(repetitions: &[i16], level: usize, levels: usize) -> bool {
    level + 1 == levels || repetitions.get(level + 1) == Some(&0)
}
