//! Files in a folder that is not theirs alone: a generation in a hidden folder, and one link that is renamed.

use crate::error::unwritable;
use crate::file_system::{remove_leftovers, unique};
use crate::{FileSystem, ResultError, ResultFile};
use std::fs::File;
use std::path::{Path, PathBuf};

/// The link that leads to the generation that counts.
const CURRENT: &str = "current";

/// Replaces `files` in `folder` all at once. `set` names them together; the caller holds a lock for it.
///
/// The files lie in `.<set>.phiw/<generation>/`; the visible names are links through `.<set>.phiw/current`.
/// Where there are no symbolic links the files are renamed one by one.
///
/// # Errors
/// [`ResultError::Unwritable`]; then the files are as they were.
pub fn replace_files(
    system: &dyn FileSystem,
    folder: &Path,
    set: &str,
    files: &[ResultFile],
) -> Result<(), ResultError> {
    let store = folder.join(format!(".{set}.phiw"));
    system.create_folders(&store).map_err(unwritable(&store))?;
    let generations = Generations { system, folder, store, set };
    generations.remove_all_but_current();
    let outcome = generations.replace(files);
    if outcome.is_err() {
        generations.remove_all_but_current();
    }
    outcome
}

/// Replaces one file. Nobody else writes it at the same time.
///
/// # Errors
/// [`ResultError::Unwritable`]; then the file is as it was.
pub fn replace_file(system: &dyn FileSystem, path: &Path, content: &[u8]) -> Result<(), ResultError> {
    let aside = Aside::write(system, path, content)?;
    aside.rename(path)?;
    sync_folder_of(system, path);
    Ok(())
}

/// Replaces a file, and another that vouches for it: as long as the second is there, it belongs to the first.
/// The caller is the only one who writes them.
///
/// # Errors
/// [`ResultError::Unwritable`]; the second file may be gone then, if there was one.
pub fn replace_vouched(
    system: &dyn FileSystem,
    (path, content): (&Path, &[u8]),
    (voucher, facts): (&Path, &[u8]),
) -> Result<(), ResultError> {
    let new = Aside::write(system, path, content)?;
    let new_facts = Aside::write(system, voucher, facts)?;
    // What vouches for the old file must not vouch for the new one.
    if voucher.exists() {
        system.remove(voucher).map_err(unwritable(voucher))?;
    }
    new.rename(path)?;
    new_facts.rename(voucher)?;
    sync_folder_of(system, path);
    Ok(())
}

/// Removes the partial files that killed runs of [`replace_file`] and [`replace_vouched`] have left in a
/// folder; the caller holds its lock.
pub fn remove_partial_files(system: &dyn FileSystem, folder: &Path) {
    for entry in folder.read_dir().into_iter().flatten().flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') && name.ends_with(PARTIAL) {
            let _ = system.remove(&entry.path());
        }
    }
}

/// How names of partial files end.
const PARTIAL: &str = ".partial";

/// A file under a name of its own, until it takes its place.
pub(crate) struct Aside<'a> {
    system: &'a dyn FileSystem,
    path: PathBuf,
    renamed: bool,
}

impl<'a> Aside<'a> {
    /// Writes what is to become the file at `target`. What killed runs have left of it goes.
    fn write(system: &'a dyn FileSystem, target: &Path, content: &[u8]) -> Result<Self, ResultError> {
        let aside = Aside::named(system, target);
        system.create_file(&aside.path, content).map_err(unwritable(target))?;
        Ok(aside)
    }

    /// The same, opened to be written piece by piece.
    pub(crate) fn open(system: &'a dyn FileSystem, target: &Path) -> Result<(Self, File), ResultError> {
        let aside = Aside::named(system, target);
        let file = system.open_file(&aside.path).map_err(unwritable(target))?;
        Ok((aside, file))
    }

