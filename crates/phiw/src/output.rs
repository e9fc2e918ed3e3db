//! The result folder: all files or none.

use crate::Error;
use std::io;
use std::path::{Path, PathBuf};

/// A file of the result folder.
pub struct OutputFile {
    /// Its name.
    pub name: String,
    /// Its content.
    pub text: String,
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

/// Writes the files under other names, then renames them: whoever looks sees the old file or the new one, whole.
///
/// # Errors
/// [`Error::Unwritable`]; then nothing of these files is left behind, though some may have been replaced if renaming failed.
pub fn write_folder(folder: &Path, files: &[OutputFile]) -> Result<(), Error> {
    let unwritable = |path: &Path| {
        let path = path.to_owned();
        move |source: io::Error| Error::Unwritable { path, source }
    };
    std::fs::create_dir_all(folder).map_err(unwritable(folder))?;
    let mut partial = Partial::default();
    for file in files {
        let path = folder.join(format!(".{}.partial", file.name));
        partial.0.push(path.clone());
        std::fs::write(&path, &file.text).map_err(unwritable(&path))?;
    }
    for (path, file) in partial.0.iter().zip(files) {
        let target = folder.join(&file.name);
        std::fs::rename(path, &target).map_err(unwritable(&target))?;
    }
    partial.0.clear();
    Ok(())
}

/// Files that are removed unless all goes well.
#[derive(Default)]
struct Partial(Vec<PathBuf>);

impl Drop for Partial {
    fn drop(&mut self) {
        for path in &self.0 {
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<String> = folder
            .read_dir()
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn a_failure_leaves_nothing_behind() {
        let folder = tempfile::tempdir().unwrap();
        // A folder where the second file should go: it cannot be replaced by a file.
        std::fs::create_dir_all(folder.path().join("b/full")).unwrap();
        let file = |name: &str| OutputFile { name: name.to_owned(), text: "new".into() };
        assert!(write_folder(folder.path(), &[file("b"), file("c")]).is_err());
        assert_eq!(names(folder.path()), ["b"]);
        write_folder(folder.path(), &[file("a"), file("c")]).unwrap();
        assert_eq!(names(folder.path()), ["a", "b", "c"]);
    }

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
