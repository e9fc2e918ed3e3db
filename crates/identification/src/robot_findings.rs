//! Findings about logs and robot together that do not end an identification: torques in another unit, joints
//! that no log moves.

use phiw_dynamics::{JointType, Tree};
use phiw_telemetry::Survey;
use phiw_telemetry::findings::{CheckSettings, Finding, FindingKind, findings};

/// Torque over the joint's effort limit from where on it is in another unit: drives exceed their rating
/// threefold for a moment, mA and per mille by more.
const BEYOND_EFFORT: f64 = 10.0;

/// What should be known of the logs of a robot before anything is fitted: of each log, by its place, what
/// [`findings`] says, less joints that stand still in one log but move in another.
pub fn robot_findings(tree: &Tree, surveys: &[Survey], settings: &CheckSettings) -> Vec<(usize, Finding)> {
    let mut all = Vec::new();
    for (log, survey) in surveys.iter().enumerate() {
        all.extend(findings(survey, settings).into_iter().map(|finding| (log, finding)));
        for (index, joint) in survey.joints.iter().enumerate().take(tree.joint_count()) {
            let body = tree.joint(index);
            let largest = joint.torque.map_or(0.0, |torque| torque.min.abs().max(torque.max.abs()));
            let unit = if body.joint_type == JointType::Prismatic { "N" } else { "N·m" };
            all.extend(torque_unit(largest, body.limits.effort, unit).map(|measured| {
                (
                    log,
                    Finding {
                        kind: FindingKind::TorqueUnit,
                        column: format!("tau.{}", joint.name),
                        measured,
                    },
                )
            }));
        }
    }
    let stands_still = |column: &str, found: &[(usize, Finding)]| {
        let here =
            |(_, other): &&(usize, Finding)| other.kind == FindingKind::StandsStill && other.column == column;
        found.iter().filter(here).count() == surveys.len()
    };
    let keep: Vec<bool> = all
        .iter()
        .map(|(_, finding)| finding.kind != FindingKind::StandsStill || stands_still(&finding.column, &all))
        .collect();
    all.into_iter().zip(keep).filter(|(_, keep)| *keep).map(|(finding, _)| finding).collect()
}

/// Whether a torque's largest magnitude is in another unit than the joint's effort limit, and how.
fn torque_unit(largest: f64, effort: f64, unit: &str) -> Option<String> {
    if !(effort.is_finite() && effort > 0.0 && largest > 0.0) {
        return None;
    }
    let ratio = largest / effort;
    // A torque far below the limit is not reported: many URDFs have a limit of 1000 where it is unknown.
    (ratio > BEYOND_EFFORT).then(|| {
        format!("reaches {largest:.4}, {ratio:.2e} times the URDF's effort limit of {effort} {unit}")
    })
}

#[cfg(test)]
mod tests {
    use super::torque_unit;

    #[test]
    fn torques_beyond_the_effort_limit_are_in_another_unit() {
        for (largest, effort, odd) in [
            (80.0, 100.0, false),
            (350.0, 100.0, false),
            (0.5, 100.0, false),
            (2500.0, 3.0, true),
            (0.05, 100.0, false),
            (2500.0, f64::INFINITY, false),
            (2500.0, 0.0, false),
        ] {
            assert_eq!(torque_unit(largest, effort, "N·m").is_some(), odd, "{largest} of {effort}");
        }
    }
}
