//! Wrong input gets one message that names the file, the place and the mend, exit status 2, and nothing
//! written.

use crate::synthetic;

use assert_cmd::Command;
use phiw_telemetry::Recording;
use std::path::PathBuf;
use std::sync::LazyLock;
use tempfile::TempDir;

static GOOD: LazyLock<Recording> = LazyLock::new(|| synthetic::recording(1, 15.0));

/// Files and command line, right until a case spoils one of them.
struct Scene {
    folder: TempDir,
    urdf: String,
    train: String,
    validate: Option<String>,
    /// The command line after `phiw`; `DIR` stands for the folder.
    command_line: Vec<String>,
}

impl Scene {
    fn new() -> Self {
        let words = "identify --urdf DIR/robot.urdf --train DIR/train.csv --out DIR/out";
        Scene {
            folder: tempfile::tempdir().unwrap(),
            urdf: synthetic::URDF.to_owned(),
            train: synthetic::csv(&GOOD),
            validate: None,
            command_line: words.split(' ').map(str::to_owned).collect(),
        }
    }

    fn more(&mut self, words: &str) {
        self.command_line.extend(words.split(' ').map(str::to_owned));
    }

    /// The training log made from a spoiled recording.
    fn record(&mut self, spoil: impl FnOnce(&mut Recording)) {
        let mut recording = GOOD.clone();
        spoil(&mut recording);
        self.train = synthetic::csv(&recording);
    }

    /// The training log with one line (counted from 1) changed.
    fn line(&mut self, number: usize, change: impl Fn(&str) -> String) {
        let lines = self.train.lines().enumerate();
        let lines =
            lines.map(|(index, line)| if index + 1 == number { change(line) } else { line.to_owned() });
        self.train = lines.map(|line| line + "\n").collect();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn run(&self) -> std::process::Output {
        std::fs::write(self.path("robot.urdf"), &self.urdf).unwrap();
        std::fs::write(self.path("train.csv"), &self.train).unwrap();
        if let Some(validate) = &self.validate {
            std::fs::write(self.path("validate.csv"), validate).unwrap();
        }
        let folder = self.folder.path().display().to_string();
        let words = self.command_line.iter().map(|word| word.replace("DIR", &folder));
        Command::cargo_bin("phiw").unwrap().args(words).output().unwrap()
    }
}

fn check(spoil: impl FnOnce(&mut Scene), expected: &[&str]) {
    let mut scene = Scene::new();
    spoil(&mut scene);
    let output = scene.run();
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{expected:?}: {message}");
    assert!(output.stdout.is_empty());
    for part in expected {
        assert!(message.contains(part), "no `{part}` in: {message}");
    }
    // One message: of one line, unless it is about the command line, when it points to the usage.
    assert!(message.lines().count() == 1 || message.contains("try '--help'"), "{message}");
    assert!(!scene.path("out").is_dir(), "{message}");
}

#[test]
fn files_that_are_not_there_or_not_what_they_should_be() {
    check(|scene| scene.command_line[2] = "DIR/absent.urdf".into(), &["absent.urdf: no such file"]);
    check(|scene| scene.command_line[4] = "DIR/absent.csv".into(), &["absent.csv: no such file"]);
    check(|scene| scene.command_line[4] = "DIR".into(), &["this is a folder", "a LeRobot dataset"]);
    check(|scene| scene.more("--validate DIR/absent.csv"), &["absent.csv: no such file"]);
    check(|scene| scene.urdf = "t,q.joint_1\n0,0\n".into(), &["robot.urdf: not a URDF", "not XML"]);
    check(|scene| scene.urdf = "<html/>".into(), &["robot.urdf: not a URDF", "<html>"]);
    check(|scene| scene.train.clear(), &["train.csv: the log is empty"]);
    check(|scene| scene.line(1, |_| String::new()), &["train.csv"]);
}

#[test]
fn robots_that_cannot_be_identified() {
    let floating =
        |urdf: &str| urdf.replace("name=\"joint_1\" type=\"revolute\"", "name=\"joint_1\" type=\"floating\"");
    check(|scene| scene.urdf = floating(&scene.urdf), &["robot.urdf: the robot's base floats", "fixed"]);
    let fixed = |urdf: &str| urdf.replace("\"revolute\"", "\"fixed\"");
    check(|scene| scene.urdf = fixed(&scene.urdf), &["robot.urdf: no joint of the URDF moves"]);
    check(|scene| scene.more("--hold joint_4"), &["cannot hold the joint `joint_4`", "did you mean `joint_"]);
}

#[test]
fn columns_that_the_log_lacks() {
    let rename = |from: &'static str, to: &'static str| move |line: &str| line.replace(from, to);
    check(
        |scene| scene.line(1, rename("q.joint_2", "q.joint2")),
        &["train.csv, line 1: no column `q.joint_2`", "nearest: `q.joint2`", "hold the joint"],
    );
    check(|scene| scene.line(1, rename("tau.joint_3", "effort.joint_3")), &["no column `tau.joint_3`"]);
    check(|scene| scene.line(1, rename("t,", "time,")), &["train.csv, line 1: no column `t`", "time"]);
    check(|scene| scene.line(1, |line| format!("{line},q.joint_1")), &["two columns are named `q.joint_1`"]);
}

#[test]
fn rows_that_cannot_be_read() {
    let cell = |column: usize, text: &'static str| {
        move |line: &str| {
            let mut cells: Vec<&str> = line.split(',').collect();
            cells[column] = text;
            cells.join(",")
        }
    };
    check(
        |scene| scene.line(11, cell(2, "abc")),
        &["train.csv, line 11, column `q.joint_2`: `abc` is not a number", "leave the cell empty"],
    );
    check(
        |scene| scene.line(11, cell(0, "0.001")),
        &["line 11, column `t`: time runs backwards", "sort the rows"],
    );
    check(
        |scene| scene.line(11, |line| format!("{line},1")),
        &["train.csv, line 11: 8 cells, but the header has 7"],
    );
    check(|scene| scene.record(|log| log.q.fill(f64::NAN)), &["train.csv: no usable row"]);
}

