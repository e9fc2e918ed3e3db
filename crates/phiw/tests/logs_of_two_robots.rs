//! Training logs that are not of one robot.

mod synthetic;

use phiw::console::Console;
use phiw::explain::results;
use phiw::identify::Results;
use phiw_report::json::Verdict;
use std::fs;
use tempfile::TempDir;

/// Explains three logs of the right model, viscous friction declared; the torque of joint_3 in the second
/// has another scale.
fn explained(scale: f64) -> Results {
    let folder = TempDir::new().unwrap();
    let path = |index: usize| folder.path().join(format!("log_{index}.csv"));
    fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
    for index in 0..3 {
        let mut log = synthetic::recording(50 + index as u64, 30.0);
        if index == 1 {
            log.tau.iter_mut().skip(2).step_by(3).for_each(|torque| *torque *= scale);
        }
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
    let found = explained(1.5);
    let warning = said(&found).unwrap();
    assert!(warning.contains("joint_3") && warning.contains("phiw explain --model model.json"), "{warning}");
    let differs =
        found.warnings.iter().find(|warning| warning.contains("differs from the other training logs"));
    assert!(
        differs.unwrap().contains("log_1.csv") && differs.unwrap().contains("torque gain of joint_3"),
        "{differs:?}"
    );
    let verdict = found.report.verdict.unwrap();
    assert!(matches!(verdict, Verdict::Unexplained | Verdict::PartlyExplained), "{verdict:?}");
    let remaining = &found.report.remaining;
    assert!(remaining.structured && remaining.joints.contains(&"joint_3".to_owned()), "{remaining:?}");
}

#[test]
fn logs_of_one_robot_are_not() {
    let found = explained(1.0);
    assert_eq!(said(&found), None);
    assert_eq!(found.report.verdict, Some(Verdict::Sufficient));
}
