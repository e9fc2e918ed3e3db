//! Files that are read whole: URDF, maps, models, plans, factors.

use crate::Error;
use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

/// The text of a file of at most `most` bytes.
///
/// # Errors
/// It is absent, no regular file (a pipe without a writer would block for ever), too large, or no UTF-8 text.
pub fn read_text(path: &Path, most: u64) -> Result<String, Error> {
    String::from_utf8(read_bytes(path, most)?).map_err(|error| Error::NotText {
        path: path.to_owned(),
        looks_like: phiw_telemetry::looks_like(error.as_bytes()).unwrap_or("bytes that are no UTF-8"),
    })
}

/// The bytes of a file of at most `most` bytes.
///
/// # Errors
/// It is absent, no regular file, or too large.
pub fn read_bytes(path: &Path, most: u64) -> Result<Vec<u8>, Error> {
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let too_large = || Error::TooLarge { path: path.to_owned(), most };
    if regular_file(path)?.len() > most {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    // A file may grow while it is read.
    File::open(path).and_then(|file| file.take(most + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > most {
        return Err(too_large());
    }
    Ok(bytes)
}

/// What the system knows of a regular file.
///
/// # Errors
/// It is absent, or no regular file: a pipe without a writer would block for ever.
pub fn regular_file(path: &Path) -> Result<Metadata, Error> {
    let metadata = path.metadata().map_err(|source| Error::Unreadable { path: path.to_owned(), source })?;
    if !metadata.is_file() {
        return Err(Error::NotAFile { path: path.to_owned() });
    }
    Ok(metadata)
}
