//! `cargo xtask torture`: hostile inputs on the release binary, and a table of what came of them.

use crate::environment;
use anyhow::{Context, ensure};
use phiw_torture::hostile::{self, ClassScore, Ground, Judgement};
use std::path::PathBuf;
use std::process::ExitCode;

/// Command line of `cargo xtask torture`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The share of each class's cases that is run.
    #[arg(long, default_value_t = 1.0)]
    share: f64,
    /// Seed of the cases.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only classes whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// How many failures of a class are printed.
    #[arg(long, default_value_t = 3)]
    show: usize,
    /// Another program in the place of this workspace's release binary.
    #[arg(long)]
    phiw: Option<PathBuf>,
}

/// Prints a line for each class; fails if anything was not as it has to be.
///
/// # Errors
/// The program can't be built or started, or fails on the good inputs.
pub fn command(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let phiw = match &arguments.phiw {
        Some(phiw) => phiw.canonicalize().with_context(|| phiw.display().to_string())?,
        None => environment::release_binary()?,
    };
    let ground = Ground::new(&phiw, arguments.seed)?;
    let classes: Vec<_> =
        hostile::classes().into_iter().filter(|class| class.name.contains(&arguments.only)).collect();
    ensure!(!classes.is_empty(), "no class has `{}` in its name", arguments.only);
    println!(
        "{:<54}{:>7}{:>9}{:>9}{:>8}{:>10}{:>9}",
        "class", "tried", "results", "refused", "failed", "slowest/s", "most/MB"
    );
    let print = |score: &ClassScore| {
        println!(
            "{:<54}{:>7}{:>9}{:>9}{:>8}{:>10.2}{:>9}",
            score.name,
            score.tried,
            score.results,
            score.refused,
            score.failures.len(),
            score.slowest_refusal.as_secs_f64(),
            score.largest_refusal_bytes / 1_000_000,
        );
        for failure in score.failures.iter().take(arguments.show) {
            let (kind, what) = match &failure.judgement {
                Judgement::Wrong(what) => ("WRONG", what.as_str()),
                Judgement::Broken(what) => ("broken", what.as_str()),
                Judgement::Held => ("held", ""),
            };
            println!("    {kind} {}: {} -> {what}", failure.number, failure.story);
        }
    };
    let scores = hostile::run(&ground, &classes, arguments.share, arguments.seed, &print)?;
    let count = |of: &dyn Fn(&ClassScore) -> usize| scores.iter().map(of).sum::<usize>();
    let wrong = |score: &ClassScore| {
        score.failures.iter().filter(|failure| matches!(failure.judgement, Judgement::Wrong(_))).count()
    };
    let failed = count(&|score| score.failures.len());
    println!(
        "{} tried, {failed} failed, {} of them wrong results; refusals: at most {:.2} s and {} MB (seed {})",
        count(&|score| score.tried),
        count(&wrong),
        scores.iter().map(|score| score.slowest_refusal.as_secs_f64()).fold(0.0, f64::max),
        scores.iter().map(|score| score.largest_refusal_bytes).max().unwrap_or(0) / 1_000_000,
        arguments.seed,
    );
    Ok(if failed == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
