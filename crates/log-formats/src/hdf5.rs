//! HDF5 files, and MATLAB's of version 7.3, which are such.

use crate::FormatError;
use crate::arrays::rows::{Order, entry_name, orientation, row_count};
use crate::content_hash::ContentHash;
use crate::table::{Column, Step, Table};
use hdf5_pure::{DType, Dataset, File, Group};
use phiw_limits::Limits;
use std::path::{Path, PathBuf};

/// Groups inside each other.
const DEEPEST: usize = 8;
/// Numbers that are read at once from each data set.
const BATCH: usize = 1 << 14;

/// Data sets of one length, as a table.
pub(crate) struct Hdf5Table {
    path: PathBuf,
    /// Keeps the data sets' file open.
    _file: File,
    rows: usize,
    next: usize,
    columns: Vec<Column>,
    /// Data set and entry of each column.
    places: Vec<(usize, usize)>,
    sets: Vec<Set>,
    /// For each place of a row: data set and entry.
    selected: Vec<(usize, usize)>,
    other_lengths: Vec<String>,
    hash: ContentHash,
}

/// A data set with an entry for each row.
struct Set {
    name: String,
    data: Dataset,
    width: usize,
    /// Whether its first axis is the time; else it is held in memory as a whole.
    by_rows: bool,
    is_selected: bool,
    /// The rows that are there: the first one's number, and numbers.
    first: usize,
    held: Vec<f64>,
}

impl Hdf5Table {
    /// # Errors
    /// It cannot be read, is damaged, or holds no numbers.
    pub fn new(path: &Path) -> Result<Self, FormatError> {
        let damaged = |error: hdf5_pure::Error| damaged(path, &error);
        let file = File::open_streaming(path).map_err(damaged)?;
        let mut found = Vec::new();
        collect(&file.root(), "", 0, &mut found).map_err(damaged)?;
        let leaf = |name: &str| name.rsplit('/').next().unwrap_or_default().to_owned();
        let named: Vec<(String, Vec<usize>)> =
            found.iter().map(|(name, _, shape)| (leaf(name), shape.clone())).collect();
        let rows = row_count(named.iter().map(|(name, shape)| (name.as_str(), shape.as_slice())));
        if rows == 0 {
            return Err(FormatError::Empty { path: path.into() });
        }
        let mut table = Hdf5Table {
            path: path.into(),
            _file: file,
            rows,
            next: 0,
            columns: Vec::new(),
            places: Vec::new(),
            sets: Vec::new(),
            selected: Vec::new(),
            other_lengths: Vec::new(),
            hash: ContentHash::default(),
        };
        for (name, data, shape) in found {
            table.add(name, data, &shape)?;
        }
        Ok(table)
    }

    fn add(&mut self, name: String, data: Dataset, shape: &[usize]) -> Result<(), FormatError> {
        let Some((width, by_rows)) = orientation(shape, self.rows, Order::LastFastest) else {
            let shape: Vec<String> = shape.iter().map(usize::to_string).collect();
            self.other_lengths.push(format!("`{name}` ({})", shape.join(" x ")));
            return Ok(());
        };
        // A vector along the second axis, as MATLAB writes them, is one row of the file.
        let by_rows = by_rows && shape.first() == Some(&self.rows);
        let columns = self.columns.len().saturating_add(width);
        if columns > Limits::default().log_columns {
            let path = self.path.clone();
            return Err(FormatError::TooManyColumns { path, header: String::new(), columns });
        }
        for entry in 0..width {
            let whole = entry_name(&name, width, entry);
            let leaf = name.rsplit_once('/').map(|(_, leaf)| entry_name(leaf, width, entry));
            self.columns.push(Column { name: whole, signal: leaf });
            self.places.push((self.sets.len(), entry));
        }
        self.sets.push(Set { name, data, width, by_rows, is_selected: false, first: 0, held: Vec::new() });
        Ok(())
    }
}