    /// A free name for what is to become the file at `target`.
    fn named(system: &'a dyn FileSystem, target: &Path) -> Self {
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let prefix = format!(".{name}.");
        let folder =
            target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        for entry in folder.read_dir().into_iter().flatten().flatten() {
            let other = entry.file_name().to_string_lossy().into_owned();
            if other.starts_with(&prefix) && other.ends_with(PARTIAL) {
                let _ = system.remove(&entry.path());
            }
        }
        let path = target.with_file_name(format!("{prefix}{}{PARTIAL}", unique()));
        Aside { system, path, renamed: false }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn rename(mut self, target: &Path) -> Result<(), ResultError> {
        self.system.rename(&self.path, target).map_err(unwritable(target))?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Aside<'_> {
    fn drop(&mut self) {
        if !self.renamed {
            let _ = self.system.remove(&self.path);
        }
    }
}

pub(crate) fn sync_folder_of(system: &dyn FileSystem, path: &Path) {
    if let Some(folder) = path.parent() {
        let _ = system.sync_folder(if folder.as_os_str().is_empty() { Path::new(".") } else { folder });
    }
}

struct Generations<'a> {
    system: &'a dyn FileSystem,
    folder: &'a Path,
    store: PathBuf,
    set: &'a str,
}

impl Generations<'_> {
    fn replace(&self, files: &[ResultFile]) -> Result<(), ResultError> {
        let new = self.generation()?;
        for file in files {
            let path = new.join(&file.name);
            let shown = self.folder.join(&file.name);
            self.system.create_file(&path, &file.content).map_err(unwritable(&shown))?;
        }
        self.system.sync_folder(&new).map_err(unwritable(&new))?;
        if !files.iter().all(|file| self.is_linked(&file.name))
            && let Err(error) = self.link(files)
        {
            return match error {
                ResultError::Unwritable { source, .. }
                    if source.kind() == std::io::ErrorKind::Unsupported =>
                {
                    files.iter().try_for_each(|file| {
                        replace_file(self.system, &self.folder.join(&file.name), &file.content)
                    })
                }
                error => Err(error),
            };
        }
        self.point_to(&new)?;
        let _ = self.system.sync_folder(&self.store);
        self.remove_all_but_current();
        Ok(())
    }

    /// Puts links in the place of the visible files, with what was there behind them.
    fn link(&self, files: &[ResultFile]) -> Result<(), ResultError> {
        let old = self.generation()?;
        for file in files {
            let shown = self.folder.join(&file.name);
            // What a link leads to is read through it: a link to somewhere else is replaced, not followed
            // when writing.
            if let Ok(content) = std::fs::read(&shown) {
                self.system.create_file(&old.join(&file.name), &content).map_err(unwritable(&shown))?;
            }
        }
        self.point_to(&old)?;
        for file in files {
            let shown = self.folder.join(&file.name);
            self.put_link(&self.target(&file.name), &shown)?;
        }
        self.system.sync_folder(self.folder).map_err(unwritable(self.folder))
    }

    fn generation(&self) -> Result<PathBuf, ResultError> {
        let path = self.store.join(unique());
        self.system.create_folder(&path).map_err(unwritable(&path))?;
        Ok(path)
    }

    /// What the link of a visible name says.
    fn target(&self, name: &str) -> PathBuf {
        Path::new(&format!(".{}.phiw", self.set)).join(CURRENT).join(name)
    }

    fn is_linked(&self, name: &str) -> bool {
        self.folder.join(name).read_link().is_ok_and(|link| link == self.target(name))
    }

    /// The commit point: one rename.
    fn point_to(&self, generation: &Path) -> Result<(), ResultError> {
        let name = PathBuf::from(generation.file_name().unwrap_or_default());
        self.put_link(&name, &self.store.join(CURRENT))
    }

    /// A link under another name first, then renamed.
    fn put_link(&self, target: &Path, path: &Path) -> Result<(), ResultError> {
        let aside = self.store.join(format!("link-{}", unique()));
        let made = self.system.symbolic_link(target, &aside).and_then(|()| self.system.rename(&aside, path));
        if made.is_err() {
            let _ = self.system.remove(&aside);
        }
        made.map_err(unwritable(path))
    }

    fn remove_all_but_current(&self) {
        let kept = self.store.join(CURRENT).read_link().ok();
        let entries = self.store.read_dir().into_iter().flatten().flatten();
        for entry in entries {
            let name = PathBuf::from(entry.file_name());
            if name.as_os_str() != CURRENT && Some(&name) != kept.as_ref() {
                let _ = self.system.remove(&entry.path());
            }
        }
        remove_leftovers(self.system, self.folder, &format!(".{}.phiw-new-", self.set));
    }
}
