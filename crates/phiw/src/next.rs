//! `phiw next`: which motion a real robot should run next, given what has been measured so far.

mod balance;
mod estimate;
mod motions;
mod plan;
mod selection;
mod standing;
mod telling;

use crate::arguments::NextArguments;
use crate::console::Console;
use crate::output::check_file;
use crate::{Error, session};
use estimate::Estimate;
use phiw_curriculum::Robot;
use phiw_effects::Catalogue;
use phiw_result_folder::{Disk, Lock, ResultFile, check_inputs, replace_files};
use standing::Standing;
use std::path::PathBuf;

/// What the command has done.
#[derive(Debug)]
pub struct NextOutcome {
    /// The choice and its reason, as text for a terminal.
    pub summary: String,
    /// What to look at before the robot moves.
    pub warnings: Vec<String>,
    /// The numbers, as they are in the file beside the motion.
    pub report: serde_json::Value,
    /// Where they are.
    pub report_json: PathBuf,
}

/// Chooses the next reference motion, equations (8) to (12) and (20), and writes it as a log with the torques that the present estimate
/// predicts for it; beside it the reason, as JSON.
///
/// Nothing is written before everything has been computed.
///
/// # Errors
/// An input is wrong, no motion is safe, or the results cannot be written: [`Error::exit_status`] tells them apart.
pub fn next(arguments: &NextArguments, console: &Console) -> Result<NextOutcome, Error> {
    check_file(&arguments.out)?;
    let report_json = arguments.out.with_extension("json");
    if report_json == arguments.out {
        return Err(Error::MotionNamedJson { out: arguments.out.clone() });
    }
    let place = Lock::acquire(&arguments.out, "phiw next")?;
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let (tree, xml, findings) = session::read_robot(&arguments.session())?;
    let standing = Standing::read(arguments, &xml)?;
    let motions = motions::read(&arguments.motions, &tree, &progress)?;
    let named = [Some(&arguments.urdf), arguments.support.as_ref(), arguments.model.as_ref()];
    let inputs = named.into_iter().flatten().chain(&arguments.measured).chain(&motions.files).cloned();
    check_inputs(&inputs.collect::<Vec<_>>(), &[arguments.out.clone(), report_json.clone()])?;
    let estimate = Estimate::new(arguments, &tree, &motions, &progress)?;
    let robot = Robot::new(tree, standing.base_link, estimate.model.specs(), Catalogue::default())?;
    let choice = selection::choose(arguments, &robot, &estimate, &standing, &motions.dataset)?;
    let motion = &motions.dataset.motions()[choice.motion];
    let balance = match &standing.stance {
        Some(stance) => Some(balance::of_motion(&robot, &estimate, stance, motion, arguments.urdf_error)?),
        None => None,
    };
    let plan = plan::Plan::new(&estimate, motion)?;
    console.finish();

    let story = telling::Telling {
        arguments,
        robot: &robot,
        motions: &motions,
        estimate: &estimate,
        choice: &choice,
        balance: balance.as_ref(),
        plan: &plan,
        base_mass: standing.base_link[0],
        findings: &findings,
    };
    let report = story.json();
    let json = |source| Error::Json { file: "the report", source };
    let text = serde_json::to_string_pretty(&report).map_err(json)? + "\n";
    let name = |path: &std::path::Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let files = [
        ResultFile::new(name(&report_json), text),
        ResultFile::new(name(&arguments.out), plan.csv(motion, robot.tree())),
    ];
    let folder = place.target().parent().unwrap_or(std::path::Path::new("."));
    replace_files(&Disk, folder, &name(&arguments.out), &files)?;
    Ok(NextOutcome { summary: story.text(&report_json), warnings: story.warnings(), report, report_json })
}
