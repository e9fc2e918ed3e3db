//! Named arrays as a table: rows are the entries along the time.

use super::element::Element;
use super::rows::{Order, entry_name, orientation, row_count};
use super::section::{Section, SectionReader};
use crate::FormatError;
use crate::content_hash::ContentHash;
use crate::table::{Column, Step, Table};
use phiw_limits::Limits;
use std::io;
use std::path::{Path, PathBuf};

/// An array of numbers in a file.
#[derive(Debug, Clone)]
pub(crate) struct Array {
    /// Its name; empty where it is the only one and has none.
    pub name: String,
    pub shape: Vec<usize>,
    pub element: Element,
    pub order: Order,
    pub section: Section,
    /// The field's place in the records of a structured array: bytes of a record, and bytes before the field.
    pub record: Option<(usize, usize)>,
}

/// Bytes that are read at once from each array.
const BUFFER: usize = 1 << 15;
/// Arrays of one length, as a table.
pub(crate) struct ArrayTable {
    path: PathBuf,
    format: &'static str,
    rows: usize,
    next: usize,
    columns: Vec<Column>,
    places: Vec<Place>,
    selected: Vec<usize>,
    streams: Vec<Stream>,
    other_lengths: Vec<String>,
    hash: ContentHash,
}

/// Where the numbers of a column are.
#[derive(Debug, Clone)]
struct Place {
    array: Array,
    /// Numbers of a row in the array, and which of them this is.
    width: usize,
    entry: usize,
    /// Whether the rows follow each other (all entries of a row side by side), or the entries.
    by_rows: bool,
}

/// The bytes of an array from row to row, for all columns that come from it.
struct Stream {
    reader: SectionReader,
    /// Bytes of a row, and of all rows that were read at once.
    row_bytes: usize,
    buffer: Vec<u8>,
    at: usize,
    /// Rows that are not read yet.
    left: usize,
    /// For each column: its place among the selected, where in a row it is, how it is written.
    cells: Vec<(usize, usize, Element)>,
    /// Whether it ends where the section ends, so that the check sum can be compared.
    to_the_end: bool,
    name: String,
}

impl ArrayTable {
    /// # Errors
    /// No array is as long as the time.
    pub fn new(path: &Path, format: &'static str, arrays: Vec<Array>) -> Result<Self, FormatError> {
        let rows = row_count(arrays.iter().map(|array| (array.name.as_str(), array.shape.as_slice())));
        if rows == 0 {
            return Err(FormatError::Empty { path: path.into() });
        }
        let mut table = ArrayTable {
            path: path.into(),
            format,
            rows,
            next: 0,
            columns: Vec::new(),
            places: Vec::new(),
            selected: Vec::new(),
            streams: Vec::new(),
            other_lengths: Vec::new(),
            hash: ContentHash::default(),
        };
        for array in arrays {
            table.add(array)?;
        }
        Ok(table)
    }

    /// The columns of an array, where it has an entry for each row.
    fn add(&mut self, array: Array) -> Result<(), FormatError> {
        let Some((width, by_rows)) = orientation(&array.shape, self.rows, array.order) else {
            let shape: Vec<String> = array.shape.iter().map(usize::to_string).collect();
            self.other_lengths.push(format!("`{}` ({})", array.name, shape.join(" x ")));
            return Ok(());
        };
        let columns = self.columns.len().saturating_add(width);
        if columns > Limits::default().log_columns {
            let path = self.path.clone();
            return Err(FormatError::TooManyColumns { path, header: String::new(), columns });
        }
        for entry in 0..width {
            self.columns.push(Column::named(entry_name(&array.name, width, entry)));
            self.places.push(Place { array: array.clone(), width, entry, by_rows });
        }
        Ok(())
    }

    fn damaged(&self, name: &str, error: &io::Error) -> FormatError {
        let what = match error.kind() {
            io::ErrorKind::UnexpectedEof => format!("array `{name}` ends before its last row"),
            _ => format!("array `{name}`: {error}"),
        };
        FormatError::Damaged { path: self.path.clone(), format: self.format, what }
    }
}

/// Columns of one array that are read together.
struct Group<'a> {
    place: &'a Place,
    cells: Vec<(usize, usize, Element)>,
}

impl Table for ArrayTable {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        let mut groups: Vec<Group<'_>> = Vec::new();
        for (at, &column) in columns.iter().enumerate() {
            let place = &self.places[column];
            let Array { section, element, record, .. } = &place.array;
            let before = record.map_or(0, |(_, before)| before);
            let in_row = if place.by_rows { before + place.entry * element.bytes } else { 0 };
            let same = |group: &&mut Group<'_>| {
                let other = &group.place.array.section;
                (other.offset, other.skip, group.place.by_rows) == (section.offset, section.skip, true)
                    && place.by_rows
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.cells.push((at, in_row, *element)),
                None => groups.push(Group { place, cells: vec![(at, in_row, *element)] }),
            }
        }
        let mut streams = Vec::new();
        for Group { place, cells } in groups {
            let Place { array, width, entry, by_rows } = place;
            let bytes = array.element.bytes;
            let (row_bytes, ahead) = match (array.record, by_rows) {
                (Some((record, _)), _) => (record, 0),
                (None, true) => (width * bytes, 0),
                (None, false) => (bytes, (self.rows as u64).saturating_mul((entry * bytes) as u64)),
            };
            let reader = array.section.open(ahead).map_err(|error| self.damaged(&array.name, &error))?;
            streams.push(Stream {
                reader,
                row_bytes,
                buffer: Vec::new(),
                at: 0,
                left: self.rows,
                cells,
                to_the_end: *by_rows || entry + 1 == *width,
                name: array.name.clone(),
            });
        }
        self.streams = streams;
        self.selected = columns.to_vec();
        Ok(())
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        if self.next == self.rows {
            return Ok(Step::End);
        }
        let is_last = self.next + 1 == self.rows;
        let mut wrong = None;
        for stream in &mut self.streams {
            let read = stream.row(values).and_then(|()| match is_last && stream.to_the_end {
                true => stream.reader.finish(),
                false => Ok(()),
            });
            if let Err(error) = read {
                wrong = Some((stream.name.clone(), error));
                break;
            }
        }
        if let Some((name, error)) = wrong {
            return Err(self.damaged(&name, &error));
        }
        self.next += 1;
        self.hash.row(self.next as u64, values);
        Ok(Step::Row { place: self.next as u64 })
    }

    fn progress(&self) -> (u64, u64) {
        (self.next as u64, self.rows as u64)
    }

    fn content_hash(&self) -> u64 {
        self.hash.finish()
    }

    fn notes(&self) -> Vec<String> {
        match self.other_lengths.is_empty() {
            true => Vec::new(),
            false => vec![format!(
                "arrays that have not {} entries along the time are left out: {}",
                self.rows,
                self.other_lengths.join(", ")
            )],
        }
    }
}

impl Stream {
    /// The next row's numbers.
    fn row(&mut self, values: &mut [f64]) -> io::Result<()> {
        if self.at == self.buffer.len() {
            let rows = (BUFFER / self.row_bytes).clamp(1, self.left.max(1));
            self.buffer.resize(rows * self.row_bytes, 0);
            self.reader.fill(&mut self.buffer)?;
            self.at = 0;
            self.left -= rows.min(self.left);
        }
        let row = &self.buffer[self.at..self.at + self.row_bytes];
        for (at, in_row, element) in &self.cells {
            values[*at] = element.value(&row[*in_row..in_row + element.bytes]);
        }
        self.at += self.row_bytes;
        Ok(())
    }
}
