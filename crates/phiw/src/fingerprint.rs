//! Which logs a model comes from.

use crate::Error;
use crate::session::Session;
use crate::warnings::file_name;
use phiw_identification::model::{DataFingerprint, DataRole};
use phiw_telemetry::Survey;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

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
            sha256: sha256(&survey.path)?,
            rows: survey.rows,
            used_rows: survey.used_rows,
        })
    };
    session.logs.surveys().iter().enumerate().map(of_log).collect()
}

/// The hash of a file's bytes, in hexadecimal digits.
///
/// # Errors
/// The file cannot be read.
pub fn sha256(path: &Path) -> Result<String, Error> {
    let unreadable = |source| Error::Unreadable { path: path.to_owned(), source };
    let mut hasher = Hasher(Sha256::new());
    io::copy(&mut File::open(path).map_err(unreadable)?, &mut hasher).map_err(unreadable)?;
    Ok(hasher.0.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
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
