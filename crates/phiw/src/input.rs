//! Text files that are read whole: URDF, maps, models.

use crate::Error;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The text of a file of at most `most` bytes.
///
/// # Errors
/// It is absent, no regular file (a pipe without a writer would block for ever), too large, or no UTF-8 text.
pub fn read_text(path: &Path, most: u64) -> Result<String, Error> {
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let metadata = path.metadata().map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(Error::NotAFile { path: path.to_owned() });
    }
    let too_large = || Error::TooLarge { path: path.to_owned(), most };
    if metadata.len() > most {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    // A file may grow while it is read.
    File::open(path).and_then(|file| file.take(most + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.len() as u64 > most {
        return Err(too_large());
    }
    String::from_utf8(bytes).map_err(|error| Error::NotText {
        path: path.to_owned(),
        looks_like: phiw_telemetry::looks_like(error.as_bytes()).unwrap_or("bytes that are no UTF-8"),
    })
}
