//! Where the workspace is, where it is built, and the cargo that runs this task.

use anyhow::Context;
use std::path::PathBuf;
use std::process::Command;

/// The folder of the workspace.
///
/// # Errors
/// The task was not started by `cargo xtask`.
pub fn workspace_root() -> anyhow::Result<PathBuf> {
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR").context("start this task with `cargo xtask`")?;
    PathBuf::from(manifest).parent().map(PathBuf::from).context("xtask is not in a workspace")
}

/// The folder that cargo builds in, which is never under version control.
///
/// # Errors
/// As [`workspace_root`].
pub fn target_directory() -> anyhow::Result<PathBuf> {
    let chosen = std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    Ok(workspace_root()?.join(chosen))
}

/// The cargo that started this task, to be run in the folder of the workspace.
///
/// # Errors
/// As [`workspace_root`].
pub fn cargo() -> anyhow::Result<Command> {
    let mut command = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    command.current_dir(workspace_root()?);
    Ok(command)
}
