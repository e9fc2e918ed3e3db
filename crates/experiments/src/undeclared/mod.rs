//! `cargo xtask undeclared`: robot logs with effects that nobody declared. It generates them, has `phiw
//! explain` trace them, and scores what that says.
//!
//! # What it asks
//!
//! Which undeclared effects the tracer finds, with the right joints, and what it invents. A case is one of
//! five robots with one, two, three or no secret effects (the suites `one`, `two`, `three`, `control`), or
//! with one that the catalogue does not have (`outside`). Noise, jitter, quantisation and the declared
//! effects are drawn as well. The wide suites have robots as they come: frictions on all joints, of which
//! mostly nothing is declared, and up to thirteen effects more (`wide_effects`), right models
//! (`wide_right`), effects that no catalogue has beside others (`wide_outside`), each in all situations of
//! `situation.rs`, from white noise to joints that are mostly noise, filters in drives, late velocities, dead
//! bands, logs of a few seconds, rough clocks, and held-out motion that is faster than all that was trained
//! on.
//! `new_kinds` has the kinds that came to the catalogue last, so that the cases of the other suites stay
//! what they were, and `large_gains` torques that are logged at a third to three times what they are.
//! `new_strangers` and `later_strangers` have what no catalogue has and came last, `new_forms` forms of older
//! kinds: drifts of a robot that is cold again before each log or whose stamps count from long before, and
//! shafts that turn with one joint and a multiple of another. A case follows from its
//! seed alone. Seeds for developing the tracer and seeds for reporting are disjoint.
//!
//! The tracer is a separate program that sees files only. What is true stays here, or in a `truth.json`
//! beside the folder that it sees. All forms of effects are written from the literature and not from the
//! tracer's catalogue.
//!
//! # How it is run
//!
//! `cargo xtask undeclared --all` is the full experiment on the old suites, 1000 cases of each family of
//! seeds, and `--suite wide` that on the wide ones, 1538 cases of the reporting seeds; `--resume` goes on
//! with one that was stopped. `--suite wide_right,wide_effects --threshold NAME=VALUE,VALUE…` calibrates one
//! of the tracer's thresholds (`Thresholds` of phiw-residual). `--suite`, `--situation`, `--kind`, `--robot`
//! and `--count` choose among the cases, `--case SEED` traces one and shows its truth, and `--generate DIR`
//! only writes the files.
//!
//! # What it prints
//!
//! Tables: for each kind how often it was named right, taken for a rival, given to the wrong joints or
//! missed; false names where nothing was hidden; the verdicts on what the catalogue does not have; the share
//! of the error removed; time; and every failure with its seed.
//!
//! # Where results go
//!
//! Into `target/undeclared` below the working directory, or where `--out` says, a folder for each family of
//! seeds (`dev`, `report`): `score.md`, `cases.csv` with one row for each case, and `outcomes/`, what
//! `--resume` goes on from. `--keep DIR` keeps the files of each case.

// Three groups of files know each other. A `Secret` (secret.rs) is one of the forms in elasticity.rs,
// family.rs, friction.rs, load.rs, mechanism.rs and pull.rs, each of which computes its torque over a
// `Scene` of plant.rs, and plant.rs adds the secret's torque up. case.rs calls the two special ways to draw a
// case, saturation.rs and wide.rs, which use its numbers. logging.rs and sensors.rs, and table.rs and
// wide_table.rs, are each one subject in two files: the ordinary part, and what the wide suites add to it.
mod alike;
mod case;
mod certainty;
mod distortion;
mod draw;
mod elasticity;
mod family;
mod friction;
mod kind;
#[cfg(test)]
mod later_tests;
mod load;
mod logging;
mod mechanism;
mod plant;
mod profile;
mod pull;
mod push;
pub(crate) mod report_file;
mod rng;
mod robot;
mod run;
mod saturation;
mod score;
mod secret;
mod sensors;
mod situation;
mod smoothing;
mod suite;
mod table;
#[cfg(test)]
mod tests;
mod threshold_table;
pub(crate) mod tracer;
mod trajectory;
mod truth;
mod visibility;
mod wide;
mod wide_table;
#[cfg(test)]
mod wide_tests;
mod write;

use anyhow::Context;
use kind::{Kind, Name};
use situation::Situation;
use std::path::PathBuf;
use suite::{Seeds, Spec, Suite};

