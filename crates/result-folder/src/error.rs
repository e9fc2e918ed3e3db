//! Why results cannot be written.

use std::io;
use std::path::{Path, PathBuf};

/// Why results cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum ResultError {
    /// Another run writes to the same place.
    #[error("{}: another run writes there ({holder}); wait until it has ended, or name another place", target.display())]
    Busy {
        /// The results' place.
        target: PathBuf,
        /// Who holds it.
        holder: String,
    },
    /// A result would overwrite an input.
    #[error(
        "{}: this result would overwrite the input {}; copy that file elsewhere, or name another place for the results",
        output.display(),
        input.display()
    )]
    IsInput {
        /// The result.
        output: PathBuf,
        /// The input.
        input: PathBuf,
    },
    /// The system refuses.
    #[error("{}: can't be written: {source}", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// Turns what the system says of `path` into an error.
pub(crate) fn unwritable(path: &Path) -> impl FnOnce(io::Error) -> ResultError {
    let path = path.to_owned();
    move |source| ResultError::Unwritable { path, source }
}
