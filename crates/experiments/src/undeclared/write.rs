//! A case as files: what the tracer may see in one folder, what is true beside it.

use super::case::Case;
use super::truth::Truth;
use anyhow::Context;
use std::fs;
use std::path::Path;

/// Writes `FOLDER/<seed>/` (`robot.urdf` and the logs) and `FOLDER/<seed>.truth.json`.
///
/// # Errors
/// The folder or a file cannot be written.
pub fn write_case(case: &Case, folder: &Path) -> anyhow::Result<()> {
    write_visible(case, &folder.join(case.spec.seed.to_string()))?;
    write_truth(&Truth::of(case), folder)
}

/// Writes `FOLDER/<seed>.truth.json`.
///
/// # Errors
/// As [`write_case`].
pub fn write_truth(truth: &Truth, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let path = folder.join(format!("{}.truth.json", truth.seed));
    let text = serde_json::to_string_pretty(truth)? + "\n";
    fs::write(&path, text).with_context(|| path.display().to_string())
}

/// Writes what the tracer may see.
///
/// # Errors
/// As [`write_case`].
pub fn write_visible(case: &Case, folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let urdf = folder.join("robot.urdf");
    fs::write(&urdf, case.robot.urdf).with_context(|| urdf.display().to_string())?;
    for (name, text) in case.logs() {
        let path = folder.join(format!("{name}.csv"));
        fs::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}
