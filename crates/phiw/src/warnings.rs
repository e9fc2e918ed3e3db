//! What a reader should know before trusting a number.

use crate::robot_file;
use crate::session::Session;
use phiw_identification::fitting::{HeldOutChange, LogChange};
use phiw_identification::{EffectSpec, Identified};
use phiw_report::number::significant;
use phiw_telemetry::segments::GapReason;
use phiw_telemetry::{Payload, Survey};
use std::path::Path;

/// All warnings: about the logs and the URDF, then about the fit.
pub fn all(session: &Session, identified: &Identified) -> Vec<String> {
    let logs = &session.logs;
    let mut warnings: Vec<String> = logs
        .same_files()
        .into_iter()
        .map(|(train, validate)| {
            format!(
                "{} and {} have the same content: the error on it is not one on motion that the model has not seen; hold out another log",
                train.display(),
                validate.display()
            )
        })
        .collect();
    warnings.extend(snapped(session.snapped));
    warnings.extend(robot_file::warning(&session.left_out));
    warnings.extend(twice_in_training(logs.training()));
    warnings.extend(logs.surveys().iter().flat_map(of_log));
    warnings.extend(crate::check::warnings(&session.tree, logs.surveys()));
    if identified.fit.standard_deviations.iter().all(|std| std.is_nan()) {
        warnings.push(
            "standard deviations could not be estimated: without one twelfth of the training motion some \
             parameter is not determined at all; record more motion"
                .to_owned(),
        );
    }
    if identified.fit.is_drawn {
        warnings.push(
            "the training motion tells some parameters too poorly: left out, a stretch of it was \
             foretold worse than by no model at all, and all parameters are drawn to nothing, as much as \
             foretells such stretches best; move several joints together in training, or record more \
             motion"
                .to_owned(),
        );
    }
    warnings.extend(worse_than_none(session, identified));
    warnings
}

/// Where the motion held out asks for parameters that the training motion does not tell.
fn worse_than_none(session: &Session, identified: &Identified) -> Option<String> {
    let error = &identified.held_out;
    let ratio = |joint: usize| error.rmse[joint] / error.rms_torque[joint];
    let joints: Vec<String> = error
        .torques_worse_than_none()
        .map(|joint| {
            format!("{} {} times its torque", session.tree.joint(joint).joint, significant(ratio(joint), 2))
        })
        .collect();
    (!joints.is_empty()).then(|| {
        format!(
            "on the motion held out the model is worse than none (error: {}): that motion asks for \
             parameters that the training motion does not tell; move each joint more often in training, \
             and several together",
            joints.join(", ")
        )
    })
}

/// The number of angles and axes of a URDF that were made exact, if there were any.
pub fn snapped(count: usize) -> Option<String> {
    let values = match count {
        0 => return None,
        1 => "1 angle or axis of the URDF is a right angle but for its rounding, and is".to_owned(),
        count => {
            format!("{count} angles or axes of the URDF are right angles but for their rounding, and are")
        }
    };
    Some(format!(
        "{values} taken as exact (within 1e-4 rad): as written, parameters would look identifiable that are not; write π/2 as 1.5707963267948966"
    ))
}

/// Joints that do not move in what is held out: an error of zero there means nothing.
pub fn at_rest_where_held_out(session: &Session, joints: &[usize]) -> Option<String> {
    let names: Vec<String> =
        joints.iter().map(|&joint| format!("`{}`", session.tree.joint(joint).joint)).collect();
    (!names.is_empty()).then(|| {
        format!(
            "{} does not move in what is held out ({}): nothing is known of the model's error there; hold out a log in which it moves",
            names.join(", "),
            session.logs.held_out_in_words()
        )
    })
}

/// Joints whose error says that the motion held out is another robot's, or of another kind.
pub fn changed_where_held_out(session: &Session, changes: &[HeldOutChange]) -> Option<String> {
    let joint = |change: &HeldOutChange| {
        let name = &session.tree.joint(change.row).joint;
        format!("{name} {} times", significant(change.ratio, 2))
    };
    let joints: Vec<String> = changes.iter().map(joint).collect();
    (!joints.is_empty()).then(|| {
        format!(
            "what is held out ({}) is of another robot than the training logs (a tool, a repair, another zero), or of \
             motion unlike theirs (much faster): its error is many times what training motion lets expect ({}); to \
             see what changed, hold the model on it: phiw explain --model model.json --train LOG",
            session.logs.held_out_in_words(),
            joints.join(", ")
        )
    })
}

/// That the training log `odd` tells otherwise than all together, by the torques that say so most.
pub fn of_another_robot(session: &Session, odd: usize, changes: &[LogChange]) -> Option<String> {
    let joint = |change: &LogChange| {
        let name = &session.tree.joint(change.row).joint;
        format!("{name} {} times", significant(change.ratio, 2))
    };
    let own = changes.iter().filter(|change| change.log == odd);
    let joints: Vec<String> = own.take(JOINTS_NAMED).map(joint).collect();
    let name = file_name(&session.logs.training().get(odd)?.path);
    Some(format!(
        "the training logs do not tell of one robot (a tool, a repair, a warmer drive), or the model lacks what one \
         of them shows: the model of all leaves of {name} many times what a model of its own leaves ({}); to see \
         what differs, leave it out, and hold the model of the others on it: phiw explain --model model.json \
         --train {name}",
        joints.join(", ")
    ))
}

/// Joints that a warning of many names.
const JOINTS_NAMED: usize = 3;

