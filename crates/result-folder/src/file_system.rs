//! The few operations that results need of a file system, so that tests can make each of them fail.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// The operations that change a file system. The methods given are the real ones; a test overrides
/// [`FileSystem::before`].
pub trait FileSystem {
    /// Called before every operation; an error takes the operation's place.
    ///
    /// # Errors
    /// What a test wants to happen.
    fn before(&self, operation: &'static str, path: &Path) -> io::Result<()> {
        let _ = (operation, path);
        Ok(())
    }

    /// Writes a file that must not be there yet, down to the disk.
    ///
    /// # Errors
    /// What the system says.
    fn create_file(&self, path: &Path, content: &[u8]) -> io::Result<()> {
        self.before("create", path)?;
        let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
        self.before("write", path)?;
        file.write_all(content)?;
        self.before("sync", path)?;
        file.sync_all()
    }

    /// Opens a file that must not be there yet, to write it piece by piece. [`sync_file`](Self::sync_file)
    /// brings it down to the disk.
    ///
    /// # Errors
    /// What the system says.
    fn open_file(&self, path: &Path) -> io::Result<File> {
        self.before("create", path)?;
        OpenOptions::new().write(true).create_new(true).open(path)
    }

    /// Brings a file down to the disk.
    ///
    /// # Errors
    /// What the system says.
    fn sync_file(&self, file: &File, path: &Path) -> io::Result<()> {
        self.before("sync", path)?;
        file.sync_all()
    }

    /// Makes a folder that must not be there yet.
    ///
    /// # Errors
    /// What the system says.
    fn create_folder(&self, path: &Path) -> io::Result<()> {
        self.before("create folder", path)?;
        fs::create_dir(path)
    }

    /// Makes a folder and those above it, where they are absent.
    ///
    /// # Errors
    /// What the system says.
    fn create_folders(&self, path: &Path) -> io::Result<()> {
        self.before("create folders", path)?;
        fs::create_dir_all(path)
    }

    /// Gives a file or folder another name; what has that name is replaced.
    ///
    /// # Errors
    /// What the system says.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.before("rename", to)?;
        fs::rename(from, to)
    }

    /// Exchanges two folders in one step.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::Unsupported`] where it can't.
    fn exchange(&self, one: &Path, other: &Path) -> io::Result<()> {
        self.before("exchange", other)?;
        #[cfg(target_os = "linux")]
        {
            use rustix::fs::{CWD, RenameFlags, renameat_with};
            renameat_with(CWD, one, CWD, other, RenameFlags::EXCHANGE).map_err(io::Error::from)
        }
        #[cfg(not(target_os = "linux"))]
        {
            let _ = one;
            Err(io::ErrorKind::Unsupported.into())
        }
    }

    /// A second name for a file.
    ///
    /// # Errors
    /// What the system says.
    fn hard_link(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.before("hard link", to)?;
        fs::hard_link(from, to)
    }

    /// A symbolic link at `path` that says `target`.
    ///
    /// # Errors
    /// What the system says; [`io::ErrorKind::Unsupported`] where there are none.
    fn symbolic_link(&self, target: &Path, path: &Path) -> io::Result<()> {
        self.before("symbolic link", path)?;
        #[cfg(unix)]
        return std::os::unix::fs::symlink(target, path);
        #[cfg(not(unix))]
        {
            let _ = target;
            Err(io::ErrorKind::Unsupported.into())
        }
    }

    /// Removes a file, or a folder with all that is in it.
    ///
    /// # Errors
    /// What the system says.
    fn remove(&self, path: &Path) -> io::Result<()> {
        self.before("remove", path)?;
        if path.symlink_metadata()?.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) }
    }

    /// Brings a folder's entries down to the disk. Some file systems can't: that is no failure.
    ///
    /// # Errors
    /// Those of [`FileSystem::before`].
    fn sync_folder(&self, path: &Path) -> io::Result<()> {
        self.before("sync folder", path)?;
        if let Ok(folder) = File::open(path) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

/// The real file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disk;

impl FileSystem for Disk {}

/// Part of a name that no other process or thread uses.
pub(crate) fn unique() -> String {
    static COUNT: AtomicU64 = AtomicU64::new(0);
    let nanoseconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_nanos());
    format!("{}-{}-{nanoseconds:x}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed))
}

/// Removes what killed runs have left; the lock says that none of them is under way.
pub(crate) fn remove_leftovers(system: &dyn FileSystem, folder: &Path, prefix: &str) {
    let entries = folder.read_dir().into_iter().flatten().flatten();
    let leftovers: Vec<PathBuf> = entries
        .filter(|entry| entry.file_name().to_string_lossy().starts_with(prefix))
        .map(|entry| entry.path())
        .collect();
    for path in leftovers {
        let _ = system.remove(&path);
    }
}
