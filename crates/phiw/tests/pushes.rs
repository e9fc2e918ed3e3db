//! Something else that acts on the robot while it is logged.

use crate::synthetic;

use phiw::console::Console;
use phiw::explain::results;
use phiw::identify::Results;
use phiw_report::json::Verdict;
use std::f64::consts::PI;
use std::fs;
use std::ops::Range;
use tempfile::TempDir;

/// Torques of a push at its peak \[N·m\].
const PUSH: [f64; 3] = [20.0, 25.0, 9.0];

/// Explains three logs, the last of which is held out, with nothing declared. In the first two somebody
/// pushes the robot at these times \[s\].
fn explained(pushes: [&[Range<f64>]; 2]) -> Results {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    let mut train = Vec::new();
    for (index, pushes) in pushes.into_iter().chain([&[][..]]).enumerate() {
        let mut log = synthetic::recording(60 + index as u64, 30.0);
        for (row, t) in log.t.iter().enumerate() {
            for push in pushes.iter().filter(|push| push.contains(t)) {
                let size = (PI * (t - push.start) / (push.end - push.start)).sin();
                let torques = log.tau[3 * row..3 * row + 3].iter_mut().zip(PUSH);
                torques.for_each(|(torque, push)| *torque += size * push);
            }
        }
        train.push(path(&format!("log_{index}.csv")));
        fs::write(&train[index], synthetic::csv(&log)).unwrap();
    }
    let validate = train.split_off(2);
    let arguments = synthetic::explain_arguments(folder.path(), [train, validate], &[]);
    results(&arguments, &Console::silent()).unwrap()
}

fn said(found: &Results) -> Option<&String> {
    found.warnings.iter().find(|warning| warning.contains("something else acted on the robot"))
}

/// On an arm of six joints that was pushed twice in 75 s, the frictions of five had lost their names, and
/// four times as much of the torque was left.
#[test]
fn a_push_is_said_and_takes_no_names() {
    let undisturbed = explained([&[], &[]]);
    assert_eq!(said(&undisturbed), None);
    let pushed = explained([&[12.0..12.6], &[7.5..7.9, 21.0..21.7]]);
    let names = |found: &Results| {
        let effects = found.report.effects.iter();
        let mut names: Vec<(String, Vec<String>)> =
            effects.map(|effect| (effect.kind.clone(), effect.joints.clone())).collect();
        names.iter_mut().for_each(|(_, joints)| joints.sort());
        names
    };
    assert_eq!(names(&pushed), names(&undisturbed));
    assert_eq!(pushed.report.verdict, Some(Verdict::Explained));
    let [left, expected] = [&pushed, &undisturbed].map(|found| found.report.after.validate.relative.unwrap());
    assert!(left < 1.1 * expected, "{left}, not {expected}");
    let warning = said(&pushed).unwrap();
    for stretch in ["log_0.csv from 11.", "log_1.csv from 7.", "log_1.csv from 20."] {
        assert!(warning.contains(stretch), "{stretch}: {warning}");
    }
}
