//! Training logs that are not of one robot.

mod synthetic;

use phiw::console::Console;
use phiw::explain::results;
use phiw::identify::Results;
use phiw_report::json::Verdict;
use std::fs;
use tempfile::TempDir;

/// Explains three logs of the right model, viscous friction declared; in the second the last link has `tool`
/// times its own mass more.
fn explained(tool: f64) -> Results {
    let folder = TempDir::new().unwrap();
    let path = |index: usize| folder.path().join(format!("log_{index}.csv"));
    fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
    for index in 0..3 {
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
    let logs = [vec![path(0), path(1)], vec![path(2)]];
    let arguments = synthetic::explain_arguments(folder.path(), logs, &["viscous_friction"]);
    results(&arguments, &Console::silent()).unwrap()
}

/// The sentence about robots that differ, if there is one.
fn said(found: &Results) -> Option<&String> {
    found.warnings.iter().find(|warning| warning.contains("do not tell of one robot"))
}

#[test]
fn logs_that_differ_are_said_and_leave_structure() {
    let found = explained(2.0);
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
    let found = explained(0.0);
    assert_eq!(said(&found), None);
    assert_eq!(found.report.verdict, Some(Verdict::Sufficient));
}
