//! `phiw reduce`: some logs of a plan, each reduced to its factors.

use super::FleetOutcome;
use super::plan::write;
use super::plan_file::Plan;
use crate::console::Console;
use crate::input::regular_file;
use crate::output::check_file;
use crate::page::counted;
use crate::warnings::file_name;
use crate::{Error, fingerprint};
use clap::Args;
use phiw_identification::fitting::{Rests, accumulate_folds};
use phiw_identification::shard::{LogFactors, Shard};
use phiw_identification::{BlockSource, IdentificationError, Progress};
use phiw_residual::trace::poses;
use phiw_result_folder::{Lock, check_inputs};
use phiw_telemetry::LogSource;
use std::path::{Path, PathBuf};

/// Arguments of `phiw reduce`.
#[derive(Clone, Debug, Default, Args)]
pub struct ReduceArguments {
    /// The plan of `phiw plan`.
    #[arg(long, value_name = "PLAN.json")]
    pub plan: PathBuf,
    /// Logs of the plan, wherever they lie on this machine: they are known by their content.
    #[arg(value_name = "LOG", required = true)]
    pub logs: Vec<PathBuf>,
    /// Their factors.
    #[arg(long, value_name = "SHARD.factor")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// Reads some logs of a plan and writes their factors.
///
/// # Errors
/// The plan or a log is wrong, or the factors cannot be written.
pub fn reduce(arguments: &ReduceArguments, console: &Console) -> Result<FleetOutcome, Error> {
    check_file(&arguments.out)?;
    let inputs: Vec<PathBuf> = std::iter::once(&arguments.plan).chain(&arguments.logs).cloned().collect();
    check_inputs(&inputs, std::slice::from_ref(&arguments.out))?;
    let _place = Lock::acquire(&arguments.out, "phiw reduce")?;
    let mut plan = Plan::read(&arguments.plan)?;
    let mut logs: Vec<usize> = Vec::with_capacity(arguments.logs.len());
    let mut paths = Vec::with_capacity(arguments.logs.len());
    for path in &arguments.logs {
        let parts = parts_of(&plan, path, &logs)?;
        paths.extend(parts.iter().map(|_| path));
        logs.extend(parts);
    }
    logs.iter().zip(paths).for_each(|(&log, path)| plan.session.logs.set_path(log, path));
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let reduced = logs.iter().map(|&log| factors(&plan, log, &progress));
    let logs = reduced.collect::<Result<Vec<LogFactors>, IdentificationError>>()?;
    console.finish();
    let bytes = Shard { plan: plan.hash, logs }.encode();
    write(&arguments.out, &bytes)?;
    Ok(FleetOutcome {
        summary: format!(
            "{} of {} in {} ({} bytes)\n",
            counted(arguments.logs.len(), "log"),
            plan.logs.len(),
            arguments.out.display(),
            bytes.len()
        ),
        warnings: Vec::new(),
    })
}

/// Which logs of the plan a file or folder is: what was made of one that has its content and is not `taken`,
/// if there are several the one of its name. A map can make two of one, to fit and to validate on.
fn parts_of(plan: &Plan, path: &Path, taken: &[usize]) -> Result<Vec<usize>, Error> {
    if !path.is_dir() {
        regular_file(path)?;
    }
    let sha256 = fingerprint::sha256(&LogSource::from(path))?;
    let same: Vec<usize> = (0..plan.logs.len()).filter(|&log| plan.logs[log].sha256 == sha256).collect();
    let free: Vec<usize> = same.iter().copied().filter(|log| !taken.contains(log)).collect();
    let name = file_name(path);
    let surveys = plan.session.logs.surveys();
    let of_path = free.iter().find(|&&log| surveys[log].path == path);
    let of_name = free.iter().find(|&&log| plan.logs[log].log == name);
    if let Some(&log) = of_path.or(of_name).or(free.first()) {
        let of_same = |other: &usize| surveys[*other].path == surveys[log].path;
        return Ok(free.into_iter().filter(of_same).collect());
    }
    let log = path.to_owned();
    if !same.is_empty() {
        return Err(Error::LogTwice { log });
    }
    Err(match plan.logs.iter().any(|log| log.log == name) {
        true => Error::LogChanged { log },
        false => Error::NotInPlan { log, logs: plan.logs.len() },
    })
}

/// What the rows of a log bring.
fn factors(plan: &Plan, log: usize, progress: Progress<'_>) -> Result<LogFactors, IdentificationError> {
    let logs = &plan.session.logs;
    let sources = logs.sources(progress);
    let source: [&dyn BlockSource; 1] = [&sources[log]];
    let folds = plan.folds_of(log).concat();
    let folds = accumulate_folds(plan.declared.design(), &folds, &source, Rests::Kept)?;
    let rungs = match &plan.contest {
        Some(contest) if !plan.compared_of(log).is_empty() => {
            contest.factors(&logs.surveys()[log..=log], logs, progress)?
        }
        _ => Vec::new(),
    };
    Ok(LogFactors { log, folds, rungs, poses: poses(&source, logs.surveys().len())? })
}
