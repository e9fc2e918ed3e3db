//! Logs on disk, each opened by the reader of its format.

use crate::LogError;
use crate::columns::TorqueColumns;
use crate::csv_log::CsvLog;
use crate::reader::LogFile;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::path::Path;

/// Opens a log at its first row. Which format it has is seen in its first bytes: a new format is an
/// implementation of [`LogFile`] and a branch here.
pub(crate) fn open_log(
    path: &Path,
    joints: &[String],
    torque: TorqueColumns,
) -> Result<Box<dyn LogFile>, LogError> {
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
    file.rewind().map_err(unreadable)?;
    let mut head = [0; 4];
    let length = file.read(&mut head).map_err(unreadable)?;
    file.rewind().map_err(unreadable)?;
    if let Some(kind) = looks_like(&head[..length]) {
        return Err(LogError::NotText { path: path.into(), kind });
    }
    Ok(Box::new(CsvLog::new(path, file, bytes, joints, torque)?))
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
