//! Logs that are reduced apart give the files of one process, to the last bit.

use crate::synthetic;

use assert_cmd::Command;
use phiw_telemetry::Recording;
use serde_json::Value;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A robot and its logs: three to fit and one to validate on.
struct Fleet {
    folder: TempDir,
    /// The logs to fit; the third also lies elsewhere.
    train: [&'static str; 3],
}

const TRAIN: [&str; 3] = ["a.csv", "b.csv", "c.csv"];
const VALIDATE: &str = "d.csv";

impl Fleet {
    /// Each log has a stretch at rest: the rows of it count for no fit, but for the error with rests
    /// included.
    fn new() -> Self {
        Self::with_logs(12.0, |recording| {
            let still: Vec<f64> = recording.q[3 * 1000..3 * 1001].to_vec();
            recording.q[3 * 1000..3 * 1400].copy_from_slice(&still.repeat(400));
        })
    }

    fn with_logs(seconds: f64, change: impl Fn(&mut Recording)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
        for (seed, name) in TRAIN.iter().chain([&VALIDATE]).enumerate() {
            let mut recording = synthetic::recording(seed as u64 + 1, seconds + 2.0 * seed as f64);
            change(&mut recording);
            recording.write_csv(&folder.path().join(name)).unwrap();
        }
        Fleet { folder, train: TRAIN }
    }

