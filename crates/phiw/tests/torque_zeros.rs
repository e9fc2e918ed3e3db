//! Torques whose zero is another in each log.

use crate::synthetic;

use phiw::arguments::SessionArguments;
use phiw::console::Console;
use phiw::explain::results;
use phiw::identify::Results;
use phiw_report::json::Verdict;
use std::fs;
use tempfile::TempDir;

/// Zeros of each log's torques \[N·m\]: two to train on, one held out.
const ZEROS: [[f64; 3]; 3] = [[6.0, 0.0, 1.5], [1.0, 0.0, -0.5], [-3.0, 0.0, 4.0]];

/// Explains logs of the right model, viscous friction declared; the last is held out where `validate` says.
fn explained(logs: &[[f64; 3]], validate: bool, declare: &[&str]) -> Results {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    let mut train = Vec::new();
    for (index, zeros) in logs.iter().enumerate() {
        let mut log = synthetic::recording(40 + index as u64, 30.0);
        log.tau.iter_mut().zip(zeros.iter().cycle()).for_each(|(torque, zero)| *torque += zero);
        train.push(path(&format!("log_{index}.csv")));
        fs::write(&train[index], synthetic::csv(&log)).unwrap();
    }
    let validate = if validate { train.split_off(logs.len() - 1) } else { Vec::new() };
    let arguments = synthetic::explain_arguments(folder.path(), [train, validate], declare);
    results(&arguments, &Console::silent()).unwrap()
}

/// The sentence about zeros, if there is one.
fn said(found: &Results) -> Option<&String> {
    found.warnings.iter().find(|warning| warning.contains("zeros of torques"))
}

/// Nothing of the robot is named, and what is left is the noise.
fn is_right(results: &Results) {
    let report = &results.report;
    assert!(report.effects.is_empty(), "{:?}", report.effects);
    assert_eq!(report.verdict, Some(Verdict::Sufficient));
    for (joint, rmse) in &report.after.validate.rmse {
        let floor = report.noise_floor[joint];
        assert!(*rmse < 1.2 * floor, "{joint}: {rmse} of {floor}");
    }
}

/// Springs, forces and a balancer were named on right models, and 2 to 25 % of the torques were left.
#[test]
fn zeros_that_differ_from_log_to_log_are_said_and_accuse_nobody() {
    let found = explained(&ZEROS, true, &["viscous_friction"]);
    is_right(&found);
    let warning = said(&found).unwrap();
    assert!(warning.contains("joint_1 by 5.0 N·m") && warning.contains("joint_3 by 2.0 N·m"), "{warning}");
    assert!(!warning.contains("joint_2") && warning.contains("means of what the model left"), "{warning}");
}

#[test]
fn the_end_of_a_log_has_the_zero_of_its_beginning() {
    let found = explained(&ZEROS, false, &["viscous_friction"]);
    is_right(&found);
    let warning = said(&found).unwrap();
    assert!(warning.contains("joint_1 by 9.0 N·m") && warning.contains("its beginning"), "{warning}");
}

#[test]
fn beside_a_declared_offset_the_zeros_are_what_differs() {
    is_right(&explained(&ZEROS, true, &["viscous_friction", "torque_offset"]));
}

#[test]
fn one_zero_for_all_logs_is_an_offset() {
    let found = explained(&[ZEROS[0]; 3], true, &["viscous_friction"]);
    let named: Vec<(&str, usize)> =
        found.report.effects.iter().map(|effect| (effect.kind.as_str(), effect.joints.len())).collect();
    assert_eq!(named, [("torque_offset", 2)]);
    assert_eq!(said(&found), None);
}

#[test]
fn zeros_of_logs_cannot_be_declared() {
    let arguments = SessionArguments {
        declare: vec!["torque_zero_by_log".to_owned()],
        urdf: "robot.urdf".into(),
        ..SessionArguments::default()
    };
    let message = phiw::session::Session::open(&arguments, &|_, _, _| {}).err().unwrap().to_string();
    assert!(message.contains("belongs to the training logs"), "{message}");
}
