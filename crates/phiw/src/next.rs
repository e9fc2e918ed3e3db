//! `phiw next`: which motion a real robot should run next, given what has been measured so far.

mod controlled;
mod estimate;
pub(crate) mod motions;
mod plan_file;
mod standing;
mod telling;

use crate::arguments::{NextArguments, NextSelection};
use crate::console::Console;
use crate::output::check_file;
use crate::{Error, robot_file, session};
use estimate::Present;
use phiw_curriculum::constraint::{Constraint, FalseFalls, MotionMargin, Unconstrained, ZmpConstraint};
use phiw_curriculum::planner::{Belief, MeasuredSoFar, Plan, Policy, plan};
use phiw_curriculum::relaxation::{ConditionRelaxation, ConstantReduction, Relaxation};
use phiw_curriculum::selection::{Selection, SmallestCondition, TorqueOptimalPerSecond};
use phiw_curriculum::{CurriculumError, CurriculumSettings};
use phiw_result_folder::{Disk, Lock, ResultFile, check_inputs, replace_files};
use standing::Standing;
use std::path::{Path, PathBuf};

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

/// Chooses the next reference motion, equations (8) to (12) and (20), and writes it as a log with the torques
/// that the present estimate predicts for it; beside it the reason, as JSON.
///
/// Nothing is written before everything has been computed.
///
/// # Errors
/// An input is wrong, no motion is safe, or the results cannot be written: [`Error::exit_status`] tells them
/// apart.
pub fn next(arguments: &NextArguments, console: &Console) -> Result<NextOutcome, Error> {
    check_file(&arguments.out)?;
    let report_json = arguments.out.with_extension("json");
    if report_json == arguments.out {
        return Err(Error::MotionNamedJson { out: arguments.out.clone() });
    }
    let place = Lock::acquire(&arguments.out, "phiw next")?;
    let Chosen { files, summary, warnings, report } = chosen(arguments, console)?;
    let folder = place.target().parent().unwrap_or(Path::new("."));
    replace_files(&Disk, folder, &file_name(&arguments.out), &files)?;
    Ok(NextOutcome { summary, warnings, report, report_json })
}

/// What was chosen, before anything is written.
pub struct Chosen {
    /// The report and the motion.
    pub files: [ResultFile; 2],
    /// The choice and its reason, as text for a terminal.
    pub summary: String,
    /// What to look at before the robot moves.
    pub warnings: Vec<String>,
    /// The numbers.
    pub report: serde_json::Value,
}

/// Chooses as [`next`] does, and writes nothing.
///
/// # Errors
/// An input is wrong, or no motion is safe.
pub fn chosen(arguments: &NextArguments, console: &Console) -> Result<Chosen, Error> {
    let report_json = arguments.out.with_extension("json");
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let session::RobotOfUrdf { tree, xml, findings, held, left_out, .. } =
        session::read_robot(&arguments.session())?;
    let standing = Standing::read(arguments, &xml, &held)?;
    let motions = motions::read(&arguments.motions, &tree, &progress)?.with_slower(&arguments.slower)?;
    let named = [Some(&arguments.urdf), arguments.support.as_ref(), arguments.model.as_ref()];
    let inputs = named.into_iter().flatten().chain(&arguments.measured).chain(&motions.files).cloned();
    check_inputs(&inputs.collect::<Vec<_>>(), &[arguments.out.clone(), report_json.clone()])?;
    let present = Present::new(arguments, &tree, standing.base_link, &motions, &progress)?;
    let plan = planned(arguments, &present, &standing, &motions)?;
    let motion = &motions.dataset.motions()[plan.choice.motion];
    let Present { robot, model, estimate, prior, .. } = &present;
    let margin = |stance| MotionMargin::of_motion(robot, model, estimate, prior, stance, motion);
    let balance = standing.stance.as_ref().map(margin).transpose()?;
    let torque = motion.torques(&present.design, &estimate.parameters)?;
    console.finish();

    let story = telling::Telling {
        arguments,
        motions: &motions,
        present: &present,
        plan: &plan,
        balance: balance.as_ref(),
        torque: &torque,
        base_mass: standing.base_link[0],
        findings: &findings,
    };
    let report = story.json();
    let json = |source| Error::Json { file: "the report", source };
    let text = serde_json::to_string_pretty(&report).map_err(json)? + "\n";
    let files = [
        ResultFile::new(file_name(&report_json), text),
        ResultFile::new(file_name(&arguments.out), plan_file::csv(motion, &torque, robot.tree())),
    ];
    let warnings = robot_file::warning(&left_out).into_iter().chain(story.warnings()).collect();
    Ok(Chosen { files, summary: story.text(&report_json), warnings, report })
}

fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// How what is not known counts in the constraint; none where it does not.
fn false_falls(arguments: &NextArguments) -> Option<FalseFalls> {
    let default = FalseFalls::default();
    arguments.false_fall_rate.map(|rate| FalseFalls {
        rate,
        belief_share: arguments.urdf_error,
        base_link_share: arguments.base_error.unwrap_or(arguments.urdf_error),
        control_period_s: arguments.command_hz.map_or(default.control_period_s, f64::recip),
        ..default
    })
}

/// The curriculum's plan with the policy for a real robot.
fn planned(
    arguments: &NextArguments,
    present: &Present,
    standing: &Standing,
    motions: &motions::Motions,
) -> Result<Plan, Error> {
    let constraint: Box<dyn Constraint> = match &standing.stance {
        Some(stance) => {
            let constraint = ZmpConstraint::new(stance.clone());
            Box::new(match false_falls(arguments) {
                Some(false_falls) => constraint.counting(false_falls),
                None => constraint,
            })
        }
        None => Box::new(Unconstrained),
    };
    let relaxation: Box<dyn Relaxation> = match arguments.alpha {
        Some(alpha) => Box::new(ConstantReduction(alpha)),
        None => Box::new(ConditionRelaxation::default()),
    };
    let selection: &dyn Selection = match arguments.selection {
        NextSelection::TorquePerSecond => &TorqueOptimalPerSecond,
        NextSelection::Condition => &SmallestCondition,
    };
    let CurriculumSettings { none_allowed, rivalry_period_s, .. } = CurriculumSettings::default();
    let belief = Belief {
        robot: &present.robot,
        dataset: &motions.dataset,
        candidates: &present.candidates,
        model: &present.model,
        certainty: present.certainty.as_ref(),
        initial: &present.prior.model,
        rivalry: None,
    };
    let measured = MeasuredSoFar {
        triangle: present.triangle.as_ref(),
        condition_numbers: &present.condition_numbers,
        ..MeasuredSoFar::default()
    };
    let policy = Policy {
        selection,
        constraint: constraint.as_ref(),
        relaxation: relaxation.as_ref(),
        none_allowed,
        rivalry_period_s,
        seed: 0,
    };
    plan(&belief, &measured, &policy).map_err(|error| match error {
        error @ (CurriculumError::NothingSafe { .. } | CurriculumError::FellOnAll { .. }) => {
            Error::Refused(error)
        }
        error => error.into(),
    })
}
