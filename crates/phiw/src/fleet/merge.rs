//! `phiw identify --plan --factors`: the factors of all logs of a plan, fitted.

use super::plan_file::Plan;
use crate::analysis::{Analysis, Rows};
use crate::argument_values::quoted;
use crate::console::Console;
use crate::identify::{Outcome, outputs};
use crate::output::take_folder;
use crate::possible_bodies::PossibleBodies;
use crate::report_json::report_json;
use crate::{Error, page, summary};
use phiw_identification::bandwidth::Bandwidth;
use phiw_identification::fitting::FoldFactors;
use phiw_identification::shard::{LogFactors, Shard};
use phiw_limits::Limits;
use phiw_result_folder::{Disk, replace_folder};
use std::path::{Path, PathBuf};

/// Arguments of `phiw identify --plan`.
#[derive(Clone, Debug, Default)]
pub struct MergeArguments {
    /// The plan of `phiw plan`.
    pub plan: PathBuf,
    /// The factors of all of its logs, as `phiw reduce` has written them.
    pub factors: Vec<PathBuf>,
    /// Folder for the results.
    pub out: PathBuf,
}

impl MergeArguments {
    fn command_line(&self) -> String {
        let word = |path: &PathBuf| quoted(&path.display().to_string());
        let factors: Vec<String> = self.factors.iter().map(word).collect();
        format!(
            "phiw identify --plan {} --factors {} --out {}",
            word(&self.plan),
            factors.join(" "),
            word(&self.out)
        )
    }
}

/// [`identify`](crate::identify::identify()) from the factors of a plan's logs: the same files, but for the
/// page's pictures over time.
///
/// # Errors
/// The plan or a file of factors is wrong, a log is missing or there twice, or the results cannot be written.
pub fn merge(arguments: &MergeArguments, console: &Console) -> Result<Outcome, Error> {
    let inputs: Vec<PathBuf> = std::iter::once(&arguments.plan).chain(&arguments.factors).cloned().collect();
    let place = take_folder(&arguments.out, &inputs, "phiw identify")?;
    let plan = Plan::read(&arguments.plan)?;
    let logs = read_factors(&plan, &arguments.factors, console)?;
    let bandwidth = bandwidth_of(&plan, &logs)?;
    let (folds, train, poses) = in_order(&plan, logs);
    let Plan { session, declared, logs: fingerprints, .. } = plan;
    let (identified, at_rest) =
        declared.identified(folds, train).map_err(|error| session.of_training_logs(error))?;
    let rows = Rows::Reduced { fingerprints: &fingerprints, poses: &poses };
    let (identified, possible) = PossibleBodies::settle(&session, identified, None)?;
    let with_rests = at_rest.added_to(&identified)?;
    let analysis = Analysis::new(&session, rows, &identified, possible, Some(with_rests))?;
    let analysis = analysis.with_bandwidth(bandwidth).with_logs_compared()?;
    console.finish();

    let report = report_json(&analysis);
    let mut page = page::page(&analysis, arguments.command_line());
    page.headline.push(format!("{WITHOUT_ROWS} The logs were reduced apart."));
    let files = outputs(&analysis, &report, page.render())?;
    replace_folder(&Disk, &place, &files)?;
    Ok(Outcome {
        summary: summary::summary(&analysis, &arguments.out, &files) + WITHOUT_ROWS + "\n",
        warnings: analysis.warnings,
        report_html: arguments.out.join("report.html"),
        report,
    })
}

/// What the page lacks.
const WITHOUT_ROWS: &str =
    "Torques over time are not shown: factors hold no rows. Use phiw predict on a log to see them.";

/// The factors of each log, in the order of the plan.
fn read_factors(plan: &Plan, paths: &[PathBuf], console: &Console) -> Result<Vec<LogFactors>, Error> {
    let mut logs: Vec<Option<(LogFactors, &Path)>> = plan.logs.iter().map(|_| None).collect();
    for (done, path) in paths.iter().enumerate() {
        console.progress("reading factors", done as u64, paths.len() as u64);
        let bytes = crate::input::read_bytes(path, Limits::default().factor_file_bytes)?;
        let shard = |source| Error::Shard { path: path.clone(), source };
        for log in Shard::decode(&bytes, &plan.hash, plan.columns()).map_err(shard)?.logs {
            let expected = plan.folds_of(log.log).concat().len();
            let rungs: Vec<usize> = log.rungs.iter().map(Vec::len).collect();
            if log.log >= logs.len()
                || log.folds.moving.len() != expected
                || rungs != plan.compared_of(log.log)
            {
                return Err(shard(phiw_identification::shard::ShardError::OtherColumns));
            }
            let place = &mut logs[log.log];
            if let Some((_, first)) = place {
                let log = plan.name_of(log.log);
                return Err(Error::FactorsTwice { log, first: first.to_path_buf(), second: path.clone() });
            }
            *place = Some((log, path));
        }
    }
    let missing: Vec<String> =
        (0..logs.len()).filter(|&log| logs[log].is_none()).map(|log| plan.name_of(log)).collect();
    if !missing.is_empty() {
        return Err(Error::FactorsMissing { logs: missing });
    }
    Ok(logs.into_iter().flatten().map(|(log, _)| log).collect())
}

/// What other cut-offs would do.
fn bandwidth_of(plan: &Plan, logs: &[LogFactors]) -> Result<Option<Bandwidth>, Error> {
    let Some(contest) = &plan.contest else { return Ok(None) };
    let of_rung =
        |rung: usize| Ok(logs.iter().filter_map(|log| log.rungs.get(rung)).flatten().cloned().collect());
    Ok(contest.judged(of_rung)?)
}

/// The factors of all folds, those to fit first, their number, and all poses.
fn in_order(plan: &Plan, logs: Vec<LogFactors>) -> (FoldFactors, usize, Vec<f64>) {
    let (mut train, mut held_out) = (FoldFactors::default(), FoldFactors::default());
    let mut poses = Vec::new();
    for mut log in logs {
        let [to_fit, _] = plan.folds_of(log.log);
        held_out.moving.extend(log.folds.moving.split_off(to_fit.len()));
        held_out.at_rest.extend(log.folds.at_rest.split_off(to_fit.len()));
        train.moving.append(&mut log.folds.moving);
        train.at_rest.append(&mut log.folds.at_rest);
        poses.append(&mut log.poses);
    }
    let count = train.moving.len();
    train.moving.append(&mut held_out.moving);
    train.at_rest.append(&mut held_out.at_rest);
    (train, count, poses)
}