    /// A robot of two joints, whose third log is a short one in one of the formats' own files or folders.
    fn with_log_of_format(name: &'static str) -> Self {
        let fleet = Self::with_logs(1.0, |_| ());
        std::fs::write(fleet.path("robot.urdf"), TWO_JOINTS).unwrap();
        for (seed, log) in [(1, "a.csv"), (2, "b.csv"), (3, VALIDATE)] {
            synthetic::recording_of(TWO_JOINTS, seed, 12.0).write_csv(&fleet.path(log)).unwrap();
        }
        let files = Path::new(env!("CARGO_MANIFEST_DIR")).join("../log-formats/tests/files");
        copy(&files.join(name), &fleet.path(name));
        Fleet { train: ["a.csv", "b.csv", name], ..fleet }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn phiw(&self, words: &[&str]) -> Command {
        let mut command = Command::cargo_bin("phiw").unwrap();
        command.current_dir(self.folder.path()).args(words);
        command
    }

    fn done(&self, words: &[&str]) {
        self.phiw(words).assert().success();
    }

    /// The command is refused with status 2 and one line that says all of `said`.
    fn refused(&self, words: &[&str], said: &[&str]) {
        let output = self.phiw(words).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{words:?}: {message}");
        assert_eq!(message.trim_end().lines().count(), 1, "{message}");
        said.iter().for_each(|said| assert!(message.contains(said), "`{said}` is not in: {message}"));
    }

    fn plan(&self, more: &[&str]) {
        let words = [&["plan", "--urdf", "robot.urdf"], &self.train[..], &["--out", "plan.json"], more];
        self.done(&words.concat());
    }

    fn reduce(&self, logs: &[&str], out: &str) {
        self.done(&[&["reduce", "--plan", "plan.json"], logs, &["--out", out]].concat());
    }

    /// Identifies in one process and from factors that two have made, the second half elsewhere and under
    /// other names.
    fn both(&self, more: &[&str]) {
        let [first, second, third] = self.train;
        let one =
            [&["identify", "--urdf", "robot.urdf", "--train"], &self.train[..], &["--out", "one"], more];
        self.done(&one.concat());
        self.plan(more);
        std::fs::create_dir(self.path("elsewhere")).unwrap();
        copy(&self.path(third), &self.path("elsewhere/x"));
        let logs: &[&str] = if more.contains(&VALIDATE) { &[VALIDATE, second] } else { &[second] };
        self.reduce(logs, "1.factor");
        self.reduce(&["elsewhere/x", first], "2.factor");
        let merged =
            ["identify", "--plan", "plan.json", "--factors", "2.factor", "1.factor", "--out", "merged"];
        self.done(&merged);
        for file in ["model.json", "report.json", "identified.urdf", "identified.xml"] {
            let [one, merged] = ["one", "merged"].map(|folder| read(&self.path(folder).join(file)));
            assert!(one == merged, "{file} differs");
        }
        let page = read(&self.path("merged/report.html"));
        assert!(page.contains("Torques over time are not shown"));
    }
}

/// Two joints, named as in the formats' own files.
const TWO_JOINTS: &str = r#"<robot name="two_joints">
  <link name="base"/>
  <link name="upper"><inertial><origin xyz="0.2 0 0.01"/><mass value="3"/>
    <inertia ixx="0.02" iyy="0.07" izz="0.08" ixy="0" ixz="0.004" iyz="0"/></inertial></link>
  <link name="lower"><inertial><origin xyz="0.15 -0.02 0"/><mass value="1.5"/>
    <inertia ixx="0.005" iyy="0.02" izz="0.021" ixy="0.001" ixz="0" iyz="0"/></inertial></link>
  <joint name="a" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 1 0"/></joint>
  <joint name="b" type="continuous"><parent link="upper"/><child link="lower"/><origin xyz="0.4 0 0"/><axis xyz="0 1 0"/></joint>
</robot>
"#;

/// Copies a file, or a folder with all that is in it.
fn copy(from: &Path, to: &Path) {
    if !from.is_dir() {
        std::fs::copy(from, to).unwrap();
        return;
    }
    std::fs::create_dir(to).unwrap();
    for entry in from.read_dir().unwrap() {
        let entry = entry.unwrap();
        copy(&entry.path(), &to.join(entry.file_name()));
    }
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap()
}

#[test]
fn factors_give_the_files_of_one_process() {
    let fleet = Fleet::new();
    fleet.both(&["--validate", VALIDATE, "--declare", "viscous_friction,coulomb_friction"]);
    let report: Value = serde_json::from_str(&read(&fleet.path("merged/report.json"))).unwrap();
    let with_rests = report["phiw"]["relative_with_rests"]["validate"].as_f64().unwrap();
    assert_ne!(with_rests, report["after"]["validate"]["relative"].as_f64().unwrap());
    assert!(report["phiw"]["bandwidth"]["curve"].as_array().unwrap().len() > 2);
}

#[test]
fn logs_whose_ends_are_held_out_are_reduced_apart_too() {
    Fleet::new().both(&["--declare", "rotor_inertia,torque_offset,viscous_friction", "--total-mass", "9.5"]);
}

/// Constants that are seen only in the residual are chosen when the plan is made.
#[test]
fn a_ripple_is_reduced_with_the_periods_of_the_plan() {
    Fleet::new().both(&["--validate", VALIDATE, "--declare", "torque_ripple:joint_2,stribeck_friction"]);
}

/// The plan carries the map: `reduce` needs no file of it, and a log that the map gives stretches and a
/// payload keeps them under another name.
#[test]
fn logs_with_a_map_are_reduced_apart_too() {
    let fleet = Fleet::with_logs(12.0, |log| log.q.iter_mut().for_each(|q| *q = q.to_degrees()));
    let map = r#"[every_joint]
q = { column = "q.{joint}", unit = "deg" }

[[log]]
file = "c.csv"
validate = [[10.0, 14.0]]
leave_out = [[3.0, 3.5]]
payload = { link = "link_3", mass_kg = 0.5, com_m = [0.1, 0.0, 0.0] }
"#;
    std::fs::write(fleet.path("map.toml"), map).unwrap();
    fleet.both(&["--map", "map.toml", "--validate", VALIDATE, "--declare", "viscous_friction"]);
    let model: Value = serde_json::from_str(&read(&fleet.path("merged/model.json"))).unwrap();
    assert!(model.to_string().matches("\"c.csv\"").count() > 1, "one log to fit and to validate on");

    std::fs::remove_file(fleet.path("map.toml")).unwrap();
    fleet.reduce(&["c.csv"], "c.factor");
    fleet.refused(
        &["reduce", "--plan", "plan.json", "c.csv", "elsewhere/x", "--out", "x.factor"],
        &["elsewhere/x: this log is named twice"],
    );
}

#[test]
fn logs_that_are_folders_are_reduced_apart_too() {
    for name in ["ros2_sqlite", "lerobot_v3"] {
        let fleet = Fleet::with_log_of_format(name);
        fleet.both(&["--declare", "viscous_friction", "--cutoff-hz", "30", "--parallel-cutoff-hz", "20"]);
    }
}

#[test]
fn wrong_plans_and_factors_are_refused() {
    let fleet = Fleet::new();
    fleet.plan(&[]);
    fleet.reduce(&["a.csv"], "a.factor");
    fleet.reduce(&["b.csv", "c.csv"], "bc.factor");
    let merge = |factors: &[&str], said: &[&str]| {
        let words = ["identify", "--plan", "plan.json", "--out", "out", "--factors"];
        fleet.refused(&[&words[..], factors].concat(), said);
        assert!(!fleet.path("out").exists(), "{factors:?}");
    };
    merge(&["a.factor"], &["b.csv, c.csv are missing", "phiw reduce"]);
    merge(&["a.factor", "bc.factor", "a.factor"], &["a.csv", "a.factor too"]);
    merge(&["a.factor", "b.csv"], &["b.csv: this is no file of factors"]);
    merge(&["a.factor", "absent.factor"], &["absent.factor: no such file"]);
    let bytes = std::fs::read(fleet.path("bc.factor")).unwrap();
    for length in [13, 100, bytes.len() / 2, bytes.len() - 1] {
        std::fs::write(fleet.path("cut.factor"), &bytes[..length]).unwrap();
        merge(&["a.factor", "cut.factor"], &["cut.factor", "cut short or damaged"]);
    }

    let reduce = |plan: &str, logs: &[&str], said: &[&str]| {
        fleet.refused(&[&["reduce", "--plan", plan, "--out", "x.factor"], logs].concat(), said);
        assert!(!fleet.path("x.factor").exists(), "{logs:?}");
    };
    reduce("plan.json", &["a.csv", "a.csv"], &["a.csv: this log is named twice"]);
    reduce("plan.json", &[VALIDATE], &["d.csv: the plan has no log of this content"]);
    reduce("plan.json", &["absent.csv"], &["absent.csv: no such file"]);
    reduce("robot.urdf", &["a.csv"], &["robot.urdf: not a plan.json of phiw"]);
    let text = read(&fleet.path("plan.json"));
    std::fs::write(fleet.path("cut.json"), &text[..text.len() / 2]).unwrap();
    reduce("cut.json", &["a.csv"], &["cut.json: not a plan.json of phiw"]);
    let version = format!("\"phiw\": \"{}\"", env!("CARGO_PKG_VERSION"));
    std::fs::write(fleet.path("later.json"), text.replacen(&version, "\"phiw\": \"99.0\"", 1)).unwrap();
    reduce("later.json", &["a.csv"], &["later.json: phiw 99.0 has written it"]);
    let train = text.replacen("\"period\": 0.00", "\"period\": 0.01", 1);
    assert_ne!(train, text);
    std::fs::write(fleet.path("edited.json"), train).unwrap();
    reduce("edited.json", &["a.csv"], &["edited.json: it has been changed since phiw plan wrote it"]);

    let log = read(&fleet.path("c.csv"));
    std::fs::write(fleet.path("c.csv"), log.replacen("0.0", "0.5", 1)).unwrap();
    reduce("plan.json", &["c.csv"], &["c.csv", "has changed since the plan was made"]);

    // The factors of another plan on the same logs.
    std::fs::write(fleet.path("c.csv"), log).unwrap();
    fleet.plan(&["--declare", "viscous_friction"]);
    merge(&["a.factor", "bc.factor"], &["a.factor: it was reduced with another plan"]);
}

#[test]
fn an_effect_that_needs_the_model_is_not_reduced_apart() {
    let words = ["--declare", "load_dependent_friction", "--out", "plan.json"];
    let plan = [&["plan", "--urdf", "robot.urdf"], &TRAIN[..], &words].concat();
    Fleet::new().refused(&plan, &["load_dependent_friction cannot be reduced apart", "phiw identify"]);
}

/// One type of robot, one model: what a single robot has more is told by its logs and the shared model.
#[test]
fn a_robot_of_the_fleet_whose_elbow_rubs_more_is_told_by_the_shared_model() {
    let fleet = Fleet::with_logs(40.0, |_| ());
    fleet.plan(&["--validate", VALIDATE, "--declare", "viscous_friction"]);
    fleet.reduce(&["a.csv", "b.csv", "c.csv", VALIDATE], "all.factor");
    fleet.done(&["identify", "--plan", "plan.json", "--factors", "all.factor", "--out", "shared"]);
    for (seed, name) in [(21, "train_7.csv"), (22, "validate_7.csv")] {
        let mut recording = synthetic::recording(seed, 40.0);
        // 1.5 N·m·s/rad more on joint_2 of robot 7.
        let rows = recording.t.len();
        for row in 1..rows - 1 {
            let speed = (recording.q[3 * (row + 1) + 1] - recording.q[3 * (row - 1) + 1])
                / (recording.t[row + 1] - recording.t[row - 1]);
            recording.tau[3 * row + 1] += 1.5 * speed;
        }
        recording.write_csv(&fleet.path(name)).unwrap();
    }
    let words = ["explain", "--urdf", "robot.urdf", "--model", "shared/model.json", "--out", "robot_7"];
    fleet.done(&[&words[..], &["--train", "train_7.csv", "--validate", "validate_7.csv"]].concat());
    let report: Value = serde_json::from_str(&read(&fleet.path("robot_7/report.json"))).unwrap();
    let [found] = report["effects"].as_array().unwrap().as_slice() else { panic!("{report}") };
    assert_eq!(
        (found["kind"].as_str(), &found["joints"]),
        (Some("viscous_friction"), &Value::from(vec!["joint_2"]))
    );
    let more = found["parameters"]["joint_2"]["fv"]["value"].as_f64().unwrap();
    assert!((more - 1.5).abs() < 0.2, "{report}");
}
