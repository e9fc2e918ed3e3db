//! Which format a file has is seen in its content, not in its name.

use crate::csv::CsvTable;
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
        return messages::open_folder(path, options);
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
    if packing != Packing::None {
        let inside = head(path, &mut file, packing).map_err(unreadable)?;
        if let Some(kind) = looks_like(&inside) {
            let kind = format!("packed, and inside it {kind}: unpack it");
            return Err(FormatError::NoLog { path: path.into(), kind });
        }
        return Ok(Box::new(CsvTable::new(path, file, bytes, packing)?));
    }
    if start.starts_with(messages::MCAP) || start.starts_with(messages::SQLITE) {
        return messages::open_file(path, &start, options);
    }
    if [arrays::ZIP, arrays::NPY, arrays::MAT5].iter().any(|known| start.starts_with(known)) {
        return arrays::open_file(path, &start, options);
    }
    if let Some(kind) = looks_like(&start) {
        return Err(FormatError::NoLog { path: path.into(), kind: kind.into() });
    }
    Ok(Box::new(CsvTable::new(path, file, bytes, Packing::None)?))
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
        (b"\xff\xfe", "UTF-16: save it as UTF-8"),
        (b"\xfe\xff", "UTF-16: save it as UTF-8"),
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
