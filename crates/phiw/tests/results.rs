//! What the command does to files and streams, beside its results.

use crate::synthetic;

use assert_cmd::Command;
use std::fs;
use std::path::PathBuf;
use std::process::Stdio;
use tempfile::TempDir;

struct Scene(TempDir);

impl Scene {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
        fs::write(folder.path().join("train.csv"), synthetic::csv(&synthetic::recording(1, 15.0))).unwrap();
        Scene(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn words(&self, line: &str) -> Vec<String> {
        let folder = self.0.path().display().to_string();
        line.split(' ').map(|word| word.replace("DIR", &folder)).collect()
    }

    fn run(&self, line: &str) -> (Option<i32>, String) {
        let output = Command::cargo_bin("phiw").unwrap().args(self.words(line)).output().unwrap();
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    }
}

const IDENTIFY: &str = "identify --urdf DIR/robot.urdf --train DIR/train.csv --out DIR/out";

#[test]
fn an_input_in_the_result_folder_is_never_overwritten() {
    let scene = Scene::new();
    assert_eq!(scene.run(IDENTIFY).0, Some(0));
    let before = fs::read_to_string(scene.path("out/identified.urdf")).unwrap();
    let (status, message) = scene.run(&IDENTIFY.replace("DIR/robot.urdf", "DIR/out/identified.urdf"));
    assert_eq!(status, Some(2));
    assert!(
        message.contains("would overwrite the input") && message.contains("identified.urdf"),
        "{message}"
    );
    assert_eq!(fs::read_to_string(scene.path("out/identified.urdf")).unwrap(), before);
}

#[test]
fn a_motion_and_its_reason_do_not_get_the_same_name() {
    let scene = Scene::new();
    fs::create_dir(scene.path("motions")).unwrap();
    let (status, message) = scene.run("next --urdf DIR/robot.urdf --motions DIR/motions --out DIR/plan.json");
    assert_eq!(status, Some(2));
    assert!(message.contains("plan.csv"), "{message}");
    assert!(!scene.path("plan.json").exists());
}

/// Printing to a standard error that nobody reads was a panic, exit status 101.
#[cfg(target_os = "linux")]
#[test]
fn a_standard_error_that_is_full_or_closed_is_no_failure() {
    let scene = Scene::new();
    let lines = [(IDENTIFY, 0), ("identify --urdf DIR/absent --train DIR/train.csv --out DIR/other", 2)];
    for (line, status) in lines {
        let program = assert_cmd::cargo::cargo_bin("phiw");
        let full = || Stdio::from(fs::OpenOptions::new().write(true).open("/dev/full").unwrap());
        let mut phiw = std::process::Command::new(&program);
        let ended = phiw.args(scene.words(line)).stdout(full()).stderr(full()).status().unwrap();
        assert_eq!(ended.code(), Some(status), "{line}");
        let mut shell = std::process::Command::new("sh");
        shell.args(["-c", "exec \"$@\" >&- 2>&-", "sh"]).arg(&program).args(scene.words(line));
        assert_eq!(shell.status().unwrap().code(), Some(status), "{line}");
    }
}

#[test]
fn a_finished_run_leaves_nothing_but_its_results() {
    let scene = Scene::new();
    for _ in 0..2 {
        assert_eq!(scene.run(IDENTIFY).0, Some(0));
        let names = |folder: PathBuf| {
            let entries = folder.read_dir().unwrap();
            let mut names: Vec<String> =
                entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
            names.sort();
            names
        };
        assert_eq!(names(scene.path("")), ["out", "robot.urdf", "train.csv"]);
        assert_eq!(
            names(scene.path("out")),
            ["identified.urdf", "identified.xml", "model.json", "report.html", "report.json"]
        );
    }
}
