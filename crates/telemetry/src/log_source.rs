//! Where a log is, and how it is read.

use crate::NamedColumns;
use crate::map::{LogFacts, LogMap, LogPart};
use phiw_log_formats::DecodedOnce;
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
    /// Stretches in which something else acted on the robot, first and last stamp each \[s\]: they are left
    /// out.
    pub disturbed: Vec<[f64; 2]>,
    /// What the map calls it, where that is not the name it has now.
    pub name_in_map: Option<PathBuf>,
    /// The numbers of a long file, once it has been read.
    pub decoded: DecodedOnce,
}

impl LogSource {
    /// The place of a survey that is read back, until it is given one.
    pub(crate) fn nowhere() -> Self {
        LogSource::mapped(PathBuf::new(), None)
    }

    /// A log whose columns a map explains.
    pub fn mapped(path: impl Into<PathBuf>, map: Option<Arc<LogMap>>) -> Self {
        LogSource {
            path: path.into(),
            map,
            part: LogPart::All,
            columns: None,
            disturbed: Vec::new(),
            name_in_map: None,
            decoded: DecodedOnce::default(),
        }
    }

    /// The same log at another place, of which the map says what it says of this one.
    pub fn moved_to(self, path: &Path) -> Self {
        let name_in_map = Some(self.name_in_map.unwrap_or(self.path));
        LogSource { path: path.to_owned(), name_in_map, decoded: DecodedOnce::default(), ..self }
    }

    /// What the map says of it; nothing without a map.
    pub fn facts(&self) -> LogFacts {
        let name = self.name_in_map.as_ref().unwrap_or(&self.path);
        self.map.as_ref().map(|map| map.facts(name)).unwrap_or_default()
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
