//! npz: a zip archive of NumPy's arrays.

use super::array_table::Array;
use super::npy;
use super::section::{Section, SectionPacking};
use crate::FormatError;
use std::fs::File;
use std::path::Path;
use zip::CompressionMethod;

/// The arrays of an archive.
///
/// # Errors
/// It cannot be read, or holds no array.
pub(crate) fn read(path: &Path) -> Result<Vec<Array>, FormatError> {
    let damaged = |what: String| FormatError::Damaged { path: path.into(), format: "npz", what };
    let file = File::open(path).map_err(|source| FormatError::reading(path, source))?;
    let mut archive =
        zip::ZipArchive::new(std::io::BufReader::new(file)).map_err(|error| damaged(error.to_string()))?;
    let mut found = Vec::new();
    for index in 0..archive.len() {
        let entry = archive.by_index_raw(index).map_err(|error| damaged(error.to_string()))?;
        let name = entry.name().map_err(|error| damaged(error.to_string()))?;
        let Some(name) = name.strip_suffix(".npy").map(str::to_owned) else { continue };
        let packing = match entry.compression() {
            CompressionMethod::Stored => SectionPacking::Stored,
            CompressionMethod::Deflated => SectionPacking::Deflate,
            other => {
                return Err(FormatError::Unsupported {
                    path: path.into(),
                    what: format!("array `{name}` is packed by {other}"),
                    mend: "write it with numpy.savez or numpy.savez_compressed".into(),
                });
            }
        };
        let offset = entry.data_start().ok_or_else(|| damaged(format!("array `{name}` is nowhere")))?;
        let section = Section {
            path: path.into(),
            offset,
            length: entry.compressed_size(),
            packing,
            skip: 0,
            crc: Some(entry.crc32()),
        };
        drop(entry);
        found.extend(
            npy::arrays(name.clone(), section)
                .map_err(|error| damaged(format!("array `{name}`: {error}")))?,
        );
    }
    if found.is_empty() {
        let kind = "a zip archive without arrays of numbers: unpack it".to_owned();
        return Err(FormatError::NoLog { path: path.into(), kind });
    }
    Ok(found)
}
