//! Training logs that are not of one robot.

mod synthetic;

use phiw::console::Console;
use phiw::explain::results;
use phiw::identify::Results;
use phiw_report::json::Verdict;
use std::fs;
use tempfile::TempDir;

/// Explains logs of the right model, viscous friction declared, of which the last is held out; in the second
/// the last link has `tool` times its own mass more.
fn explained(training: usize, tool: f64) -> Results {
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
        let log = synthetic::recording_of_tree(&tree, 50 + index as u64, 30.0);
        fs::write(path(index), synthetic::csv(&log)).unwrap();
    }
    let logs = [(0..training).map(path).collect(), vec![path(training)]];
    let arguments = synthetic::explain_arguments(folder.path(), logs, &["viscous_friction"]);
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
