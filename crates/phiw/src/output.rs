//! Where results may go: found out before the work begins.

use crate::Error;
use phiw_result_folder::{Lock, check_inputs};
use std::path::{Path, PathBuf};

/// Names of the files that `identify` and `explain` write.
pub const RESULT_FILES: [&str; 5] =
    ["model.json", "report.json", "report.html", "identified.urdf", "identified.xml"];

/// Takes a folder for the results of `command`: it can be there, none of its results is an input, and nobody
/// else writes to it.
///
/// # Errors
/// [`Error::OutIsFile`], [`Error::Output`].
pub fn take_folder(folder: &Path, inputs: &[PathBuf], command: &str) -> Result<Lock, Error> {
    check_folder(folder)?;
    let outputs: Vec<PathBuf> = RESULT_FILES.iter().map(|name| folder.join(name)).collect();
    check_inputs(inputs, &outputs)?;
    Ok(Lock::acquire(folder, command)?)
}

/// Finds out early whether a folder can be there: neither it nor a folder above it may be a file.
///
/// # Errors
/// [`Error::OutIsFile`].
pub fn check_folder(folder: &Path) -> Result<(), Error> {
    match folder.ancestors().find(|path| path.exists()) {
        Some(file) if !file.is_dir() => Err(Error::OutIsFile { out: folder.into(), file: file.into() }),
        _ => Ok(()),
    }
}

/// Finds out early whether a file can be there: it is no folder, and no folder above it is a file.
///
/// # Errors
/// [`Error::OutIsFolder`], [`Error::OutIsFile`].
pub fn check_file(file: &Path) -> Result<(), Error> {
    if file.is_dir() || file.file_name().is_none() {
        return Err(Error::OutIsFolder { out: file.into() });
    }
    file.parent().map_or(Ok(()), check_folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_in_the_way_is_found_early() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        assert!(check_folder(&file).is_err());
        assert!(check_folder(&file.join("below")).is_err());
        assert!(check_folder(&folder.path().join("new/newer")).is_ok());
        assert!(check_folder(Path::new("relative-and-new")).is_ok());
        assert!(check_file(&file).is_ok());
        assert!(check_file(&file.join("below")).is_err());
        assert!(check_file(folder.path()).is_err());
        assert!(check_file(Path::new("relative-and-new")).is_ok());
    }
}
