//! All cases through the tracer, several at a time.

use super::case::Case;
use super::robot::Robot;
use super::score::{Score, score};
use super::suite::{Spec, Suite};
use super::tracer::Tracer;
use super::truth::Truth;
use anyhow::Context;
use indicatif::{ProgressBar, ProgressStyle};
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A case that went through the tracer.
pub struct Scored {
    /// What is true.
    pub truth: Truth,
    /// The score, or what went wrong with the tracer.
    pub score: Result<Score, String>,
    /// Time of `explain` \[s\].
    pub seconds: f64,
}

/// What is kept of a case: all but what follows from its seed.
#[derive(Serialize, Deserialize)]
struct Outcome {
    score: Result<Score, String>,
    seconds: f64,
}

/// How cases are run.
pub struct Options<'a> {
    /// Cases at a time.
    pub jobs: usize,
    /// Keep each case's files here.
    pub keep: Option<&'a Path>,
    /// Each case's outcome is written here as soon as it is known.
    pub outcomes: &'a Path,
    /// Take the outcomes that are there already.
    pub resume: bool,
}

/// Runs all cases, in any order; the results are in the order of the specs.
///
/// # Errors
/// A case cannot be drawn or written. A tracer that fails on a case is a score, not an error.
pub fn run_all(
    specs: &[Spec],
    robots: &[Robot],
    tracer: &Tracer,
    options: &Options,
) -> anyhow::Result<Vec<Scored>> {
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} {elapsed} (left {eta}) {msg}")?;
    let progress = ProgressBar::new(specs.len() as u64).with_style(style);
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, anyhow::Result<Scored>)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..options.jobs.max(1) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(spec) = specs.get(index) else { break };
                    let result = run_one(spec, robots, tracer, options);
                    if let Ok(mut results) = results.lock() {
                        results.push((index, result));
                        let good = |(_, scored): &&(usize, anyhow::Result<Scored>)| {
                            scored.as_ref().is_ok_and(|scored| {
                                scored.score.as_ref().is_ok_and(|score| score.is_good(&scored.truth))
                            })
                        };
                        let good = results.iter().filter(good).count();
                        progress
                            .set_message(format!("good {:.1} %", 100.0 * good as f64 / results.len() as f64));
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

fn run_one(spec: &Spec, robots: &[Robot], tracer: &Tracer, options: &Options) -> anyhow::Result<Scored> {
    let case = Case::draw(spec, robots).with_context(|| format!("no robot can have case {}", spec.seed))?;
    let truth = Truth::of(&case);
    let outcome = options.outcomes.join(format!("{}.json", spec.seed));
    if options.resume && outcome.exists() {
        let text = std::fs::read_to_string(&outcome).with_context(|| outcome.display().to_string())?;
        let Outcome { score, seconds } =
            serde_json::from_str(&text).with_context(|| outcome.display().to_string())?;
        return Ok(Scored { truth, score, seconds });
    }
    let temporary = tempfile::tempdir()?;
    if let Some(folder) = options.keep {
        super::write::write_truth(&truth, folder)?;
    }
    let folder = match options.keep {
        Some(folder) => folder.join(spec.seed.to_string()),
        None => temporary.path().join("case"),
    };
    // The floor is what the noise leaves, and the experiment knows it: the same case without its secrets.
    let floors = match spec.suite {
        Suite::One
        | Suite::Two
        | Suite::Three
        | Suite::WideEffects
        | Suite::WideOutside
        | Suite::NewKinds
        | Suite::LargeGains
        | Suite::NewStrangers
        | Suite::LaterStrangers
        | Suite::NewForms => tracer
            .remainder(&case.without_secrets(), &temporary.path().join("twin"))
            .inspect_err(|error| eprintln!("{}: no noise floor: {error:#}", spec.seed))
            .ok(),
        Suite::Control | Suite::Outside | Suite::WideRight => None,
    };
    let (score, seconds) = match tracer.run(&case, &folder) {
        Ok(traced) => (Ok(score(&truth, &traced.report, floors.as_ref())), traced.elapsed.as_secs_f64()),
        Err(error) => (Err(format!("{error:#}")), 0.0),
    };
    let kept = Outcome { score, seconds };
    // Written aside and renamed: a killed run leaves no half a file.
    let aside = outcome.with_extension("tmp");
    std::fs::write(&aside, serde_json::to_string(&kept)?).with_context(|| aside.display().to_string())?;
    std::fs::rename(&aside, &outcome).with_context(|| outcome.display().to_string())?;
    Ok(Scored { truth, score: kept.score, seconds: kept.seconds })
}