#[test]
fn motion_that_tells_nothing() {
    let head = |rows: usize| {
        move |log: &mut Recording| {
            log.t.truncate(rows);
            log.q.truncate(3 * rows);
            log.tau.truncate(3 * rows);
        }
    };
    check(|scene| scene.record(head(40)), &["too short", "record"]);
    check(|scene| scene.record(head(6)), &["train.csv"]);
    let still = |log: &mut Recording| log.q.iter_mut().skip(1).step_by(3).for_each(|q| *q = 0.4);
    check(
        |scene| scene.record(still),
        &["joint `joint_2` is not excited", "hold it with --hold joint_2=0.4"],
    );
    // All of them at once: a user held one joint after the other, with a run for each.
    let both_still = |log: &mut Recording| {
        log.q.chunks_exact_mut(3).for_each(|row| row[1..].copy_from_slice(&[0.4, -0.2]));
    };
    check(
        |scene| scene.record(both_still),
        &[
            "joint `joint_2` is not excited",
            "nor is `joint_3`; move them",
            "--hold joint_2=0.4000,joint_3=-0.2000",
        ],
    );
}

#[test]
fn units_and_torques_that_are_wrong() {
    let degrees = |log: &mut Recording| log.q.iter_mut().for_each(|q| *q = q.to_degrees());
    check(|scene| scene.record(degrees), &["train.csv: q.joint_1", "look like degrees", "pi/180"]);
    let silent = |log: &mut Recording| log.tau.iter_mut().skip(2).step_by(3).for_each(|tau| *tau = 0.0);
    check(|scene| scene.record(silent), &["train.csv: column tau.joint_3 is zero in every row"]);
    // The log for validation is checked as well.
    check(
        |scene| {
            let mut recording = synthetic::recording(2, 15.0);
            degrees(&mut recording);
            scene.validate = Some(synthetic::csv(&recording));
            scene.more("--validate DIR/validate.csv");
        },
        &["validate.csv: q.joint_1", "look like degrees"],
    );
}

#[test]
fn options_that_make_no_sense() {
    check(
        |scene| scene.more("--declare rigid_body,viscous_frction"),
        &["there is no effect `viscous_frction`", "did you mean `viscous_friction`"],
    );
    check(
        |scene| scene.more("--declare transmission_coupling:joint_1+joint_2+joint_3"),
        &["`transmission_coupling` acts on two joints", "it can on joint_1+joint_2"],
    );
    check(
        |scene| scene.more("--cutoff-hz 90"),
        &["train.csv: a cut-off of 90 Hz does not fit a sample rate of 200.0 Hz", "up to 70.0 Hz"],
    );
    check(|scene| scene.more("--parallel-cutoff-hz 0"), &["a cut-off of 0 Hz", "choose one above 0"]);
    check(|scene| scene.more("--hold joint_1=left"), &["`left` is not a position"]);
    check(|scene| scene.more("--tarin other.csv"), &["unexpected argument '--tarin'", "--train"]);
    check(|scene| scene.command_line.truncate(5), &["--out <DIR>"]);
    check(
        |scene| {
            std::fs::write(scene.path("file"), "mine").unwrap();
            scene.command_line[6] = "DIR/file".into();
        },
        &["file` is a file; name a folder"],
    );
}

/// Each of these gave a model, without a word.
#[test]
fn stamps_velocities_and_positions_in_other_units() {
    let scaled_time = |factor: f64| move |log: &mut Recording| log.t.iter_mut().for_each(|t| *t *= factor);
    check(|scene| scene.record(scaled_time(1e3)), &["train.csv: the time stamps", "look like milliseconds"]);
    check(|scene| scene.record(scaled_time(1e6)), &["look like microseconds"]);
    check(|scene| scene.record(scaled_time(1e9)), &["look like nanoseconds"]);
    check(|scene| scene.record(scaled_time(1e-3)), &["not in seconds"]);
    // Seconds since 1970 in ten digits: 1 s for 1 s, taken for milliseconds.
    let whole_seconds = |log: &mut Recording| log.t.iter_mut().for_each(|t| *t = (1.7e9 + *t).floor());
    check(|scene| scene.record(whole_seconds), &["have the time stamp of the row before", "too few digits"]);
    let large = |log: &mut Recording| log.q.iter_mut().for_each(|q| *q *= 1e3);
    check(|scene| scene.record(large), &["q.joint_1 runs from", "another unit"]);
    let velocity = |factor: f64| {
        move |log: &mut Recording| {
            let rows = log.t.len();
            let slope = |row: usize, joint: usize| {
                let (before, after) = (row.saturating_sub(1), (row + 1).min(rows - 1));
                (log.q[3 * after + joint] - log.q[3 * before + joint]) / (log.t[after] - log.t[before])
            };
            let all = (0..rows).flat_map(|row| (0..3).map(move |joint| (row, joint)));
            log.qd = Some(all.map(|(row, joint)| factor * slope(row, joint)).collect());
        }
    };
    check(|scene| scene.record(velocity(180.0 / std::f64::consts::PI)), &["qd is in degrees/s"]);
    check(|scene| scene.record(velocity(1e3)), &["dq/dt of `joint_1` is 0.001"]);
}
