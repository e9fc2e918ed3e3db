//! Runs the tracer on the files of a case. It is a program of its own and sees nothing else.

use super::case::Case;
use super::report_file::Report;
use super::write::write_visible;
use crate::environment;
use anyhow::{Context, bail};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

/// The program under test.
pub struct Tracer {
    /// Path of `phiw`.
    pub program: PathBuf,
    /// Threads that it may use.
    pub threads: usize,
    /// A threshold of `explain` and its value, in the place of its default.
    pub threshold: Option<(String, f64)>,
}

/// What it said, and how long it took.
pub struct Traced {
    /// The report.
    pub report: Report,
    /// Time of `explain` alone.
    pub elapsed: Duration,
}

impl Tracer {
    /// Writes the case into `folder`, identifies the clean robot where a model is held, and lets the tracer
    /// explain the logs.
    ///
    /// # Errors
    /// A file cannot be written or read, or the tracer fails: its standard error is in the message.
    pub fn run(&self, case: &Case, folder: &Path) -> anyhow::Result<Traced> {
        write_visible(case, folder)?;
        let task = |task: &str, logs: [&str; 3], out: &str| self.task(task, case, folder, logs, out);
        let mut explain = task("explain", ["train_a.csv", "train_b.csv", "validate.csv"], "out");
        if case.spec.held {
            run(task("identify", ["clean_a.csv", "clean_b.csv", "clean_c.csv"], "clean"))?;
            explain.args(["--model", "clean/model.json"]);
        }
        if let Some((name, value)) = &self.threshold {
            explain.args(["--threshold", &format!("{name}={value}")]);
        }
        let start = Instant::now();
        run(explain)?;
        let elapsed = start.elapsed();
        Ok(Traced { report: read_report(folder)?, elapsed })
    }

    /// Writes the case into `folder` and gives what is left of it once the declared model is identified,
    /// joint by joint: of a case without secrets, what the noise leaves behind the tracer's own filters.
    ///
    /// # Errors
    /// A file cannot be written or read, or the program fails.
    pub fn remainder(&self, case: &Case, folder: &Path) -> anyhow::Result<BTreeMap<String, f64>> {
        if case.spec.held {
            return Ok(self.run(case, folder)?.report.before.validate.rmse);
        }
        write_visible(case, folder)?;
        run(self.task("identify", case, folder, ["train_a.csv", "train_b.csv", "validate.csv"], "out"))?;
        Ok(read_report(folder)?.before.validate.rmse)
    }

    fn task(&self, task: &str, case: &Case, folder: &Path, logs: [&str; 3], out: &str) -> Command {
        let declared: Vec<String> = case.declared.iter().map(|kind| kind.name()).collect();
        let mut command = Command::new(&self.program);
        command.current_dir(folder).env("RAYON_NUM_THREADS", self.threads.to_string());
        command.args([task, "--urdf", "robot.urdf", "--train", logs[0], logs[1], "--validate", logs[2]]);
        if !declared.is_empty() {
            command.args(["--declare", &declared.join(",")]);
        }
        if !case.still.is_empty() {
            let tree = &case.robot.tree;
            let held =
                case.still.iter().map(|&(joint, position)| format!("{}={position}", tree.joint(joint).joint));
            command.args(["--hold", &held.collect::<Vec<String>>().join(",")]);
        }
        command.args(["--out", out]);
        command
    }

    /// The program at `path`, or else the one built from this workspace.
    ///
    /// # Errors
    /// There is no such program, or the build fails.
    pub fn find(path: Option<&Path>, threads: usize) -> anyhow::Result<Self> {
        let program = match path {
            Some(path) => path.canonicalize().with_context(|| path.display().to_string())?,
            None => environment::release_binary()?,
        };
        Ok(Tracer { program, threads, threshold: None })
    }
}

fn read_report(folder: &Path) -> anyhow::Result<Report> {
    let path = folder.join("out/report.json");
    let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

fn run(mut command: Command) -> anyhow::Result<()> {
    let output = command.output().with_context(|| format!("{:?}", command.get_program()))?;
    if !output.status.success() {
        let arguments: Vec<_> = command.get_args().map(|argument| argument.to_string_lossy()).collect();
        let message = String::from_utf8_lossy(&output.stderr);
        bail!("`phiw {}` ended with {}: {}", arguments.join(" "), output.status, message.trim());
    }
    Ok(())
}
