//! `phiw check`: what is in logs, before anything is fitted; and the same as warnings of `identify`.

use crate::synthetic;

use assert_cmd::Command;
use phiw_telemetry::Recording;
use serde_json::Value;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Runs the command; exit status, standard output and standard error.
fn run(arguments: &[&str], folder: &Path) -> (i32, String, String) {
    let output = Command::cargo_bin("phiw").unwrap().current_dir(folder).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
}

/// A folder with the robot and a log of it that is `change`d.
fn folder(change: impl Fn(&mut Recording)) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
    let mut recording = synthetic::recording(1, 15.0);
    change(&mut recording);
    std::fs::write(folder.path().join("log.csv"), synthetic::csv(&recording)).unwrap();
    folder
}

/// The kinds and columns that are found.
fn found(change: impl Fn(&mut Recording)) -> BTreeSet<(String, String)> {
    let folder = folder(change);
    let (status, stdout, stderr) =
        run(&["check", "--urdf", "robot.urdf", "log.csv", "--out", "out"], folder.path());
    assert_eq!((status, stderr.as_str()), (0, ""), "{stdout}");
    let text = std::fs::read_to_string(folder.path().join("out/check.json")).unwrap();
    let report: Value = serde_json::from_str(&text).unwrap();
    let findings = report["findings"].as_array().unwrap();
    for finding in findings {
        for part in ["measured", "consequence", "mend"] {
            let said = finding[part].as_str().unwrap();
            assert!(!said.is_empty() && stdout.contains(said), "no `{said}` in {stdout}");
        }
    }
    let text = |finding: &Value, key: &str| finding[key].as_str().unwrap().to_owned();
    findings.iter().map(|finding| (text(finding, "kind"), text(finding, "column"))).collect()
}

fn check(change: impl Fn(&mut Recording), expected: &[(&str, &str)]) {
    let expected = expected.iter().map(|(kind, column)| ((*kind).to_owned(), (*column).to_owned())).collect();
    assert_eq!(found(change), expected);
}

/// The true velocities, `late` rows late.
fn velocities(recording: &Recording, late: usize) -> Vec<f64> {
    let joints = recording.joints.len();
    let rows = recording.t.len();
    let q = |row: usize, joint: usize| recording.q[row.clamp(0, rows - 1) * joints + joint];
    let slope = |row: usize, joint: usize| {
        let (before, after) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        (q(after, joint) - q(before, joint)) / (recording.t[after] - recording.t[before])
    };
    (0..rows * joints).map(|place| slope((place / joints).saturating_sub(late), place % joints)).collect()
}

#[test]
fn findings_name_the_column_and_go_into_the_file() {
    check(|_| {}, &[]);
    check(|log| log.qd = Some(velocities(log, 0)), &[]);
    check(
        |log| log.qd = Some(velocities(log, 20)),
        &[("late_velocity", "qd.joint_1"), ("late_velocity", "qd.joint_2"), ("late_velocity", "qd.joint_3")],
    );
    let torque = |change: fn(f64, f64) -> f64| {
        move |log: &mut Recording| {
            let largest = log.tau.iter().step_by(3).fold(0.0, |largest: f64, torque| largest.max(*torque));
            log.tau.iter_mut().step_by(3).for_each(|torque| *torque = change(*torque, largest));
        }
    };
    // The first joint carries no weight: its torque goes to both sides.
    check(torque(|torque, _| torque.abs()), &[("unsigned_torque", "tau.joint_1")]);
    check(torque(|torque, largest| torque.min(0.4 * largest)), &[("flat_top", "tau.joint_1")]);
    check(torque(|torque, _| 1000.0 * torque), &[("torque_unit", "tau.joint_1")]);
    let rows_of_three = |values: &mut Vec<f64>, change: fn(usize) -> usize| {
        let read = values.clone();
        let rows = values.chunks_mut(3).enumerate();
        rows.for_each(|(row, values)| values.copy_from_slice(&read[3 * change(row)..][..3]));
    };
    let fourth = |row: usize| row / 4 * 4;
    let held = |log: &mut Recording| {
        rows_of_three(&mut log.q, fourth);
        rows_of_three(&mut log.tau, fourth);
    };
    check(held, &[("held_rows", "t")]);
    check(|log| rows_of_three(&mut log.tau, fourth), &[("held_signal", "tau")]);
    let missed =
        |log: &mut Recording| log.tau.chunks_mut(3).skip(40).step_by(97).for_each(|row| row.fill(0.0));
    check(missed, &[("zero_rows", "tau")]);
}

#[test]
fn what_no_identification_would_take_is_said_and_what_cannot_be_read_is_refused() {
    let all_zero = folder(|log| log.tau.iter_mut().for_each(|torque| *torque = 0.0));
    let (status, stdout, _) = run(&["check", "--urdf", "robot.urdf", "log.csv"], all_zero.path());
    assert_eq!(status, 0, "{stdout}");
    assert!(stdout.contains("no identification would begin"), "{stdout}");
    for arguments in [
        &["check", "--urdf", "robot.urdf", "absent.csv", "--out", "out"][..],
        &["check", "--urdf", "absent.urdf", "log.csv", "--out", "out"],
        &["check", "--urdf", "robot.urdf", "--out", "out"],
        &["check", "--urdf", "robot.urdf", "log.csv", "--out", "log.csv"],
    ] {
        let (status, _, stderr) = run(arguments, all_zero.path());
        assert_eq!(status, 2, "{arguments:?}: {stderr}");
        assert!(!all_zero.path().join("out").exists(), "{arguments:?}");
    }
}

