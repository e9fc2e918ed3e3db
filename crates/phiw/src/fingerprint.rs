//! Which logs a model comes from.

use crate::Error;
use crate::session::Session;
use crate::warnings::file_name;
use phiw_identification::model::{DataFingerprint, DataRole};
use phiw_telemetry::{LogSource, Survey};
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A fingerprint of each log of a session.
///
/// # Errors
/// A log cannot be read any more.
pub fn of_session(session: &Session) -> Result<Vec<DataFingerprint>, Error> {
    let training = session.logs.training().len();
    let of_log = |(index, survey): (usize, &Survey)| {
        Ok(DataFingerprint {
            log: file_name(&survey.path),
            role: if index < training { DataRole::Train } else { DataRole::Validate },
            sha256: sha256(&survey.source)?,
            rows: survey.rows,
            used_rows: survey.used_rows,
        })
    };
    session.logs.surveys().iter().enumerate().map(of_log).collect()
}

/// The hash of the bytes of a file or folder, in hexadecimal digits; of a log in memory that of its columns:
/// each name, a line feed, the values' bytes, lowest first.
///
/// # Errors
/// It cannot be read.
pub fn sha256(source: &LogSource) -> Result<String, Error> {
    let path = &source.path;
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let mut hasher = Hasher(Sha256::new());
    let columns = source.columns.iter().flat_map(|log| log.columns());
    for (name, values) in columns {
        hasher.0.update(name.as_bytes());
        hasher.0.update(b"\n");
        values.iter().for_each(|value| hasher.0.update(value.to_le_bytes()));
    }
    let files = if source.columns.is_some() { Vec::new() } else { files(path).map_err(unreadable)? };
    for file in files {
        io::copy(&mut File::open(file).map_err(unreadable)?, &mut hasher).map_err(unreadable)?;
    }
    Ok(hasher.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// The file, or all files in the folder and below it, by name.
fn files(path: &Path) -> io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(vec![path.to_owned()]);
    }
    let mut entries = path.read_dir()?.map(|entry| Ok(entry?.path())).collect::<io::Result<Vec<_>>>()?;
    entries.sort();
    let below = entries.iter().map(|entry| files(entry)).collect::<io::Result<Vec<_>>>()?;
    Ok(below.into_iter().flatten().collect())
}

/// What is written is hashed.
struct Hasher(Sha256);

impl Write for Hasher {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.update(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