/// The data sets of numbers in a group and below it.
fn collect(
    group: &Group,
    prefix: &str,
    depth: usize,
    found: &mut Vec<(String, Dataset, Vec<usize>)>,
) -> Result<(), hdf5_pure::Error> {
    for name in group.datasets()? {
        let data = group.dataset(&name)?;
        let is_number = matches!(
            data.dtype()?,
            DType::F32
                | DType::F64
                | DType::I8
                | DType::I16
                | DType::I32
                | DType::I64
                | DType::U8
                | DType::U16
                | DType::U32
                | DType::U64
        );
        let shape: Option<Vec<usize>> = data.shape()?.into_iter().map(|size| size.try_into().ok()).collect();
        if let (true, Some(shape)) = (is_number, shape) {
            found.push((format!("{prefix}{name}"), data, shape));
        }
        if found.len() > Limits::default().log_columns {
            return Ok(());
        }
    }
    for name in group.groups()? {
        // MATLAB keeps what cells point to there.
        if depth < DEEPEST && name != "#refs#" {
            collect(&group.group(&name)?, &format!("{prefix}{name}/"), depth + 1, found)?;
        }
    }
    Ok(())
}

fn damaged(path: &Path, error: &hdf5_pure::Error) -> FormatError {
    // What a later version of the format has, and what its filters are.
    let newer = match error {
        hdf5_pure::Error::Format(error) => {
            let text = error.to_string();
            text.contains("version") || text.contains("unsupported")
        }
        _ => false,
    };
    if newer {
        return FormatError::Unsupported {
            path: path.into(),
            what: format!("this HDF5 file has what is not read ({error}), or is damaged"),
            mend: "write it for older readers (h5py: libver=\"v114\"; filters gzip, shuffle, lzf), or as npz"
                .into(),
        };
    }
    let what = error.to_string().replace('\n', " ");
    FormatError::Damaged { path: path.into(), format: "HDF5 file", what }
}

impl Set {
    /// Makes sure that a row's numbers are there.
    fn hold(&mut self, row: usize, rows: usize) -> Result<(), hdf5_pure::Error> {
        if !self.by_rows {
            if self.held.is_empty() {
                self.held = self.data.read_f64()?;
            }
            return Ok(());
        }
        let there = self.held.len() / self.width;
        if row < self.first + there && there > 0 {
            return Ok(());
        }
        let count = (BATCH / self.width).clamp(1, rows - row);
        self.held = self.data.read_f64_rows(row as u64, count as u64)?;
        self.first = row;
        Ok(())
    }

    fn value(&self, row: usize, entry: usize, rows: usize) -> Option<f64> {
        let at = if self.by_rows { (row - self.first) * self.width + entry } else { entry * rows + row };
        self.held.get(at).copied()
    }
}

impl Table for Hdf5Table {
    fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn select(&mut self, columns: &[usize]) -> Result<(), FormatError> {
        self.selected = columns.iter().map(|&column| self.places[column]).collect();
        let mut bytes = 0_u64;
        for &(set, _) in &self.selected {
            let set = &mut self.sets[set];
            if !set.is_selected && !set.by_rows {
                bytes = bytes.saturating_add(8 * (set.width as u64).saturating_mul(self.rows as u64));
            }
            set.is_selected = true;
        }
        let most = Limits::default().recording_bytes;
        if bytes > most {
            return Err(FormatError::Unsupported {
                path: self.path.clone(),
                what: format!(
                    "the time is the second axis of its data sets, so that they must be held in memory, {bytes} bytes where {most} are allowed"
                ),
                mend: "write them with the time as the first axis (in MATLAB: transposed), or as a CSV"
                    .into(),
            });
        }
        Ok(())
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Step, FormatError> {
        if self.next == self.rows {
            return Ok(Step::End);
        }
        for set in self.sets.iter_mut().filter(|set| set.is_selected) {
            set.hold(self.next, self.rows).map_err(|error| damaged(&self.path, &error))?;
        }
        for (value, &(set, entry)) in values.iter_mut().zip(&self.selected) {
            let set = &self.sets[set];
            *value = set.value(self.next, entry, self.rows).ok_or_else(|| FormatError::Damaged {
                path: self.path.clone(),
                format: "HDF5 file",
                what: format!("`{}` ends before its last row", set.name),
            })?;
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
                "data sets that have not {} entries along the time are left out: {}",
                self.rows,
                self.other_lengths.join(", ")
            )],
        }
    }
}