/// The page and the numbers say the same of a joint whose torque has lost its sign: of a CSV, and of the same
/// log under a map, whose positions are in degrees.
#[test]
fn the_page_and_the_numbers_name_a_joints_finding() {
    let unsigned = |log: &mut Recording| {
        log.tau.iter_mut().step_by(3).for_each(|torque| *torque = torque.abs());
    };
    let degrees = |log: &mut Recording| {
        unsigned(log);
        log.q.iter_mut().for_each(|q| *q = q.to_degrees());
    };
    let map = "[every_joint]\nq = { column = \"q.{joint}\", unit = \"deg\" }\n";
    for (folder, more) in [(folder(unsigned), &[][..]), (folder(degrees), &["--map", "map.toml"])] {
        std::fs::write(folder.path().join("map.toml"), map).unwrap();
        let words = ["check", "--urdf", "robot.urdf", "log.csv", "--out", "out"];
        let (status, stdout, stderr) = run(&[&words[..], more].concat(), folder.path());
        assert_eq!(status, 0, "{stderr}");
        assert!(stdout.contains("check.json, check.html in out"), "{stdout}");
        let text = std::fs::read_to_string(folder.path().join("out/check.json")).unwrap();
        let report: Value = serde_json::from_str(&text).unwrap();
        let [finding] = report["findings"].as_array().unwrap().as_slice() else { panic!("{report}") };
        assert_eq!(finding["column"], "tau.joint_1", "{report}");
        let [log] = report["logs"].as_array().unwrap().as_slice() else { panic!("{report}") };
        assert_eq!((&log["segments"], log["joints"].as_array().unwrap().len()), (&Value::from(1), 3));
        let range = log["joints"][1]["q"]["max"].as_f64().unwrap();
        assert!((0.1..7.0).contains(&range), "radians in {log}");

        let page = std::fs::read_to_string(folder.path().join("out/check.html")).unwrap();
        for part in ["measured", "consequence", "mend"] {
            let said = finding[part].as_str().unwrap();
            assert!(page.contains(said), "the page does not say `{said}`");
        }
        let sections: Vec<&str> = page.split("<section").skip(1).collect();
        let of_joint = |joint: &str| {
            let title = format!("<h2>{joint}</h2>");
            *sections.iter().find(|section| section.contains(&title)).unwrap()
        };
        assert!(of_joint("joint_1").contains("tau.joint_1"));
        assert!(!of_joint("joint_2").contains("What follows"));
        assert_eq!(of_joint("joint_2").matches("<svg").count(), 3, "position, velocity, torque");
    }
}

/// A `qd` column that lagged the position by 0.15 s was trusted, and four false delays were named.
#[test]
fn a_velocity_that_lags_the_position_is_not_trusted() {
    let errors = [false, true].map(|with_late_velocity| {
        let folder = folder(|log| {
            if with_late_velocity {
                log.qd = Some(velocities(log, 30));
            }
        });
        let arguments = ["identify", "--urdf", "robot.urdf", "--train", "log.csv", "--declare"];
        let arguments = [&arguments[..], &["viscous_friction", "--out", "out"]].concat();
        let (status, _, stderr) = run(&arguments, folder.path());
        assert_eq!(status, 0, "{stderr}");
        assert_eq!(stderr.contains("lags the positions by 0.15"), with_late_velocity, "{stderr}");
        let text = std::fs::read_to_string(folder.path().join("out/report.json")).unwrap();
        let report: Value = serde_json::from_str(&text).unwrap();
        report["after"]["validate"]["relative"].as_f64().unwrap()
    });
    assert!((errors[1] / errors[0] - 1.0).abs() < 0.01, "{errors:?}");
}

/// Of the real logs only what is truly there is said.
#[test]
fn real_logs_show_what_is_there() {
    let logs = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/logs");
    if !logs.is_dir() {
        println!("skipped: there are no logs at {}", logs.display());
        return;
    }
    let expected: [(&str, &[&str]); 6] = [
        ("tx40", &[]),
        ("emps", &[]),
        ("kr300", &[]),
        ("go2", &[]),
        // A quarter of a servo's turn in 1/4096 turns; a current that stays at its limit.
        ("xl330", &["encoder_steps q.servo", "flat_top tau.servo"]),
        // A wrist that turns by 0.004 rad, whose drive reads 0.
        ("schunk", &["encoder_steps q.j6", "zero_torque tau.j6"]),
    ];
    for (robot, expected) in expected {
        let mut names: Vec<String> = std::fs::read_dir(logs.join(robot))
            .unwrap()
            .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
            .filter(|name| name.ends_with(".csv") || name.ends_with(".urdf"))
            .collect();
        names.sort_by_key(|name| (!name.ends_with(".urdf"), name.clone()));
        let words: Vec<&str> =
            ["check", "--urdf"].into_iter().chain(names.iter().map(String::as_str)).collect();
        let (status, stdout, stderr) = run(&words, &logs.join(robot));
        assert_eq!(status, 0, "{robot}: {stderr}");
        let out = tempfile::tempdir().unwrap();
        let folder = out.path().to_string_lossy().into_owned();
        let (status, _, stderr) = run(&[&words[..], &["--out", &folder]].concat(), &logs.join(robot));
        assert_eq!(status, 0, "{robot}: {stderr}");
        let text = std::fs::read_to_string(out.path().join("check.json")).unwrap();
        let report: Value = serde_json::from_str(&text).unwrap();
        let found: BTreeSet<String> = report["findings"]
            .as_array()
            .unwrap()
            .iter()
            .map(|finding| {
                format!("{} {}", finding["kind"].as_str().unwrap(), finding["column"].as_str().unwrap())
            })
            .collect();
        let expected: BTreeSet<String> = expected.iter().map(|finding| (*finding).to_owned()).collect();
        assert_eq!(found, expected, "{robot}: {stdout}");
    }
}
