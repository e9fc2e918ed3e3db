//! Inputs that a caller of the library has in memory instead of in files. The command has none.

use crate::Error;
use crate::input::read_text;
use phiw_identification::Interruption;
use phiw_telemetry::NamedColumns;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What stands in memory for files. The names that the arguments have for them are what messages say.
#[derive(Clone, Debug, Default)]
pub struct InMemory {
    /// The URDF's text.
    pub urdf: Option<String>,
    /// The text of the `model.json`.
    pub model: Option<String>,
    /// Logs, by name.
    pub logs: BTreeMap<PathBuf, Arc<NamedColumns>>,
    /// Stretches of training logs in which something else acted on the robot, first and last stamp each
    /// \[s\], by the log's name: they are left out.
    pub disturbed: BTreeMap<PathBuf, Vec<[f64; 2]>>,
    /// What calls the work off.
    pub interruption: Interruption,
}

/// The text that is given, or that of the file `path`.
///
/// # Errors
/// As [`read_text`].
pub(crate) fn text_of(given: Option<&String>, path: &Path, most: u64) -> Result<String, Error> {
    given.map_or_else(|| read_text(path, most), |text| Ok(text.clone()))
}
