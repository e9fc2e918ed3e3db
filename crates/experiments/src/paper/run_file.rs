//! One file for each run: where it is, and how it is written so that it is whole at any moment.

use super::arm::{Arm, Footing};
use super::detection::Detection;
use super::jobs::Job;
use super::score::{Detail, Score};
use crate::plant::secret::SecretKind;
use anyhow::Context;
use phiw_curriculum::CurriculumRun;
use phiw_result_folder::{Disk, replace_file};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A run under way or done, and what is known of it.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunFile {
    /// How motions were chosen.
    pub arm: Arm,
    /// How the base was held.
    pub footing: Footing,
    /// What was in the plant that nobody declared.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub secret: Option<SecretKind>,
    /// The joints that it is on.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub secret_joints: Vec<String>,
    /// All that is needed to go on.
    pub run: CurriculumRun,
    /// Scores of the initial model, then after each iteration.
    pub scores: Vec<Score>,
    /// More, of the run that stands for all.
    pub details: Vec<Detail>,
    /// What all its logs say beside the declared model, where the loop is closed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detection: Option<Detection>,
}

impl RunFile {
    /// Where a run is in a folder.
    pub fn path(out: &Path, job: &Job) -> PathBuf {
        let secret = job.secret.map_or_else(String::new, |secret| format!("-{}", secret.name()));
        let folder = format!("{}-{}{secret}", job.footing.name(), job.arm.name());
        out.join("runs").join(folder).join(format!("{:06}.json", job.seed))
    }

    /// The run in a file; none if there is none.
    ///
    /// # Errors
    /// The file is not a run.
    pub fn read(path: &Path) -> anyhow::Result<Option<Self>> {
        match std::fs::read(path) {
            Ok(text) => serde_json::from_slice(&text).map(Some).with_context(|| path.display().to_string()),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error).with_context(|| path.display().to_string()),
        }
    }

    /// Writes the run. JSON, since its numbers come back to the last bit (the shortest digits that do), every
    /// tool reads it, and what is large in it goes when the run is done.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn write(&self, path: &Path) -> anyhow::Result<()> {
        replace(path, &serde_json::to_vec(self)?)
    }
}

/// All run files of a folder, in order.
///
/// # Errors
/// The folder can not be read.
pub fn all(out: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    let runs = out.join("runs");
    if !runs.is_dir() {
        return Ok(files);
    }
    for arm in runs.read_dir()? {
        for file in arm?.path().read_dir()? {
            let path = file?.path();
            if path.extension().is_some_and(|extension| extension == "json") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// Writes a file under another name and renames it: whoever finds it finds all of it, whenever this program
/// is killed.
///
/// # Errors
/// The file can not be written.
pub fn replace(path: &Path, content: &[u8]) -> anyhow::Result<()> {
    let folder = path.parent().context("a path without a folder")?;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    Ok(replace_file(&Disk, path, content)?)
}
