//! What can be wrong with a map.

use std::path::{Path, PathBuf};

/// What is wrong with a map, where, and how to mend it.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}, line {line}, key `{key}`: {what}", path.display())]
pub struct MapError {
    /// The map.
    pub path: PathBuf,
    /// Line in the file, counted from 1.
    pub line: usize,
    /// The key.
    pub key: String,
    /// What is wrong with it, and the mend.
    pub what: String,
}

impl MapError {
    /// At a byte of the text.
    pub(crate) fn new(
        path: &Path,
        text: &str,
        at: usize,
        key: impl Into<String>,
        what: impl Into<String>,
    ) -> Self {
        let before = text.as_bytes().get(..at).unwrap_or_default();
        let line = 1 + before.iter().filter(|&&byte| byte == b'\n').count();
        MapError { path: path.into(), line, key: key.into(), what: what.into() }
    }
}
