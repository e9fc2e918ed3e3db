//! `cargo xtask paper`: the experiments of section 5 of the paper, and what it left for the future.
//!
//! # What it asks
//!
//! Whether the paper's results come out: how fast the parameters (17), the torques (19) and the count of well
//! estimated parameters (18) improve with each iteration, and whether the curriculum does better than other
//! ways to choose motions. `--arm` names these ways, `--footing` says whether the robot is bolted to the
//! floor or stands free to topple, `--secret` gives the plant of each run an effect that nobody declared, and
//! `--robot whole-body` asks the same of a whole body.
//!
//! # How it is run
//!
//! `cargo xtask paper` compares 200 seeds under four arms; `--seeds 2 --per-task 2 --backend analytic` is a
//! quick look. A run is one seed under one arm. It has a file of its own, written after every iteration, so a
//! command that was killed goes on where it was. With `--shard I/N` a machine does its part of the runs,
//! `cargo xtask paper merge` takes the parts together, and `--slurm N` writes the script of a job array that
//! does both.
//!
//! # What it prints
//!
//! The paper's numbers with ours beside them: medians over the seeds, by iteration.
//!
//! # Where results go
//!
//! Into `target/paper` in the workspace, or where `--out` says: `report.html` with the figures; the tables
//! behind it (`numbers.csv`, `iterations.csv`, `parameters.csv`, `motions.csv`, `detection.csv`,
//! `secrets.csv`); `setup.json`, which all runs in the folder share; and `runs/`.

// These files know each other around two types. `Setup` is what all runs in a folder share: it is made of the
// arguments, is written beside the runs, and every run is scored by it. `RunFile` is one run as it is kept,
// with its job, score and detections; jobs write it and the report's tables read it. subject.rs reads any of
// the robots, and whole_body.rs is the longest of these cases.
mod arguments;
mod arm;
mod detection;
mod ending;
mod estimators;
mod figures;
mod fourier;
mod infinite;
mod jobs;
mod method;
mod motions;
mod numbers;
mod page;
mod reasons;
mod reliability;
mod report;
mod run_file;
mod score;
mod seconds;
mod secrets;
mod setup;
mod shard;
mod subject;
mod swing;
mod tasks;
mod tidy;
mod whole_body;

pub(crate) use crate::plant::engine::Engine;
pub(crate) use crate::plant::secret::SecretKind;
pub use arguments::Arguments;
pub(crate) use arguments::{Detector, EstimatorName, Initial, NoiseIn, RunArguments};
pub(crate) use arm::{Arm, Footing};
pub(crate) use figures::{balance, choices};
pub(crate) use jobs::{Job, do_all};
pub(crate) use motions::Source;
pub(crate) use run_file::RunFile;
pub(crate) use score::Score;
pub(crate) use setup::Setup;
pub(crate) use subject::{Subject, SubjectName};

use crate::environment;
use anyhow::Context;
use arguments::{Command, MergeArguments};
use indicatif::{ProgressBar, ProgressStyle};
use jobs::Outcome;
use phiw::console::Console;
use std::path::Path;

impl Arguments {
    /// Whether the runs need MuJoCo's library, which the caller may want to fetch first.
    pub fn needs_mujoco(&self) -> bool {
        self.command.is_none() && self.run.slurm.is_none() && self.run.backend == Engine::Mujoco
    }
}

/// Runs the task.
///
/// # Errors
/// A motion or a robot does not read, an engine is not there, or a file can not be written.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    match &arguments.command {
        Some(Command::Merge(merge)) => self::merge(merge),
        None if arguments.run.slurm.is_some() => shard::slurm(&arguments.run),
        None => run(&arguments.run()),
    }
}

fn run(arguments: &RunArguments) -> anyhow::Result<()> {
    let out = environment::workspace_root()?.join(&arguments.out);
    std::fs::create_dir_all(&out).with_context(|| out.display().to_string())?;
    let setup = Setup::new(arguments, &out, &Console::of_terminal(false))?;
    setup.settings.keep(&out)?;
    let jobs = shard::part(jobs::all(arguments), arguments.shard);
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} iterations {elapsed} (left {eta})")?;
    let bar = ProgressBar::new(jobs.len() as u64 * arguments.iterations as u64).with_style(style);
    let outcome = jobs::do_all(&setup, &jobs, &out, arguments.stop_after, &|iterations| bar.inc(iterations))?;
    bar.finish_and_clear();
    if let Outcome::Stopped = outcome {
        println!("stopped as told; start the same command again to go on");
        return Ok(());
    }
    if arguments.shard.is_some_and(|shard| shard.count > 1) {
        println!("shard done: {}", out.display());
        return Ok(());
    }
    finish(&out)
}

fn merge(arguments: &MergeArguments) -> anyhow::Result<()> {
    let root = environment::workspace_root()?;
    let out = root.join(&arguments.out);
    shard::merge(&arguments.shards.iter().map(|folder| root.join(folder)).collect::<Vec<_>>(), &out)?;
    finish(&out)
}

/// Tables, pictures and the page from all runs in a folder.
fn finish(out: &Path) -> anyhow::Result<()> {
    let results = report::Results::read(out)?;
    tidy::write(&results, out)?;
    let page = report::page(&results);
    let file = out.join("report.html");
    std::fs::write(&file, page).with_context(|| file.display().to_string())?;
    println!("{}", numbers::plain(&results));
    println!("report: {}", file.display());
    Ok(())
}
