//! `check.html`: what the terminal shows, as a page, with each joint's signals over time.

use super::signals::{DrawnJoint, DrawnLog};
use super::{Checked, grouped, logs_in_words};
use crate::date;
use crate::page::counted;
use crate::session::torque_unit;
use crate::warnings::{file_name, of_log};
use phiw_dynamics::JointType;
use phiw_report::number::{percent, significant};
use phiw_report::page::{ExperimentPage, Picture, Section, Table};
use phiw_report::plot::{Line, Polyline, SignalPanel, signal_panel};
use phiw_telemetry::Survey;
use phiw_telemetry::findings::Finding;

/// The whole page.
pub(super) fn page(checked: &Checked<'_>, drawn: &[DrawnLog], command_line: String) -> ExperimentPage {
    let groups = grouped(checked.findings);
    let mut headline = vec![match groups.len() {
        0 => "Nothing found.".to_owned(),
        count => format!("{} in {}.", counted(count, "finding"), counted(checked.surveys.len(), "log")),
    }];
    headline.extend(checked.refused.iter().map(|why| format!("No identification would begin: {why}")));
    let mut sections = vec![logs(checked), findings(checked, &groups)];
    sections
        .extend((0..checked.tree.joint_count()).map(|joint| joint_section(checked, &groups, drawn, joint)));
    sections.retain(|section| !(section.sentences.is_empty() && section.table.rows.is_empty()));
    ExperimentPage {
        title: format!("{} – what is in the logs", checked.tree.name()),
        date: date::now(),
        headline,
        inputs: Vec::new(),
        sections,
        version: format!("phiw {}", env!("CARGO_PKG_VERSION")),
        command_line,
    }
}

/// Rows, rates and gaps.
fn logs(checked: &Checked<'_>) -> Section {
    let head = ["log", "rows", "used", "duration [s]", "rate [Hz]", "jitter [%]", "segments", "gaps"];
    let row = |survey: &Survey| {
        let gaps: Vec<String> =
            survey.gaps.iter().map(|gap| format!("{} × {}", gap.count, gap.reason)).collect();
        vec![
            file_name(&survey.path),
            survey.rows.to_string(),
            survey.used_rows.to_string(),
            significant(survey.duration(), 4),
            significant(survey.rate_hz(), 4),
            percent(survey.jitter),
            survey.segments.len().to_string(),
            gaps.join(", "),
        ]
    };
    let mut notes = checked.notes.to_vec();
    notes.extend(checked.surveys.iter().flat_map(of_log));
    Section {
        title: "Logs".into(),
        table: Table { head: words(&head), rows: checked.surveys.iter().map(row).collect() },
        notes,
        ..Section::default()
    }
}

fn findings(checked: &Checked<'_>, groups: &[(Vec<usize>, &Finding)]) -> Section {
    let head = ["column", "log", "found", "what follows", "what to do"];
    let row = |(logs, finding): &(Vec<usize>, &Finding)| {
        vec![
            finding.column.clone(),
            logs_in_words(logs, checked.surveys),
            finding.measured.clone(),
            finding.kind.consequence().to_owned(),
            finding.kind.mend().to_owned(),
        ]
    };
    Section {
        title: "Findings".into(),
        table: Table { head: words(&head), rows: groups.iter().map(row).collect() },
        ..Section::default()
    }
}

/// What was found of one joint, its ranges and noise in each log, and its signals.
fn joint_section(
    checked: &Checked<'_>,
    groups: &[(Vec<usize>, &Finding)],
    drawn: &[DrawnLog],
    joint: usize,
) -> Section {
    let name = checked.tree.joint(joint).joint.clone();
    let is_its = |finding: &Finding| finding.column.split_once('.').is_some_and(|(_, of)| of == name);
    let sentence = |(logs, finding): &(Vec<usize>, &Finding)| {
        let (consequence, mend) = (finding.kind.consequence(), finding.kind.mend());
        let logs = logs_in_words(logs, checked.surveys);
        format!("{logs}: {finding}. What follows: {consequence}. What to do: {mend}.")
    };
    let [q, tau] = units(checked, joint);
    let head = ["log", "from", "to", "noise", "RMS velocity", "torque from", "to", "RMS", "noise"];
    let unit = ["", q, q, q, &format!("{q}/s"), tau, tau, tau, tau];
    let head = head.iter().zip(unit).map(|(head, unit)| match unit {
        "" => (*head).to_owned(),
        unit => format!("{head} [{unit}]"),
    });
    let row = |survey: &Survey| {
        let of = &survey.joints[joint];
        let torque = of.torque.map(|torque| [torque.min, torque.max, torque.rms, torque.noise_std]);
        let position = [of.q_min, of.q_max, of.position_noise_std, of.velocity_rms];
        let cells = position.map(Some).into_iter().chain(torque.map_or([None; 4], |torque| torque.map(Some)));
        let cell = |value: Option<f64>| value.map_or_else(|| "–".to_owned(), |value| significant(value, 3));
        std::iter::once(file_name(&survey.path)).chain(cells.map(cell)).collect()
    };
    let not_drawn = checked.surveys.len() - drawn.len();
    let notes = (not_drawn > 0).then(|| format!("{} more not drawn", counted(not_drawn, "log")));
    Section {
        sentences: groups.iter().filter(|(_, finding)| is_its(finding)).map(sentence).collect(),
        table: Table { head: head.collect(), rows: checked.surveys.iter().map(row).collect() },
        small: drawn
            .iter()
            .flat_map(|log| {
                pictures(&file_name(&checked.surveys[log.log].path), &log.joints[joint], [q, tau])
            })
            .collect(),
        notes: notes.into_iter().collect(),
        title: name,
        ..Section::default()
    }
}

/// Position, velocity and torque in one log.
fn pictures(log: &str, drawn: &DrawnJoint, [q, tau]: [&str; 2]) -> Vec<Picture> {
    let picture = |line: &Polyline, label: String, what: &str| Picture {
        caption: format!("{log}: {what}"),
        svg: signal_panel(&SignalPanel { line: Line::from(line), label: &label }),
    };
    let velocity = if drawn.velocity_in_log { "velocity" } else { "velocity, from the positions" };
    let mut pictures = vec![
        picture(&drawn.q, format!("q [{q}]"), "position"),
        picture(&drawn.qd, format!("qd [{q}/s]"), velocity),
    ];
    pictures.extend(drawn.tau.as_ref().map(|line| picture(line, format!("tau [{tau}]"), "torque")));
    pictures
}

/// Units of a joint's position and torque.
fn units(checked: &Checked<'_>, joint: usize) -> [&'static str; 2] {
    let is_prismatic = checked.tree.joint(joint).joint_type == JointType::Prismatic;
    [if is_prismatic { "m" } else { "rad" }, torque_unit(checked.tree, joint)]
}

fn words(head: &[&str]) -> Vec<String> {
    head.iter().map(|word| (*word).to_owned()).collect()
}
