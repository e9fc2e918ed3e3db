//! Which format a file has is seen in its content, not in its name.

use crate::csv::CsvTable;
use crate::guarded::GuardedTable;
use crate::table::Table;
use crate::text_stream::{Packing, head};
use crate::{FormatError, arrays, messages};
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// What a file with more than one table in it is asked for.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct OpenOptions {
    /// The topic of a recording of messages. Without one it is the only topic of joint states.
    pub topic: Option<String>,
}

/// Opens a log at its first row.
///
/// # Errors
/// It cannot be read, is damaged, or is no log.
pub fn open(path: &Path, options: &OpenOptions) -> Result<Box<dyn Table>, FormatError> {
    let unreadable = |source| FormatError::reading(path, source);
    // Asked before it is opened: a pipe without a writer would block for ever.
    let metadata = path.metadata().map_err(unreadable)?;
    if metadata.is_dir() {
        return GuardedTable::open(path, || match path.join("meta/info.json").is_file() {
            true => open_dataset(path),
            false => messages::open_folder(path, options),
        });
    }
    if !metadata.is_file() {
        return Err(unreadable(io::Error::other("it is no regular file; name a file")));
    }
    let mut file = File::open(path).map_err(unreadable)?;
    let bytes = file.seek(SeekFrom::End(0)).map_err(unreadable)?;
    if bytes == 0 {
        return Err(FormatError::Empty { path: path.into() });
    }
    file.rewind().map_err(unreadable)?;
    let start = start_of(&mut file).map_err(unreadable)?;
    let packing = match start.as_slice() {
        [0x1f, 0x8b, ..] => Packing::Gzip,
        [0x28, 0xb5, 0x2f, 0xfd, ..] => Packing::Zstd,
        _ => Packing::None,
    };
    #[cfg(not(feature = "zstd"))]
    if packing == Packing::Zstd {
        return Err(FormatError::LeftOut {
            path: path.into(),
            format: "text packed by zstd",
            feature: "zstd",
        });
    }
    if packing != Packing::None {
        let inside = head(path, &mut file, packing).map_err(|source| packing.error(path, source))?;
        if let Some(kind) = looks_like(&inside) {
            let kind = format!("packed, and inside it {kind}: unpack it");
            return Err(FormatError::NoLog { path: path.into(), kind });
        }
        return Ok(Box::new(CsvTable::new(path, file, bytes, packing)?));
    }
    if [messages::MCAP, messages::SQLITE, messages::ROS1_BAG].iter().any(|known| start.starts_with(known)) {
        return GuardedTable::open(path, || messages::open_file(path, &start, options));
    }
    if [arrays::ZIP, arrays::NPY, arrays::MAT5].iter().any(|known| start.starts_with(known)) {
        return GuardedTable::open(path, || arrays::open_file(path, &start, options));
    }
    if start.starts_with(PARQUET) {
        return GuardedTable::open(path, || open_dataset(path));
    }
    if [HDF5, MATLAB_73].iter().any(|known| start.starts_with(known)) {
        return GuardedTable::open(path, || open_hdf5(path));
    }
    if let Some(kind) = looks_like(&start) {
        return Err(FormatError::NoLog { path: path.into(), kind: kind.into() });
    }
    Ok(Box::new(CsvTable::new(path, file, bytes, Packing::None)?))
}

/// First bytes of a Parquet file.
const PARQUET: &[u8] = b"PAR1";
/// First bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";
/// First bytes of MATLAB's files that are HDF5, 512 bytes later.
const MATLAB_73: &[u8] = b"MATLAB 7.3 MAT-file";

#[cfg(feature = "lerobot")]
fn open_dataset(path: &Path) -> Result<Box<dyn Table>, FormatError> {
    let is_folder = path.is_dir();
    let table = if is_folder { crate::lerobot::open_folder(path)? } else { crate::lerobot::open_file(path)? };
    Ok(Box::new(table))
}

#[cfg(not(feature = "lerobot"))]
fn open_dataset(path: &Path) -> Result<Box<dyn Table>, FormatError> {
    let format = "a LeRobot dataset or a Parquet file";
    Err(FormatError::LeftOut { path: path.into(), format, feature: "lerobot" })
}

#[cfg(feature = "hdf5")]
fn open_hdf5(path: &Path) -> Result<Box<dyn Table>, FormatError> {
    Ok(Box::new(crate::hdf5::Hdf5Table::new(path)?))
}

#[cfg(not(feature = "hdf5"))]
fn open_hdf5(path: &Path) -> Result<Box<dyn Table>, FormatError> {
    Err(FormatError::LeftOut { path: path.into(), format: "HDF5", feature: "hdf5" })
}

/// The first bytes of a file that is at its beginning, where it is left.
pub(crate) fn start_of(file: &mut File) -> io::Result<Vec<u8>> {
    let mut start = Vec::new();
    file.take(128).read_to_end(&mut start)?;
    file.rewind()?;
    Ok(start)
}

/// What a file that is not UTF-8 text is by its first bytes, where they tell.
pub fn looks_like(bytes: &[u8]) -> Option<&'static str> {
    let kinds: [(&[u8], &str); 14] = [
        (b"\xff\xfe", "UTF-16"),
        (b"\xfe\xff", "UTF-16"),
        (b"\x1f\x8b", "gzip: unpack it"),
        (b"\x28\xb5\x2f\xfd", "zstd: unpack it"),
        (b"PK\x03\x04", "a zip archive: unpack it"),
        (b"BZh", "bzip2: unpack it"),
        (b"\xfd7zXZ", "xz: unpack it"),
        (b"\x89HDF", "HDF5"),
        (b"PAR1", "Parquet"),
        (b"\x7fELF", "a program"),
        (b"\x89MCAP", "MCAP"),
        (b"SQLite format 3", "an SQLite database"),
        (b"#ROSBAG V", "a ROS bag"),
        (b"\x93NUMPY", "a NumPy array"),
    ];
    let known = kinds.into_iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, kind)| kind);
    known.or_else(|| bytes.iter().take(4).any(|&byte| byte == 0).then_some("binary data"))
}