/// Arguments of `cargo xtask undeclared`.
#[derive(Debug, clap::Args)]
pub struct Arguments {
    /// All old suites (or those of --suite), as many cases as the experiment asks for, on both families of
    /// seeds.
    #[arg(long)]
    all: bool,
    /// Suites, separated by commas: one, two, three, control, outside (together: old), wide_right,
    /// wide_effects, wide_outside (together: wide), new_kinds, large_gains, new_strangers,
    /// later_strangers, new_forms.
    #[arg(long, value_name = "SUITE", default_value = "old", value_parser = suites)]
    suite: std::sync::Arc<Suites>,
    /// Only cases in this situation (wide suites).
    #[arg(long)]
    situation: Option<Situation>,
    /// Give one of the tracer's thresholds these values one after the other, and print what each value does
    /// to right models and to missing effects (wide suites). With `false_name_probability` that is the rate
    /// of false names, asked and observed.
    #[arg(long, value_name = "NAME=VALUE,VALUE…", value_parser = named_values)]
    threshold: Option<NamedValues>,
    /// Only cases with this effect among their secrets.
    #[arg(long)]
    kind: Option<Kind>,
    /// Only cases of this robot.
    #[arg(long)]
    robot: Option<String>,
    /// How many cases of each suite (default: as many as the experiment asks for).
    #[arg(long)]
    count: Option<usize>,
    /// Which seeds (default: with --all both, one score after the other; else those for reporting).
    #[arg(long)]
    seeds: Option<Seeds>,
    /// Only write the cases' files into this folder: `<seed>/` for the tracer, `<seed>.truth.json` beside it.
    #[arg(long, value_name = "DIR")]
    generate: Option<PathBuf>,
    /// The case of this seed only.
    #[arg(long, value_name = "SEED", conflicts_with_all = ["all", "situation", "kind", "robot", "count"])]
    case: Option<u64>,
    /// Keep the files of each case, and its truth, in this folder.
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
    /// Cases at a time.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// The tracer (default: build it from this workspace).
    #[arg(long, value_name = "PATH")]
    phiw: Option<PathBuf>,
    /// Go on with a run that was stopped: cases whose outcome is in the output folder are not traced again.
    #[arg(long)]
    resume: bool,
    /// Where `cases.csv` and `score.md` go, and each case's outcome, in a folder for each family of seeds.
    #[arg(long, value_name = "DIR", default_value = "target/undeclared")]
    out: PathBuf,
}

/// A number that decides by its name, and the values that are tried.
#[derive(Clone, Debug)]
pub(crate) struct NamedValues {
    pub name: String,
    pub values: Vec<f64>,
}

pub(crate) fn named_values(text: &str) -> Result<NamedValues, String> {
    let (name, values) = text.split_once('=').ok_or("write NAME=VALUE,VALUE…")?;
    let values: Result<Vec<f64>, _> = values.split(',').map(str::parse).collect();
    let values = values.map_err(|error| format!("{text}: {error}"))?;
    Ok(NamedValues { name: name.to_owned(), values })
}

/// A choice of suites.
type Suites = Vec<Suite>;

fn suites(text: &str) -> Result<std::sync::Arc<Suites>, String> {
    let mut suites = Suites::new();
    for name in text.split(',') {
        match name {
            "old" => suites.extend(Suite::OLD),
            "wide" => suites.extend(Suite::WIDE),
            name => suites.push(<Suite as clap::ValueEnum>::from_str(name, false).map_err(|_| {
                format!(
                    "no suite {name:?}; there are old and wide, or single ones of them: one, two, \
                     three, control, outside, wide_right, wide_effects, wide_outside, new_kinds, \
                     large_gains, new_strangers, later_strangers, new_forms"
                )
            })?),
        }
    }
    Ok(std::sync::Arc::new(suites))
}

/// Runs the task.
///
/// # Errors
/// A folder cannot be written, a model does not read, or there is no tracer.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let robots = robot::robots()?;
    let seeds = match (arguments.seeds, arguments.all) {
        (Some(seeds), _) => vec![seeds],
        (None, true) => vec![Seeds::Dev, Seeds::Report],
        (None, false) => vec![Seeds::Report],
    };
    if let Some(folder) = &arguments.generate {
        for seeds in seeds {
            generate(&specs(arguments, seeds, &robots)?, &robots, folder)?;
        }
        return Ok(());
    }
    let threads = std::thread::available_parallelism().map_or(1, usize::from).div_ceil(arguments.jobs.max(1));
    let mut tracer = tracer::Tracer::find(arguments.phiw.as_deref(), threads)?;
    for seeds in seeds {
        let Some(NamedValues { name, values }) = &arguments.threshold else {
            run_and_report(arguments, seeds, &robots, &tracer)?;
            continue;
        };
        let mut runs = Vec::new();
        for &value in values {
            tracer.threshold = Some((name.clone(), value));
            runs.push((value, run_and_report(arguments, seeds, &robots, &tracer)?));
        }
        println!("{}", threshold_table::by_value(name, &runs));
    }
    Ok(())
}

