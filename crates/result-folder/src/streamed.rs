//! A result file that is too long to be held in memory.

use crate::error::unwritable;
use crate::generation::{Aside, sync_folder_of};
use crate::{FileSystem, ResultError};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// A file that is written piece by piece under a hidden name, and takes its place once it is whole. Dropped
/// before that, it leaves nothing behind.
pub struct StreamedFile<'a> {
    system: &'a dyn FileSystem,
    target: PathBuf,
    out: BufWriter<File>,
    aside: Aside<'a>,
}

impl<'a> StreamedFile<'a> {
    /// Begins the file at `target`, in the folder that it is for; folders above it are made. The caller holds
    /// the lock of `target`.
    ///
    /// # Errors
    /// [`ResultError::Unwritable`].
    pub fn create(system: &'a dyn FileSystem, target: &Path) -> Result<Self, ResultError> {
        if let Some(folder) = target.parent().filter(|folder| !folder.as_os_str().is_empty()) {
            system.create_folders(folder).map_err(unwritable(folder))?;
        }
        let (aside, file) = Aside::open(system, target)?;
        Ok(StreamedFile { system, target: target.to_owned(), out: BufWriter::new(file), aside })
    }

    /// An error of writing a piece, with the file's name.
    pub fn unwritable(&self, source: io::Error) -> ResultError {
        unwritable(&self.target)(source)
    }

    /// Puts the file in its place, in one step.
    ///
    /// # Errors
    /// [`ResultError::Unwritable`]; then what was there is as it was.
    pub fn commit(self) -> Result<(), ResultError> {
        let StreamedFile { system, target, out, aside } = self;
        let file = out.into_inner().map_err(|error| unwritable(&target)(error.into_error()))?;
        system.sync_file(&file, aside.path()).map_err(unwritable(&target))?;
        drop(file);
        aside.rename(&target)?;
        sync_folder_of(system, &target);
        Ok(())
    }
}

impl Write for StreamedFile<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.out.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}
