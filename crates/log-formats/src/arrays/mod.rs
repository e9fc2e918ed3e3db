//! Files of named arrays: npz, npy, MAT. The rows of a log are the entries along the time.

mod array_table;
mod element;
mod mat5;
mod npy;
pub(crate) mod rows;
mod section;
mod zip_arrays;

pub(crate) use array_table::ArrayTable;
pub(crate) use mat5::MAT5;
pub use npy::NumberArray;

use crate::FormatError;
use crate::open::OpenOptions;
use crate::table::Table;
use std::path::Path;

/// First bytes of an array of NumPy.
pub(crate) const NPY: &[u8] = b"\x93NUMPY";
/// First bytes of a zip archive.
pub(crate) const ZIP: &[u8] = b"PK\x03\x04";

/// Opens a file of which the first bytes are known.
pub(crate) fn open_file(path: &Path, start: &[u8], _: &OpenOptions) -> Result<Box<dyn Table>, FormatError> {
    let (format, arrays) = match start {
        start if start.starts_with(ZIP) => ("npz", zip_arrays::read(path)?),
        start if start.starts_with(MAT5) => ("MAT-file", mat5::read(path)?),
        _ => ("npy", npy::read_file(path)?),
    };
    Ok(Box::new(ArrayTable::new(path, format, arrays)?))
}