/// Runs the cases of one family of seeds, prints the score and writes it.
fn run_and_report(
    arguments: &Arguments,
    seeds: Seeds,
    robots: &[robot::Robot],
    tracer: &tracer::Tracer,
) -> anyhow::Result<Vec<run::Scored>> {
    let specs = specs(arguments, seeds, robots)?;
    let threshold = tracer.threshold.as_ref();
    let threshold = threshold.map_or_else(String::new, |(name, value)| format!("-{name}-{value}"));
    let folder = arguments.out.join(format!("{seeds:?}{threshold}").to_lowercase());
    let outcomes = folder.join("outcomes");
    std::fs::create_dir_all(&outcomes).with_context(|| outcomes.display().to_string())?;
    let options = run::Options {
        jobs: arguments.jobs,
        keep: arguments.keep.as_deref(),
        outcomes: &outcomes,
        resume: arguments.resume,
    };
    let scored = run::run_all(&specs, robots, tracer, &options)?;
    if arguments.case.is_some() {
        for case in &scored {
            println!("{}", serde_json::to_string_pretty(&case.truth)?);
        }
    }
    let score = format!("# Undeclared effects, {seeds:?} seeds\n\n{}", table::markdown(&scored));
    println!("{score}");
    for (name, text) in [("score.md", score), ("cases.csv", table::csv(&scored))] {
        let path = folder.join(name);
        std::fs::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(scored)
}

/// Writes the cases' files and truths, and runs nothing.
fn generate(specs: &[Spec], robots: &[robot::Robot], folder: &std::path::Path) -> anyhow::Result<()> {
    for spec in specs {
        let case = case::Case::draw(spec, robots)
            .with_context(|| format!("no robot can have case {}", spec.seed))?;
        write::write_case(&case, folder)?;
    }
    if let [only] = specs {
        println!("{}", std::fs::read_to_string(folder.join(format!("{}.truth.json", only.seed)))?);
    }
    Ok(())
}

/// Writes right models of the developing seeds, by their numbers from 0 on, each into a folder of its own,
/// and says their seeds and these folders.
///
/// # Errors
/// A case cannot be drawn or written.
pub(crate) fn write_right_models(
    numbers: std::ops::Range<usize>,
    folder: &std::path::Path,
) -> anyhow::Result<Vec<(u64, PathBuf)>> {
    let robots = robot::robots()?;
    let seeds = numbers.map(|index| Suite::WideRight.seed(Seeds::Dev, index));
    let write = |seed: u64| {
        let no_case = || format!("no robot can have case {seed}");
        let spec = Spec::of_seed(seed, robots.len()).with_context(no_case)?;
        let case = case::Case::draw(&spec, &robots).with_context(no_case)?;
        let own = folder.join(seed.to_string());
        write::write_visible(&case, &own)?;
        Ok((seed, own))
    };
    seeds.map(write).collect()
}

fn specs(arguments: &Arguments, seeds: Seeds, robots: &[robot::Robot]) -> anyhow::Result<Vec<Spec>> {
    if let Some(seed) = arguments.case {
        let spec = Spec::of_seed(seed, robots.len())
            .with_context(|| format!("no suite has a case of seed {seed}"))?;
        return Ok(vec![spec]);
    }
    if let Some(name) = &arguments.robot {
        let names: Vec<&str> = robots.iter().map(|robot| robot.name).collect();
        anyhow::ensure!(names.contains(&name.as_str()), "no robot {name:?}; there are {}", names.join(", "));
    }
    let mut specs = Vec::new();
    for &suite in arguments.suite.iter() {
        let wanted = |spec: &Spec| {
            arguments.robot.as_ref().is_none_or(|name| robots[spec.robot].name == name)
                && arguments.situation.is_none_or(|situation| spec.situation == Some(situation))
                && arguments.kind.is_none_or(|kind| spec.secrets.contains(&Name::Catalogue(kind)))
        };
        let full = suite.full_count();
        // With a filter and a count, cases beyond the full run's fill up what the filter takes away.
        let range = if arguments.count.is_some() { 0..100_000 } else { 0..full };
        let each = if arguments.count.is_some() { 0 } else { suite.later_each() };
        let seeds = range.chain(Situation::later_indices(each)).map(|index| suite.seed(seeds, index));
        let found = seeds.filter_map(|seed| Spec::of_seed(seed, robots.len())).filter(wanted);
        specs.extend(found.take(arguments.count.unwrap_or(usize::MAX)));
    }
    Ok(specs)
}
