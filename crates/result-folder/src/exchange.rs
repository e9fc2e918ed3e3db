//! A folder of results: a new one is written beside it and exchanged for it.

use crate::error::unwritable;
use crate::file_system::{remove_leftovers, unique};
use crate::generation::replace_files;
use crate::{FileSystem, Lock, ResultError, ResultFile};
use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::Path;

/// Replaces the results in the folder that is locked by `files`, all at once; other files in it stay.
///
/// # Errors
/// [`ResultError::Unwritable`]; then the folder is as it was.
pub fn replace_folder(system: &dyn FileSystem, lock: &Lock, files: &[ResultFile]) -> Result<(), ResultError> {
    let folder = lock.target();
    let parent = folder.parent().unwrap_or(folder);
    let name = folder.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let prefix = format!(".{name}.phiw-new-");
    if parent.is_dir() {
        remove_leftovers(system, parent, &prefix);
    }
    let others = match folder.is_dir() {
        false => Some(Vec::new()),
        true => other_files(folder, files).map_err(unwritable(folder))?,
    };
    if let Some(others) = others {
        let exists = folder.is_dir();
        if !exists {
            system.create_folders(parent).map_err(unwritable(parent))?;
        }
        let staged = parent.join(format!("{prefix}{}", unique()));
        match stage(system, folder, &staged, files, &others) {
            Ok(()) => {}
            // The parent may be closed to us although the folder is not.
            Err(ResultError::Unwritable { source, .. }) if exists && refused(&source) => {
                let _ = system.remove(&staged);
                return replace_files(system, folder, &name, files);
            }
            Err(error) => {
                let _ = system.remove(&staged);
                return Err(error);
            }
        }
        let committed = match exists {
            true => system.exchange(&staged, folder),
            false => system.rename(&staged, folder),
        };
        match committed {
            Ok(()) => {
                // Done: what fails from here on leaves a hidden folder, which the next run removes.
                let _ = system.sync_folder(parent);
                if exists {
                    let _ = system.remove(&staged);
                }
                return Ok(());
            }
            Err(_) if exists => {
                let _ = system.remove(&staged);
            }
            Err(source) => {
                let _ = system.remove(&staged);
                return Err(unwritable(folder)(source));
            }
        }
    }
    replace_files(system, folder, &name, files)
}

/// Whether the system says that it is not allowed.
fn refused(source: &io::Error) -> bool {
    matches!(source.kind(), io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem)
}

fn stage(
    system: &dyn FileSystem,
    folder: &Path,
    staged: &Path,
    files: &[ResultFile],
    others: &[OsString],
) -> Result<(), ResultError> {
    system.create_folder(staged).map_err(unwritable(staged))?;
    for file in files {
        let path = staged.join(&file.name);
        system.create_file(&path, &file.content).map_err(unwritable(&folder.join(&file.name)))?;
    }
    for name in others {
        system.hard_link(&folder.join(name), &staged.join(name)).map_err(unwritable(&folder.join(name)))?;
    }
    if let Ok(metadata) = folder.metadata() {
        let _ = fs::set_permissions(staged, metadata.permissions());
    }
    system.sync_folder(staged).map_err(unwritable(staged))
}

/// The files in the folder that are no results of these names; none if the folder cannot be exchanged: it
/// holds something else than files, or somebody works in it.
fn other_files(folder: &Path, files: &[ResultFile]) -> io::Result<Option<Vec<OsString>>> {
    let working = std::env::current_dir().and_then(|path| path.canonicalize());
    if working.is_ok_and(|working| working.starts_with(folder)) {
        return Ok(None);
    }
    let mut others = Vec::new();
    for entry in folder.read_dir()? {
        let entry = entry?;
        if !entry.file_type()?.is_file() {
            return Ok(None);
        }
        let name = entry.file_name();
        if !files.iter().any(|file| name == file.name.as_str()) {
            others.push(name);
        }
    }
    Ok(Some(others))
}
