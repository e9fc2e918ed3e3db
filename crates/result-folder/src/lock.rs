//! One writer at a time, and who it is.

use crate::ResultError;
use crate::error::unwritable;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The right to write to one place, until it is dropped. The system takes it from a program that is killed.
#[derive(Debug)]
pub struct Lock {
    target: PathBuf,
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// Takes the lock of a folder or file of results, for `command` (a few words for whoever is refused).
    ///
    /// The lock is a hidden file beside the target, or, where nothing is there yet, in the nearest folder
    /// above.
    ///
    /// # Errors
    /// [`ResultError::Busy`] if another run holds it, [`ResultError::Unwritable`].
    pub fn acquire(target: &Path, command: &str) -> Result<Self, ResultError> {
        let target = resolved(target);
        let mut path = lock_path(&target);
        loop {
            let open = |path: &Path| {
                OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
            };
            let mut file = match open(&path) {
                Ok(file) => file,
                // The folder may be open to us although the one above it is not.
                Err(_) if target.is_dir() => {
                    path = target.join(".phiw-lock");
                    open(&path).map_err(unwritable(&target))?
                }
                Err(source) => return Err(unwritable(&target)(source)),
            };
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => {
                    let holder = holder(&file);
                    return Err(ResultError::Busy { target, holder });
                }
                Err(TryLockError::Error(source)) => return Err(unwritable(&path)(source)),
            }
            // Whoever held it before may have removed the file between opening and locking.
            if !is_at(&file, &path) {
                continue;
            }
            let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
            let text = format!("pid {}, `{command}`, since {}\n", std::process::id(), clock_time(seconds));
            let written = file.set_len(0).and_then(|()| file.write_all(text.as_bytes()));
            written.map_err(unwritable(&path))?;
            return Ok(Lock { target, path, _file: file });
        }
    }

    /// The folder or file that is locked; symbolic links are followed.
    pub fn target(&self) -> &Path {
        &self.target
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // Removed while it is still held: nobody can have locked this file in the meantime.
        let _ = std::fs::remove_file(&self.path);
    }
}

/// What the holder of a lock says of itself. It writes that right after it has taken the lock: whoever comes
/// in between waits a moment.
fn holder(mut file: &File) -> String {
    for _ in 0..READS {
        let mut text = String::new();
        let read = file.rewind().and_then(|()| file.take(512).read_to_string(&mut text));
        if read.is_ok() && text.ends_with('\n') {
            return text.trim_end().to_owned();
        }
        std::thread::sleep(BETWEEN_READS);
    }
    "it has not said what it is".to_owned()
}

/// How often, and how far apart, the holder's words are looked for.
const READS: usize = 200;
const BETWEEN_READS: Duration = Duration::from_millis(1);

/// The target with the symbolic links of the folders that exist followed; a file's own name may be a link to
/// its generation, and stays.
fn resolved(target: &Path) -> PathBuf {
    let absolute = std::path::absolute(target).unwrap_or_else(|_| target.to_owned());
    for ancestor in absolute.ancestors().filter(|path| path.is_dir()) {
        if let Ok(real) = ancestor.canonicalize() {
            return absolute.strip_prefix(ancestor).map_or_else(
                |_| absolute.clone(),
                |rest| if rest.as_os_str().is_empty() { real.clone() } else { real.join(rest) },
            );
        }
    }
    absolute
}

/// A hidden file in the nearest folder above the target, named after the way from there.
fn lock_path(target: &Path) -> PathBuf {
    let above = target.ancestors().skip(1).find(|path| path.is_dir()).unwrap_or(Path::new("/"));
    let rest = target.strip_prefix(above).unwrap_or(target);
    let parts: Vec<_> = rest.components().map(|part| part.as_os_str().to_string_lossy()).collect();
    above.join(format!(".{}.phiw-lock", parts.join("%")))
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let of = |metadata: std::fs::Metadata| (metadata.dev(), metadata.ino());
    match (file.metadata(), path.metadata()) {
        (Ok(file), Ok(path)) => of(file) == of(path),
        _ => false,
    }
}

#[cfg(not(unix))]
fn is_at(_: &File, path: &Path) -> bool {
    path.exists()
}

/// Hours, minutes, seconds of the day, UTC.
fn clock_time(seconds: u64) -> String {
    let of_day = seconds % 86_400;
    format!("{:02}:{:02}:{:02} UTC", of_day / 3600, of_day / 60 % 60, of_day % 60)
}