/// What is said where motion held out decided what is in the model.
pub fn held_out_had_a_say(left_out: &[EffectSpec]) -> String {
    let named = match left_out {
        [] => String::new(),
        some => format!(" ({})", some_of(some)),
    };
    format!(
        "of what the training logs alone would have chosen, something made the error on the motion held out larger \
         and was left out{named}: the error after is not blind, and training logs with more kinds of motion would help"
    )
}

/// What is said where motion held out told how effects are from log to log; nothing of none.
pub fn told_by_held_out(effects: &[EffectSpec]) -> Option<String> {
    (!effects.is_empty()).then(|| {
        format!(
            "whether the robot was cold again before each log can not be told from one training log: motion held out has \
             told it ({}), and the error after is not blind to that; a second training log would tell",
            some_of(effects)
        )
    })
}

/// Kinds and joints of the first effects, and how many more there are.
fn some_of(effects: &[EffectSpec]) -> String {
    let mut named: Vec<String> =
        effects.iter().map(|spec| format!("{} of {}", spec.kind, spec.joints.join("+"))).collect();
    let more = named.len().saturating_sub(MOST_NAMED);
    named.truncate(MOST_NAMED);
    if more > 0 {
        named.push(format!("{more} more"));
    }
    named.join(", ")
}

/// Effects that a warning names.
const MOST_NAMED: usize = 6;

/// File name of a log.
pub fn file_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

fn twice_in_training(training: &[Survey]) -> Vec<String> {
    let pairs =
        training.iter().enumerate().flat_map(|(index, a)| training[index + 1..].iter().map(move |b| (a, b)));
    let same = pairs.filter(|(a, b)| a.content_hash == b.content_hash);
    same.map(|(a, b)| {
        format!(
            "{} and {} have the same content: its samples count twice",
            a.path.display(),
            b.path.display()
        )
    })
    .collect()
}

/// Ignored columns that a warning names; a log can have thousands.
const COLUMNS_NAMED: usize = 10;

/// Skipped rows, jumps, short stretches, unknown columns.
pub fn of_log(survey: &Survey) -> Vec<String> {
    let (name, rows_are) = (file_name(&survey.path), survey.rows_are);
    let gap = |gap: &phiw_telemetry::segments::GapCount| {
        let (count, line) = (gap.count, gap.first_line);
        let rows = if count == 1 { "row" } else { "rows" };
        Some(match gap.reason {
            GapReason::TimeJump if count == 1 => {
                format!("{name}: time jumps at {rows_are} {line}; the log is split there")
            }
            GapReason::TimeJump => {
                format!(
                    "{name}: time jumps {count} times, first at {rows_are} {line}; the log is split there"
                )
            }
            GapReason::Spike => {
                let columns: Vec<String> = survey
                    .spikes
                    .iter()
                    .map(|spike| {
                        format!(
                            "{} ({} first at {rows_are} {})",
                            spike.column, spike.samples, spike.first_line
                        )
                    })
                    .collect();
                format!(
                    "{name}: {count} {rows} with a spike left out: {}; the log is split there",
                    columns.join(", ")
                )
            }
            // `check` says these, with what follows from them.
            GapReason::Held | GapReason::ZeroRow => return None,
            // The trace that has found them says these.
            GapReason::Disturbed => return None,
            GapReason::LeftOut => format!("{name}: {count} {rows} left out by the map"),
            reason => format!(
                "{name}: {count} {rows} skipped ({reason}), first at {rows_are} {line}; the log is split there"
            ),
        })
    };
    let mut warnings: Vec<String> = survey.notes.iter().map(|note| format!("{name}: {note}")).collect();
    if let Some(Payload::Known { link, mass_kg, .. }) = survey.source.facts().payload {
        warnings.push(format!(
            "{name}: the torques of a payload of {mass_kg} kg at `{link}`, a point mass, are taken off those that were measured"
        ));
    }
    warnings.extend(survey.gaps.iter().filter_map(gap));
    if survey.short_segments > 0 {
        warnings
            .push(format!("{name}: {} stretches between gaps are too short to use", survey.short_segments));
    }
    for joint in &survey.joints {
        let contradicts =
            |column: &str, derivative: &Option<phiw_telemetry::joint_survey::DerivativeSurvey>| {
                let derivative = derivative.filter(|derivative| !derivative.is_derivative())?;
                let how = match derivative.agreement.is_finite() && derivative.min < derivative.max {
                    true => format!("their derivative is {:.3} times as large", derivative.agreement),
                    false => "it is constant".to_owned(),
                };
                Some(format!(
                    "{name}: {column}.{} contradicts the positions ({how}): it is not used, positions are differentiated",
                    joint.name
                ))
            };
        warnings.extend(contradicts("qd", &joint.velocity));
        warnings.extend(contradicts("qdd", &joint.acceleration));
    }
    if !survey.ignored_columns.is_empty() {
        let ignored = &survey.ignored_columns;
        let mut quoted: Vec<String> =
            ignored.iter().take(COLUMNS_NAMED).map(|column| format!("`{column}`")).collect();
        if ignored.len() > COLUMNS_NAMED {
            quoted.push(format!("and {} more", ignored.len() - COLUMNS_NAMED));
        }
        let columns = if ignored.len() == 1 { "column is" } else { "columns are" };
        warnings.push(format!("{name}: unknown {columns} ignored: {}", quoted.join(", ")));
    }
    warnings
}
