//! Where the workspace is, where it is built, and the cargo that runs this task.

use anyhow::{Context, ensure};
use std::path::PathBuf;
use std::process::{Command, Stdio};

/// The folder of the workspace: the nearest one at or above the package that cargo runs which holds a
/// `Cargo.lock`.
///
/// # Errors
/// The task was not started by `cargo xtask`.
pub fn workspace_root() -> anyhow::Result<PathBuf> {
    let manifest = std::env::var_os("CARGO_MANIFEST_DIR").context("start this task with `cargo xtask`")?;
    let manifest = PathBuf::from(manifest);
    let root = manifest.ancestors().find(|folder| folder.join("Cargo.lock").is_file());
    root.map(PathBuf::from).with_context(|| {
        format!("{} is in no workspace: no folder above has a Cargo.lock", manifest.display())
    })
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

/// Builds the command `phiw` with the release profile, and gives its path.
///
/// # Errors
/// As [`workspace_root`], or it does not build.
pub fn release_binary() -> anyhow::Result<PathBuf> {
    let build = cargo()?
        .args(["build", "--release", "--package", "phiw", "--message-format", "json-render-diagnostics"])
        .stderr(Stdio::inherit())
        .output()
        .context("cargo")?;
    ensure!(build.status.success(), "phiw does not build");
    let messages = String::from_utf8_lossy(&build.stdout);
    let executable = messages.lines().rev().find_map(|line| {
        let message: serde_json::Value = serde_json::from_str(line).ok()?;
        message.get("executable")?.as_str().map(PathBuf::from)
    });
    executable.context("cargo built phiw but named no executable")
}

#[cfg(test)]
mod tests {
    use super::workspace_root;

    /// It was the folder above the package's, which is right for `xtask` only.
    #[test]
    fn the_workspace_is_found_from_a_package_two_folders_down() -> anyhow::Result<()> {
        assert!(workspace_root()?.join("models/upper_body18.urdf").is_file());
        Ok(())
    }
}
