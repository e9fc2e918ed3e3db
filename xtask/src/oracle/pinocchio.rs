//! Pinocchio in a private Python environment, asked through files.

use super::answers::{QUANTITIES, States};
use super::case::Case;
use crate::environment;
use anyhow::{Context, ensure};
use phiw_dynamics::Tree;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The packages, pinned.
const REQUIREMENTS: &str = include_str!("requirements.txt");
/// Pinocchio's side of the comparison.
const SCRIPT: &str = include_str!("pinocchio_oracle.py");

/// Pinocchio, installed.
pub struct Oracle {
    python: PathBuf,
    version: String,
}

/// What the script is told beside the states.
#[derive(Serialize)]
struct Request<'a> {
    urdf: &'a Path,
    floating_base: bool,
    held: &'a [(String, f64)],
    /// Joints that move by themselves, in the order of their coordinates.
    joints: Vec<&'a str>,
    /// The joint of each body, in the order of the bodies.
    bodies: Vec<&'a str>,
    states: usize,
}

impl Oracle {
    /// Makes the environment in the build folder, or completes the one that is there.
    ///
    /// # Errors
    /// There is no Python, or pip cannot install.
    pub fn install(python: &str) -> anyhow::Result<Self> {
        let environment = environment::target_directory()?.join("oracle-python");
        let own = environment.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
        if !own.exists() {
            eprintln!("making a Python environment in {}", environment.display());
            run(Command::new(python).args(["-m", "venv"]).arg(&environment))
                .context("a Python with `venv` is needed: install one, or name it with --python")?;
        }
        let requirements = environment.join("requirements.txt");
        std::fs::write(&requirements, REQUIREMENTS)?;
        let pip = ["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary=:all:"];
        run(Command::new(&own).args(pip).arg("--requirement").arg(&requirements)).with_context(|| {
            format!("pip cannot install {} (its wheels need a recent CPython)", REQUIREMENTS.trim())
        })?;
        let version = run(isolated(&own).args(["-c", "import pinocchio; print(pinocchio.__version__)"]))?;
        Ok(Oracle { python: own, version: version.trim().to_owned() })
    }

    /// Pinocchio's version.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Pinocchio's answers, one for each of [`QUANTITIES`]; `None` for the accelerations of a singular mass matrix.
    ///
    /// # Errors
    /// The script fails, or a file cannot be written or read.
    pub fn answers(
        &self,
        case: &Case,
        tree: &Tree,
        states: &States,
    ) -> anyhow::Result<Vec<Option<Vec<f64>>>> {
        let folder = tempfile::tempdir()?;
        let folder = folder.path();
        let request = Request {
            urdf: &case.urdf,
            floating_base: case.options.floating_base,
            held: &case.options.held,
            joints: tree.joint_names().collect(),
            bodies: tree.bodies().iter().map(|body| body.joint.as_str()).collect(),
            states: states.count,
        };
        std::fs::write(folder.join("case.json"), serde_json::to_string(&request)?)?;
        for (name, values) in [("q", &states.q), ("v", &states.v), ("a", &states.a), ("force", &states.force)]
        {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            std::fs::write(folder.join(name), bytes)?;
        }
        let script = folder.join("pinocchio_oracle.py");
        std::fs::write(&script, SCRIPT)?;
        run(isolated(&self.python).arg(&script).arg(folder))
            .with_context(|| format!("Pinocchio fails on {} ({} base)", case.robot, case.base()))?;
        let answer = |name: &str| {
            let values = read_numbers(&folder.join(format!("{name}.pinocchio")))?;
            Ok((!(name == "aba" && values.is_empty())).then_some(values))
        };
        QUANTITIES.into_iter().map(answer).collect()
    }
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

fn read_numbers(file: &Path) -> anyhow::Result<Vec<f64>> {
    let bytes = std::fs::read(file).with_context(|| format!("{} is absent", file.display()))?;
    Ok(bytes.as_chunks::<8>().0.iter().map(|&bytes| f64::from_le_bytes(bytes)).collect())
}
