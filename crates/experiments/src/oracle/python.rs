//! Python packages in a private environment, asked through files.

use crate::environment;
use anyhow::{Context, ensure};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;

/// A Python with the packages installed.
pub struct Python {
    program: PathBuf,
}

impl Python {
    /// Makes an environment of this name in the build folder, or completes the one that is there, with the
    /// packages that `pinned` lists as pip does.
    ///
    /// # Errors
    /// There is no Python, or pip cannot install.
    pub fn install(python: &str, name: &str, pinned: &str) -> anyhow::Result<Self> {
        let environment = environment::target_directory()?.join(name);
        let program = environment.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
        if !program.exists() {
            eprintln!("making a Python environment in {}", environment.display());
            run(Command::new(python).args(["-m", "venv"]).arg(&environment))
                .context("a Python with `venv` is needed: install one, or name it with --python")?;
        }
        let requirements = environment.join("requirements.txt");
        std::fs::write(&requirements, pinned)?;
        let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary=:all:"];
        run(Command::new(&program).args(pip).arg("--requirement").arg(&requirements)).with_context(|| {
            let packages = pinned.split_whitespace().collect::<Vec<_>>().join(", ");
            format!("pip cannot install {packages} (their wheels need a recent CPython)")
        })?;
        Ok(Python { program })
    }

    /// Version of an installed package.
    ///
    /// # Errors
    /// It is not there.
    pub fn version(&self, package: &str) -> anyhow::Result<String> {
        let ask = "import importlib.metadata, sys; print(importlib.metadata.version(sys.argv[1]))";
        Ok(run(isolated(&self.program).args(["-c", ask, package]))?.trim().to_owned())
    }

    /// Runs a script with arguments and gives what it prints.
    ///
    /// # Errors
    /// It fails.
    pub fn run(
        &self,
        script: &str,
        arguments: impl IntoIterator<Item = impl AsRef<OsStr>>,
    ) -> anyhow::Result<String> {
        let folder = tempfile::tempdir()?;
        let file = folder.path().join("oracle.py");
        std::fs::write(&file, script)?;
        run(isolated(&self.program).arg(&file).args(arguments))
    }
}

/// Doubles of a file, as the scripts write them.
///
/// # Errors
/// The file is absent.
pub fn read_numbers(file: &Path) -> anyhow::Result<Vec<f64>> {
    let bytes = std::fs::read(file).with_context(|| format!("{} is absent", file.display()))?;
    Ok(bytes.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect())
}

/// Python without the user's own packages and variables.
fn isolated(python: &Path) -> Command {
    let mut command = Command::new(python);
    command.arg("-I");
    command
}

/// Runs a program and gives what it prints; its errors go to the terminal.
fn run(command: &mut Command) -> anyhow::Result<String> {
    let program = command.get_program().to_string_lossy().into_owned();
    let output = command
        .stderr(std::process::Stdio::inherit())
        .output()
        .with_context(|| format!("{program} cannot be started"))?;
    ensure!(output.status.success(), "{program} has failed ({})", output.status);
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}
