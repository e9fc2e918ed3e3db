//! `cargo xtask torture`: hostile inputs, kills and concurrent runs on the release binary, and tables of what
//! came of them.

use anyhow::{Context, ensure};
use phiw_experiments::environment;
use phiw_torture::hostile::{self, ClassScore, Ground, Judgement};
use phiw_torture::interrupted::{kill, pair, subjects};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

/// An input that is refused is refused within this. Asked of this command alone: a test takes what time it
/// gets.
const LONGEST_REFUSAL: Duration = Duration::from_secs(10);

/// Command line of `cargo xtask torture`.
#[derive(clap::Args)]
pub struct Arguments {
    /// What is done; everything by default.
    #[arg(value_enum)]
    part: Option<Part>,
    /// Runs that are killed, over all commands.
    #[arg(long, default_value_t = 1000)]
    kills: usize,
    /// Pairs of runs at the same time, over all commands.
    #[arg(long, default_value_t = 500)]
    pairs: usize,
    /// The share of each class's cases that is run.
    #[arg(long, default_value_t = 1.0)]
    share: f64,
    /// Seed of the cases.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Only classes, or commands, whose name contains this.
    #[arg(long, default_value = "")]
    only: String,
    /// How many failures of a class are printed.
    #[arg(long, default_value_t = 3)]
    show: usize,
    /// Another program in the place of this workspace's release binary.
    #[arg(long)]
    phiw: Option<PathBuf>,
}

/// A part of the torture.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Spoiled inputs and bad surroundings.
    Inputs,
    /// Runs that are killed, half of them while they commit.
    Kills,
    /// Two runs into one folder at the same time.
    Pairs,
}

/// Prints tables; fails if anything was not as it has to be.
///
/// # Errors
/// The program can't be built or started, or fails on the good inputs.
pub fn command(arguments: &Arguments) -> anyhow::Result<ExitCode> {
    let phiw = match &arguments.phiw {
        Some(phiw) => phiw.canonicalize().with_context(|| phiw.display().to_string())?,
        None => environment::release_binary()?,
    };
    let asked = |part| arguments.part.is_none_or(|only| only == part);
    let inputs = !asked(Part::Inputs) || inputs(arguments, &phiw)?;
    let interrupted = !(asked(Part::Kills) || asked(Part::Pairs)) || interrupted(arguments, &phiw)?;
    Ok(if inputs && interrupted { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Whether results were whole whatever came between.
fn interrupted(arguments: &Arguments, phiw: &Path) -> anyhow::Result<bool> {
    let subjects = subjects(phiw, &std::env::current_exe()?, arguments.seed)?;
    let mut whole = true;
    if arguments.part != Some(Part::Pairs) {
        println!("kill -9      tried  killed  committing    old    new  undone   mixed  left");
        for subject in subjects.iter().filter(|subject| subject.name.contains(&arguments.only)) {
            let score = kill(subject, arguments.kills.div_ceil(subjects.len()), arguments.seed)?;
            println!(
                "{:<12}{:>6}{:>8}{:>12}{:>7}{:>7}{:>8}{:>8}{:>6}",
                subject.name,
                score.tried,
                score.killed,
                score.committing,
                score.old,
                score.new,
                score.undone,
                score.mixed,
                score.leftovers
            );
            if let Some(story) = score.first_mixed {
                println!("    mixed: {story}");
            }
            whole &= score.mixed == 0 && score.leftovers == 0;
        }
    }
    if arguments.part != Some(Part::Kills) {
        println!("two at once  tried  one refused  both one after the other   bad");
        let of_phiw = subjects.iter().filter(|subject| subject.name != "paper");
        let count = of_phiw.clone().count();
        for subject in of_phiw {
            let score = pair(subject, arguments.pairs.div_ceil(count))?;
            println!(
                "{:<12}{:>6}{:>13}{:>26}{:>6}",
                subject.name, score.tried, score.refused, score.both, score.bad
            );
            whole &= score.bad == 0;
        }
    }
    Ok(whole)
}

/// Whether every hostile input ended as it has to.
fn inputs(arguments: &Arguments, phiw: &Path) -> anyhow::Result<bool> {
    let ground = Ground::new(phiw, arguments.seed)?;
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
    let slowest = scores.iter().map(|score| score.slowest_refusal).max().unwrap_or_default();
    println!(
        "{} tried, {failed} failed, {} of them wrong results; refusals: at most {:.2} s and {} MB (seed {})",
        count(&|score| score.tried),
        count(&wrong),
        slowest.as_secs_f64(),
        scores.iter().map(|score| score.largest_refusal_bytes).max().unwrap_or(0) / 1_000_000,
        arguments.seed,
    );
    Ok(failed == 0 && slowest <= LONGEST_REFUSAL)
}
