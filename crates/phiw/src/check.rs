//! `phiw check`: what is in logs, before anything is fitted to them.

mod page;
mod report_json;
mod signals;

use crate::arguments::CheckArguments;
use crate::console::Console;
use crate::log_inputs::{read_map, said_of_logs, sources};
use crate::output::check_folder;
use crate::page::counted;
use crate::warnings::{file_name, of_log, snapped};
use crate::{Error, robot_file, session};
use phiw_dynamics::Tree;
use phiw_identification::checks::{InputError, check_excitation, check_logs, robot_findings};
use phiw_result_folder::{Disk, Lock, ResultFile, check_inputs, replace_folder};
use phiw_telemetry::findings::{CheckSettings, Finding, FindingKind};
use phiw_telemetry::{Survey, TorqueColumns};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Names of the files with the findings: as numbers, and as a page.
const RESULT_FILES: [&str; 2] = ["check.json", "check.html"];

/// What the logs show, with what follows from it.
struct Checked<'a> {
    tree: &'a Tree,
    surveys: &'a [Survey],
    /// Each with its log.
    findings: &'a [(usize, Finding)],
    /// What was read otherwise than it is written, and what a map says.
    notes: &'a [String],
    /// Why no identification would begin.
    refused: &'a [String],
}

/// What was found.
#[derive(Debug)]
pub struct CheckOutcome {
    /// As text for a terminal.
    pub summary: String,
    /// The same as numbers, as in `check.json`.
    pub report: Value,
}

/// Surveys logs and says what sensors, drives and loggers did to them. Findings are answers, not errors.
///
/// # Errors
/// A robot or a log that cannot be read, or results that cannot be written.
pub fn check(arguments: &CheckArguments, console: &Console) -> Result<CheckOutcome, Error> {
    let place = arguments.out.as_deref().map(|folder| take_folder(folder, arguments)).transpose()?;
    let robot = session::read_robot(&arguments.session())?;
    let tree = &robot.tree;
    let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
    let map = read_map(arguments.map.as_deref(), &robot.all_joints())?;
    let mut surveys = Vec::new();
    for source in sources(&arguments.logs, map.as_ref(), &arguments.in_memory) {
        arguments.in_memory.interruption.check()?;
        let mut progress = |done, total| console.progress("surveying", done, total);
        surveys.push(phiw_telemetry::survey(source, &joints, TorqueColumns::Optional, &mut progress)?);
    }
    console.finish();
    let findings = robot_findings(tree, &surveys, &CheckSettings::default());
    let refused = [check_logs(tree, &surveys, &[]).err(), check_excitation(tree, &surveys).err()];
    let refused: Vec<String> = refused.iter().flatten().map(InputError::to_string).collect();
    let mut notes = Vec::from_iter(snapped(robot.snapped));
    notes.extend(robot_file::warning(&robot.left_out));
    notes.extend(map.iter().flat_map(|map| said_of_logs(map, &arguments.logs)));
    let checked = Checked { tree, surveys: &surveys, findings: &findings, notes: &notes, refused: &refused };
    let report = report_json::report(&checked);
    let mut summary = summary(&checked);
    if let Some(place) = &place {
        let drawn = signals::drawn(&checked, &arguments.in_memory.interruption, console)?;
        let [json, html] = RESULT_FILES;
        let text =
            serde_json::to_string_pretty(&report).map_err(|source| Error::Json { file: json, source })?;
        let page = page::page(&checked, &drawn, arguments.command_line()).render();
        replace_folder(&Disk, place, &[ResultFile::new(json, text + "\n"), ResultFile::new(html, page)])?;
        let out = arguments.out.iter().map(|out| out.display().to_string()).collect::<String>();
        let _ = writeln!(summary, "\n{json}, {html} in {out}");
    }
    Ok(CheckOutcome { summary, report })
}

/// Takes the folder for the results: it can be there, none of them is an input, and nobody else writes to it.
fn take_folder(folder: &Path, arguments: &CheckArguments) -> Result<Lock, Error> {
    check_folder(folder)?;
    let inputs: Vec<PathBuf> =
        std::iter::once(&arguments.urdf).chain(&arguments.logs).chain(&arguments.map).cloned().collect();
    check_inputs(&inputs, &RESULT_FILES.map(|name| folder.join(name)))?;
    Ok(Lock::acquire(folder, "phiw check")?)
}

/// One warning for each thing that was found, with the number of logs that show it; without what the
/// identification says or refuses by itself.
pub fn warnings(tree: &Tree, surveys: &[Survey]) -> Vec<String> {
    let findings = robot_findings(tree, surveys, &CheckSettings::default());
    let said_elsewhere = |finding: &Finding| finding.kind == FindingKind::StandsStill;
    let contradicted = |log: usize, finding: &Finding| {
        let joint = finding.column.strip_prefix("qd.");
        surveys[log].joints.iter().any(|survey| {
            Some(survey.name.as_str()) == joint
                && survey.velocity.is_some_and(|velocity| !velocity.is_derivative())
        })
    };
    grouped(&findings)
        .into_iter()
        .filter(|(logs, finding)| !said_elsewhere(finding) && !contradicted(logs[0], finding))
        .map(|(logs, finding)| format!("{}: {finding}", logs_in_words(&logs, surveys)))
        .collect()
}

/// What several logs show alike, once, with those logs.
fn grouped(findings: &[(usize, Finding)]) -> Vec<(Vec<usize>, &Finding)> {
    let mut groups: Vec<(Vec<usize>, &Finding)> = Vec::new();
    for (log, finding) in findings {
        let same = |(_, other): &&mut (Vec<usize>, &Finding)| {
            (other.kind, &other.column) == (finding.kind, &finding.column)
        };
        match groups.iter_mut().find(same) {
            Some((logs, _)) => logs.push(*log),
            None => groups.push((vec![*log], finding)),
        }
    }
    groups
}

fn logs_in_words(logs: &[usize], surveys: &[Survey]) -> String {
    let first = file_name(&surveys[logs[0]].path);
    match logs.len() - 1 {
        0 => first,
        1 => format!("{first} and one log more"),
        more => format!("{first} and {more} logs more"),
    }
}

fn summary(checked: &Checked<'_>) -> String {
    let Checked { surveys, findings, notes, refused, .. } = *checked;
    let mut text = String::new();
    // Writing to a string does not fail.
    for note in notes {
        let _ = writeln!(text, "note: {note}\n");
    }
    for survey in surveys {
        let _ = writeln!(
            text,
            "{}: {} rows, {:.1} s at {:.1} Hz, {}",
            file_name(&survey.path),
            survey.used_rows,
            survey.duration(),
            survey.rate_hz(),
            counted(survey.segments.len(), "segment"),
        );
        for warning in of_log(survey) {
            let _ = writeln!(text, "  {warning}");
        }
    }
    let groups = grouped(findings);
    for (logs, finding) in &groups {
        let _ = writeln!(text, "\n{}: {} {}", logs_in_words(logs, surveys), finding.column, finding.measured);
        let _ = writeln!(text, "  what follows: {}", finding.kind.consequence());
        let _ = writeln!(text, "  what to do:   {}", finding.kind.mend());
    }
    for refused in refused {
        let _ = writeln!(text, "\nno identification would begin: {refused}");
    }
    if groups.is_empty() && refused.is_empty() {
        text.push_str("\nnothing found\n");
    }
    text
}
