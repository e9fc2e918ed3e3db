//! `cargo xtask plant`: closed loops with a secret.
//!
//! # What it asks
//!
//! Whether `phiw explain` finds an undeclared effect where robots are robots: in the closed loop of a physics
//! engine, where the controller tracks poorly, the actuators add noise that no log shows, and the effect
//! changes the motion itself. Each case is the 18-joint upper body with one secret effect of 12 to 30 % of a
//! joint's RMS torque; kind, joint and size follow from the seed, the same in all engines. The answer of
//! `phiw explain`, a program of its own that sees files only, is held against the truth.
//!
//! # How it is run
//!
//! `cargo xtask plant` takes twelve kinds, two cases of each, in MuJoCo and Rapier. MuJoCo's library must be
//! there (`cargo xtask mujoco`); `--engine rapier` does without. `--all-kinds` adds the kinds that show
//! against a model from before only.
//!
//! # What it prints
//!
//! A table of the kinds: how often kind and joints were named, what else was named, the error over the noise
//! floor before and after; then every case that went wrong.
//!
//! # Where results go
//!
//! Into `target/plant` below the working directory, or where `--out` says: `score.md` (what is printed),
//! `cases.json` and `cases.csv`. `--keep DIR` keeps each case's files.

// These files know each other: a case draws its secret from the robot and ends as a score, the score says
// which case it is of, and `command` runs the cases under its `Arguments`. They are one record in several
// files.
pub(crate) mod case;
pub(crate) mod engine;
mod score;
pub(crate) mod secret;
mod table;

use crate::undeclared::tracer::Tracer;
use anyhow::Context;
use case::{Case, Robot};
use engine::Engine;
use indicatif::{ProgressBar, ProgressStyle};
use score::Scored;
use secret::{SecretKind, TWELVE};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Arguments of `cargo xtask plant`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// Physics engines.
    #[arg(long, value_delimiter = ',', default_value = "mujoco,rapier")]
    engine: Vec<Engine>,
    /// Kinds of secrets (default: twelve that a log can show by itself).
    #[arg(long, value_delimiter = ',')]
    kind: Vec<SecretKind>,
    /// All kinds, with those that only a held model shows.
    #[arg(long, conflicts_with = "kind")]
    all_kinds: bool,
    /// Cases of each kind and engine.
    #[arg(long, default_value_t = 2)]
    count: u64,
    /// Standard deviation of the torque that actuators add unlogged, over the effort limit. (A wrist's usual
    /// torque is a hundredth of its limit: a few thousandths of the limit are a good part of that.)
    #[arg(long, default_value_t = 0.002)]
    noise: f64,
    /// Time between two rows of the log, and between two commands of the controller, in seconds.
    #[arg(long, default_value_t = 0.01)]
    period: f64,
    /// Length of each of the three logs, in seconds.
    #[arg(long, default_value_t = 20.0)]
    duration: f64,
    /// The first seed.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Cases at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// The tracer (default: build it from this workspace).
    #[arg(long, value_name = "PATH")]
    phiw: Option<PathBuf>,
    /// Keep each case's files in this folder; the truth lies beside what the tracer sees.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Where `cases.json`, `cases.csv` and `score.md` go.
    #[arg(long, value_name = "DIR", default_value = "target/plant")]
    out: PathBuf,
}

/// Runs the task.
///
/// # Errors
/// A model does not read, an engine is not there, there is no tracer, or a file cannot be written.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let robot = Robot::read()?;
    for engine in &arguments.engine {
        engine.check(&robot.tree)?;
    }
    let kinds: Vec<SecretKind> = match (arguments.all_kinds, arguments.kind.as_slice()) {
        (true, _) => SecretKind::ALL.to_vec(),
        (false, []) => TWELVE.to_vec(),
        (false, some) => some.to_vec(),
    };
    let mut cases = Vec::new();
    for &kind in &kinds {
        for index in 0..arguments.count {
            // The same secrets in all engines.
            let seed = arguments.seed * 10_000 + kind as u64 * 100 + index;
            cases.extend(arguments.engine.iter().map(|&engine| Case { engine, kind, seed }));
        }
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from).div_ceil(arguments.jobs.max(1));
    let tracer = Tracer::find(arguments.phiw.as_deref(), threads)?;
    let scored = run_all(&cases, &robot, &tracer, arguments)?;
    let markdown = table::markdown(&scored, arguments);
    println!("{markdown}");
    std::fs::create_dir_all(&arguments.out).with_context(|| arguments.out.display().to_string())?;
    let json = serde_json::to_string_pretty(&scored)? + "\n";
    for (name, text) in [("score.md", markdown), ("cases.json", json), ("cases.csv", table::csv(&scored))] {
        let path = arguments.out.join(name);
        std::fs::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}

/// Runs all cases, several at a time; the results are in the order of the cases.
fn run_all(
    cases: &[Case],
    robot: &Robot,
    tracer: &Tracer,
    arguments: &Arguments,
) -> anyhow::Result<Vec<Scored>> {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {elapsed} (left {eta}) {msg}")?;
    let progress = ProgressBar::new(cases.len() as u64).with_style(style);
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, anyhow::Result<Scored>)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..arguments.jobs.max(1) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index) else { break };
                    let result = case.run(robot, tracer, arguments).with_context(|| {
                        format!("{} in {:?}, seed {}", case.kind.name(), case.engine, case.seed)
                    });
                    if let Ok(mut results) = results.lock() {
                        results.push((index, result));
                    }
                    progress.inc(1);
                }
            });
        }
    });
    progress.finish_and_clear();
    let mut results = results.into_inner().ok().context("a worker died")?;
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}
