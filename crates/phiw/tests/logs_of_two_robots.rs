//! Training logs that are not of one robot.

use crate::synthetic;

use phiw::console::Console;
use phiw::explain::results;
use phiw::identify::Results;
use phiw_report::json::Verdict;
use phiw_telemetry::Recording;
use std::fs;
use tempfile::TempDir;

/// Explains logs of the right model, viscous friction declared, of which the last is held out; in the second
/// the last link has `tool` times its own mass more.
fn explained(training: usize, tool: f64) -> Results {
    explained_after(training, tool, |_, _| ())
}

/// The same logs, each changed by `change`, which is told its number.
fn explained_after(training: usize, tool: f64, change: impl Fn(usize, &mut Recording)) -> Results {
    explained_from(&["viscous_friction"], training, tool, change)
}

/// The same from what is `declared`.
fn explained_from(
    declared: &[&str],
    training: usize,
    tool: f64,
    change: impl Fn(usize, &mut Recording),
) -> Results {
    let folder = TempDir::new().unwrap();
    let path = |index: usize| folder.path().join(format!("log_{index}.csv"));
    fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
    for index in 0..=training {
        let mut tree = synthetic::tree();
        if index == 1 {
            let mut parameters = tree.inertial_parameters();
            let last = parameters.len() - 10;
            parameters[last..].iter_mut().for_each(|own| *own *= 1.0 + tool);
            tree.set_inertial_parameters(&parameters).unwrap();
        }
        let mut log = synthetic::recording_of_tree(&tree, 50 + index as u64, 30.0);
        change(index, &mut log);
        fs::write(path(index), synthetic::csv(&log)).unwrap();
    }
    let logs = [(0..training).map(path).collect(), vec![path(training)]];
    let arguments = synthetic::explain_arguments(folder.path(), logs, declared);
    results(&arguments, &Console::silent()).unwrap()
}

/// The sentence about robots that differ, if there is one.
fn said(found: &Results) -> Option<&String> {
    found.warnings.iter().find(|warning| warning.contains("do not tell of one robot"))
}

#[test]
fn logs_that_differ_are_said_and_leave_structure() {
    let found = explained(2, 2.0);
    let warning = said(&found).unwrap();
    assert!(
        warning.contains("log_1.csv") && warning.contains("phiw explain --model model.json"),
        "{warning}"
    );
    let differs =
        found.warnings.iter().find(|warning| warning.contains("differs from the other training logs"));
    assert!(
        differs.unwrap().contains("log_1.csv") && differs.unwrap().contains("payload of joint_3"),
        "{differs:?}"
    );
    let verdict = found.report.verdict.unwrap();
    assert!(matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained), "{verdict:?}");
    let remaining = &found.report.remaining;
    assert!(remaining.structured, "{remaining:?}");
}

/// A log differed by the frictions of all joints, which all logs have: the model of the others had what was
/// declared, and not what was found.
#[test]
fn what_all_logs_have_and_nobody_declared_is_no_difference() {
    let found = explained_from(&[], 2, 2.0, |_, _| ());
    let friction = found.report.effects.iter().find(|effect| effect.kind == "viscous_friction");
    assert!(friction.is_some(), "{:?}", found.report.effects);
    let mut warnings = found.warnings.iter();
    let differs = warnings.find(|warning| warning.contains("differs from the other training logs")).unwrap();
    assert!(differs.contains("payload of joint_3") && !differs.contains("friction"), "{differs}");
}

#[test]
fn logs_of_one_robot_are_not() {
    let found = explained(2, 0.0);
    assert_eq!(said(&found), None);
    assert_eq!(found.report.verdict, Some(Verdict::Sufficient));
}

/// Of three logs one that is of another robot can be told: a saturation had a name of the model of all three,
/// and the log that was said to differ was not always the one with the tool.
#[test]
fn one_of_three_logs_with_a_tool_is_left_out_and_its_tool_is_weighed() {
    let found = explained(3, 2.0);
    let left_out = |found: &[String]| {
        found
            .iter()
            .find(|warning| warning.contains("is not of the robot of the other training logs"))
            .cloned()
    };
    let warning = left_out(&found.warnings).unwrap();
    assert!(
        warning.starts_with("log_1.csv") && warning.contains("it differs by payload of joint_3"),
        "{warning}"
    );
    assert_eq!(said(&found), None);
    assert_eq!(found.report.verdict, Some(Verdict::Sufficient));

    let found = explained(3, 0.0);
    assert_eq!(left_out(&found.warnings), None);
    assert_eq!(said(&found), None);
    assert_eq!(found.report.verdict, Some(Verdict::Sufficient));
}

/// A log whose torques have another zero was left out, and so was the last of three in which frictions warm
/// up.
#[test]
fn zeros_of_torques_and_frictions_that_warm_up_are_no_other_robot() {
    let zeros = |index: usize, log: &mut Recording| {
        if index == 1 {
            log.tau.iter_mut().for_each(|torque| *torque += 0.5);
        }
    };
    let warms_up = |index: usize, log: &mut Recording| {
        log.t.iter_mut().for_each(|t| *t += 40.0 * index as f64);
        let joints = log.joints.len();
        for row in 1..log.t.len() {
            let cold = 0.6 * (-log.t[row] / 40.0).exp();
            for joint in row * joints..(row + 1) * joints {
                let speed = (log.q[joint] - log.q[joint - joints]) / (log.t[row] - log.t[row - 1]);
                log.tau[joint] += cold * (speed / 0.05).tanh();
            }
        }
    };
    for found in [explained_after(3, 0.0, zeros), explained_after(3, 0.0, warms_up)] {
        let other = found.warnings.iter().find(|warning| warning.contains("is not of the robot"));
        assert_eq!(other, None);
    }
}
