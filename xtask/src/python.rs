//! `cargo xtask python`: the Python package of `crates/python` as a user meets it, in an environment of its
//! own.

use crate::test::tally::Tally;
use anyhow::{Context, ensure};
use phiw_experiments::environment;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};

/// Command line of `cargo xtask python`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The Python that the environment is made with.
    #[arg(long, default_value = PYTHON)]
    python: String,
    /// The profile that the package is built with.
    #[arg(long, default_value = "release")]
    profile: String,
    /// Also compare with Pinocchio's Python and FIGAROH, installed from PyPI: agreement and times.
    #[arg(long)]
    timings: bool,
}

const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// Where the package is.
const PACKAGE: &str = "crates/python";
/// What builds it, and what it is tested with; fetched from PyPI.
const REQUIREMENTS: [&str; 8] =
    ["maturin>=1.9.4,<2", "numpy", "pandas", "pytest", "nbclient", "nbformat", "ipykernel", "matplotlib"];
/// What it is compared with.
const OTHERS: [&str; 2] = ["pin==4.1.0", "figaroh==1.0.2"];

/// Makes a fresh environment, installs the package into it, and runs its tests and notebooks.
///
/// # Errors
/// There is no Python, no network, or the package does not build.
pub fn command(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let environment = Environment::fresh(&arguments.python)?;
    environment.fetch(&REQUIREMENTS)?;
    environment.install_package(&arguments.profile)?;
    if arguments.timings {
        environment.fetch(&OTHERS)?;
    }
    let mut tally = Tally::default();
    let passed = environment.pytest(&mut tally)?;
    if arguments.timings {
        let script = environment.root.join(PACKAGE).join("benches/timings.py");
        run(environment.python().arg(script))?;
    }
    println!("{tally}");
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The package's tests as a part of all tests, built with the profile of this program so that what is
/// compiled is shared. Where there is no Python with `venv`, or no package index, they are skipped. What is
/// returned are problems: one line each.
///
/// # Errors
/// A program that was found cannot be run.
pub fn test(tally: &mut Tally) -> anyhow::Result<Vec<String>> {
    println!("\n=== pytest of {PACKAGE}");
    let fetched = Environment::kept(PYTHON).and_then(|environment| {
        environment.fetch(&REQUIREMENTS)?;
        Ok(environment)
    });
    let environment = match fetched {
        Ok(environment) => environment,
        Err(error) => {
            println!("skipped: the Python package: {error:#}");
            tally.add_skip();
            return Ok(Vec::new());
        }
    };
    if let Err(error) = environment.install_package("dev") {
        tally.add_failures(1);
        return Ok(vec![format!("the Python package does not build: {error:#}")]);
    }
    Ok(if environment.pytest(tally)? { Vec::new() } else { vec![format!("pytest of {PACKAGE}")] })
}

/// A Python environment.
struct Environment {
    /// The workspace.
    root: PathBuf,
    program: PathBuf,
}

impl Environment {
    /// A new one in the build folder, in the place of one that is there.
    fn fresh(python: &str) -> anyhow::Result<Self> {
        let folder = environment::target_directory()?.join("python-package");
        if folder.exists() {
            std::fs::remove_dir_all(&folder)
                .with_context(|| format!("cannot remove {}", folder.display()))?;
        }
        Self::kept(python)
    }

    /// The one in the build folder, made if it is absent.
    fn kept(python: &str) -> anyhow::Result<Self> {
        let folder = environment::target_directory()?.join("python-package");
        let program = folder.join(if cfg!(windows) { "Scripts/python.exe" } else { "bin/python" });
        if !program.exists() {
            run(Command::new(python).args(["-m", "venv"]).arg(&folder))
                .context("a Python with `venv` is needed: install one, or name it with --python")?;
        }
        Ok(Environment { root: environment::workspace_root()?, program })
    }

    fn python(&self) -> Command {
        let mut command = Command::new(&self.program);
        // Without the user's own packages; the notebooks draw into files.
        command.current_dir(self.root.join(PACKAGE)).env_remove("PYTHONPATH").env("MPLBACKEND", "Agg");
        command
    }

    fn pip_install(&self) -> Command {
        let mut command = self.python();
        command.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--retries", "1"]);
        command
    }

    /// Packages from the index.
    fn fetch(&self, packages: &[&str]) -> anyhow::Result<()> {
        run(self.pip_install().arg("--only-binary=:all:").args(packages))
            .with_context(|| format!("pip cannot install {} (is there a network?)", packages.join(", ")))
    }

    /// The package of this workspace.
    fn install_package(&self, profile: &str) -> anyhow::Result<()> {
        let path = self.root.join(PACKAGE);
        let mut pip = self.pip_install();
        // maturin is found in the environment, and finds the cargo that runs this.
        pip.args(["--no-build-isolation", "--no-deps", "--force-reinstall"]).arg(path);
        pip.env("MATURIN_PEP517_ARGS", format!("--profile {profile}")).env("PATH", self.path()?);
        run(&mut pip)
    }

    /// The search path with the environment's programs first, then cargo's folder.
    fn path(&self) -> anyhow::Result<std::ffi::OsString> {
        let own = self.program.parent().map(Path::to_owned);
        let cargo = std::env::var_os("CARGO").map(PathBuf::from);
        let cargo = cargo.and_then(|cargo| cargo.parent().map(Path::to_owned));
        let inherited = std::env::var_os("PATH").unwrap_or_default();
        Ok(std::env::join_paths(own.into_iter().chain(cargo).chain(std::env::split_paths(&inherited)))?)
    }

    /// Runs the tests, passing on their output line by line, and counts; whether all is well.
    fn pytest(&self, tally: &mut Tally) -> anyhow::Result<bool> {
        let mut child = self
            .python()
            .args(["-m", "pytest", "-q", "--color=no", "-p", "no:cacheprovider"])
            .stdout(Stdio::piped())
            .spawn()
            .context("pytest cannot be started")?;
        let failures = tally.failures();
        if let Some(output) = child.stdout.take() {
            for line in BufReader::new(output).split(b'\n') {
                let line = line.context("the output of pytest cannot be read")?;
                let line = String::from_utf8_lossy(&line);
                println!("{line}");
                tally.read_line_of_pytest(&line);
            }
        }
        let passed = child.wait().context("pytest did not end")?.success();
        if !passed && tally.failures() == failures {
            tally.add_failures(1);
        }
        Ok(passed)
    }
}

/// Runs a program whose output goes to the terminal.
fn run(command: &mut Command) -> anyhow::Result<()> {
    let program = command.get_program().to_string_lossy().into_owned();
    let status =
        command.stdin(Stdio::null()).status().with_context(|| format!("{program} cannot be started"))?;
    ensure!(status.success(), "{program} has failed ({status})");
    Ok(())
}
