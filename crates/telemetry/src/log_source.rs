//! Where a log is, and how it is read.

use crate::NamedColumns;
use crate::map::{LogMap, LogPart};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a log is, and how it is read.
#[derive(Debug, Clone)]
pub struct LogSource {
    /// The file or folder; of a log in memory its name.
    pub path: PathBuf,
    /// What its columns mean, where their names do not say it.
    pub map: Option<Arc<LogMap>>,
    /// Which of the map's stretches are read.
    pub part: LogPart,
    /// What is read instead of the file, of a log in memory.
    pub columns: Option<Arc<NamedColumns>>,
}

impl LogSource {
    /// The place of a survey that is read back, until it is given one.
    pub(crate) fn nowhere() -> Self {
        LogSource::mapped(PathBuf::new(), None)
    }

    /// A log whose columns a map explains.
    pub fn mapped(path: impl Into<PathBuf>, map: Option<Arc<LogMap>>) -> Self {
        LogSource { path: path.into(), map, part: LogPart::All, columns: None }
    }
}

impl From<PathBuf> for LogSource {
    fn from(path: PathBuf) -> Self {
        LogSource::mapped(path, None)
    }
}

impl From<&Path> for LogSource {
    fn from(path: &Path) -> Self {
        LogSource::mapped(path, None)
    }
}

impl From<&PathBuf> for LogSource {
    fn from(path: &PathBuf) -> Self {
        LogSource::mapped(path, None)
    }
}

impl From<&LogSource> for LogSource {
    fn from(source: &LogSource) -> Self {
        source.clone()
    }
}
