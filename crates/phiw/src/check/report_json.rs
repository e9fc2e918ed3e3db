//! `check.json`: what the terminal shows, as numbers.

use super::Checked;
use crate::warnings::of_log;
use phiw_telemetry::Survey;
use phiw_telemetry::findings::Finding;
use phiw_telemetry::joint_survey::JointSurvey;
use serde_json::{Value, json};

/// The content of the file. A number that is not known is `null`.
pub(super) fn report(checked: &Checked<'_>) -> Value {
    let finding = |(log, finding): &(usize, Finding)| {
        json!({
            "log": checked.surveys[*log].path.display().to_string(),
            "kind": finding.kind.name(),
            "column": finding.column,
            "measured": finding.measured,
            "consequence": finding.kind.consequence(),
            "mend": finding.kind.mend(),
        })
    };
    json!({
        "schema": 1,
        "robot": checked.tree.name(),
        "logs": checked.surveys.iter().map(log).collect::<Vec<_>>(),
        "findings": checked.findings.iter().map(finding).collect::<Vec<_>>(),
        "notes": checked.notes,
        "refused": checked.refused,
    })
}

fn log(survey: &Survey) -> Value {
    let gaps: Vec<Value> = survey
        .gaps
        .iter()
        .map(|gap| json!({"reason": gap.reason.to_string(), "count": gap.count, "first": gap.first_line}))
        .collect();
    json!({
        "log": survey.path.display().to_string(),
        "rows": survey.rows,
        "used_rows": survey.used_rows,
        "rows_are": survey.rows_are,
        "seconds": survey.duration(),
        "rate_hz": survey.rate_hz(),
        "jitter": survey.jitter,
        "clock": survey.clock.to_string(),
        "segments": survey.segments.len(),
        "gaps": gaps,
        "joints": survey.joints.iter().map(joint).collect::<Vec<_>>(),
        "warnings": of_log(survey),
    })
}

/// Ranges and noise in rad, m, rad/s, m/s, N·m and N.
fn joint(joint: &JointSurvey) -> Value {
    let torque = joint.torque.map(|torque| {
        json!({"min": torque.min, "max": torque.max, "rms": torque.rms, "noise_std": torque.noise_std})
    });
    json!({
        "joint": joint.name,
        "q": {"min": joint.q_min, "max": joint.q_max, "noise_std": joint.position_noise_std},
        "qd": {"rms": joint.velocity_rms, "in_log": joint.velocity.is_some()},
        "tau": torque,
    })
}
