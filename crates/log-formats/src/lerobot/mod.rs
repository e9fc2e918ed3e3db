//! LeRobot's datasets (versions 2 and 3): folders of Parquet files, and what `meta/info.json` says of them.

mod dataset;
mod info;
mod leaf;

pub(crate) use dataset::DatasetTable;

use crate::FormatError;
use info::Info;
use phiw_limits::Limits;
use std::path::{Path, PathBuf};

/// Folders inside each other below `data`; chunks are one deep.
const DEEPEST: usize = 3;

/// Opens a dataset's folder.
pub(crate) fn open_folder(path: &Path) -> Result<DatasetTable, FormatError> {
    let place = path.join("meta/info.json");
    let bytes = place.metadata().map_err(|source| FormatError::reading(&place, source))?.len();
    if bytes > Limits::default().model_bytes {
        let what = format!("it has {bytes} bytes");
        return Err(FormatError::Damaged { path: place, format: "dataset's description", what });
    }
    let text = std::fs::read_to_string(&place).map_err(|source| FormatError::reading(&place, source))?;
    let info = Info::parse(&text).map_err(|what| FormatError::Damaged {
        path: place,
        format: "dataset's description",
        what,
    })?;
    let data = path.join("data");
    let mut files = Vec::new();
    collect(&data, 0, &mut files).map_err(|source| FormatError::reading(&data, source))?;
    if files.is_empty() {
        return Err(FormatError::Empty { path: data });
    }
    DatasetTable::new(path, files, info)
}

/// Opens a Parquet file by itself.
pub(crate) fn open_file(path: &Path) -> Result<DatasetTable, FormatError> {
    DatasetTable::new(path, vec![path.to_owned()], Info::default())
}

/// The Parquet files of a folder and below it, in the order of their names: they are numbered with zeros
/// before them.
fn collect(folder: &Path, depth: usize, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    let mut entries =
        folder.read_dir()?.map(|entry| Ok(entry?.path())).collect::<std::io::Result<Vec<_>>>()?;
    entries.sort();
    for entry in entries {
        if entry.is_dir() && depth < DEEPEST {
            collect(&entry, depth + 1, files)?;
        } else if entry.extension().is_some_and(|extension| extension == "parquet") {
            files.push(entry);
        }
    }
    Ok(())
}
