//! `phiw simulate`: logs reproduced by the model and by the URDF that it was made from.

use crate::synthetic;

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with a URDF that is wrong by half of its masses, two logs of the true robot, and a model.
struct Scene(TempDir);

const IDENTIFY: &str = "identify --urdf robot.urdf --train train.csv --validate validate.csv --declare viscous_friction --out out";
const SIMULATE: &str = "simulate --model out/model.json validate.csv --out sim";

impl Scene {
    fn new() -> Self {
        let scene = Scene(TempDir::new().unwrap());
        let wrong = synthetic::URDF
            .replace(r#"mass value="5""#, r#"mass value="9""#)
            .replace(r#"mass value="3""#, r#"mass value="5""#)
            .replace(r#"mass value="1.5""#, r#"mass value="2.5""#);
        fs::write(scene.path("robot.urdf"), wrong).unwrap();
        for (seed, name) in [(1, "train.csv"), (2, "validate.csv")] {
            fs::write(scene.path(name), synthetic::csv(&synthetic::recording(seed, 30.0))).unwrap();
        }
        scene.done(IDENTIFY);
        scene
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Exit status, standard output and standard error.
    fn run(&self, line: &str) -> (i32, String, String) {
        let mut phiw = Command::cargo_bin("phiw").unwrap();
        let output = phiw.current_dir(&self.0).args(line.split(' ')).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
    }

    fn done(&self, line: &str) -> (String, String) {
        let (status, stdout, stderr) = self.run(line);
        assert_eq!(status, 0, "{line}: {stderr}");
        (stdout, stderr)
    }

    /// Refused with one message that holds `expected`; nothing is written.
    fn refused(&self, line: &str, expected: &[&str]) {
        let (status, stdout, stderr) = self.run(line);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{line}: {stderr}");
        expected.iter().for_each(|part| assert!(stderr.contains(part), "no `{part}` in {stderr}"));
        assert!(!self.path("sim").exists(), "{line}");
    }

    fn report(&self) -> Value {
        serde_json::from_str(&fs::read_to_string(self.path("sim/simulation.json")).unwrap()).unwrap()
    }

    /// Writes `model.json` beside the good one, spoiled.
    fn spoiled(&self, spoil: impl Fn(&mut Value)) {
        let mut model: Value =
            serde_json::from_str(&fs::read_to_string(self.path("out/model.json")).unwrap()).unwrap();
        spoil(&mut model);
        fs::write(self.path("model.json"), model.to_string()).unwrap();
    }
}

/// The errors of a model in a loop after 0.5, 1 and 2 s.
fn errors(report: &Value, model: &str, in_loop: &str) -> [f64; 3] {
    let cases = report["cases"].as_array().unwrap();
    let case = cases.iter().find(|case| case["model"] == model && case["loop"] == in_loop).unwrap();
    [9, 19, 39].map(|place| case["share_of_travel"][place].as_f64().unwrap())
}

#[test]
fn the_identified_model_goes_with_the_log_longer_than_the_urdf() {
    let scene = Scene::new();
    let (stdout, stderr) = scene.done(SIMULATE);
    assert_eq!(stderr, "");
    assert!(stdout.contains("14 windows of 2 s") && stdout.contains("identified, closed loop"), "{stdout}");
    let mut files: Vec<_> =
        scene.path("sim").read_dir().unwrap().map(|file| file.unwrap().file_name()).collect();
    files.sort();
    assert_eq!(files, ["simulation.csv", "simulation.json", "simulation.svg"]);
    let report = scene.report();
    for in_loop in ["open", "closed"] {
        let (nominal, identified) =
            (errors(&report, "nominal", in_loop), errors(&report, "identified", in_loop));
        for (nominal, identified) in nominal.iter().zip(&identified) {
            assert!(identified < &(0.2 * nominal), "{in_loop}: {identified} {nominal}");
        }
    }
    assert!(errors(&report, "identified", "open")[2] < 0.05);
    assert!(errors(&report, "least_squares", "open")[2] < 0.05);
    let table = fs::read_to_string(scene.path("sim/simulation.csv")).unwrap();
    let header = "model,loop,horizon_s,share_of_travel,lost,rmse.joint_1,rmse.joint_2,rmse.joint_3";
    assert_eq!((table.lines().next(), table.lines().count()), (Some(header), 1 + 6 * 40));
    let picture = fs::read_to_string(scene.path("sim/simulation.svg")).unwrap();
    assert!(picture.starts_with("<svg") && picture.contains("nominal, open loop"));
}

#[test]
fn a_model_that_does_worse_than_its_urdf_is_said_to() {
    let scene = Scene::new();
    scene.spoiled(|model| {
        for body in model["consistent"]["bodies"].as_array_mut().unwrap() {
            for number in body["inertial"].as_array_mut().unwrap() {
                *number = (4.0 * number.as_f64().unwrap()).into();
            }
        }
    });
    let (_, stderr) = scene.done(&SIMULATE.replace("out/model.json", "model.json"));
    let sentence = "the identified model reproduces the logs worse than the URDF over 0.5 s in closed loop";
    assert!(stderr.contains(sentence), "{stderr}");
    assert!(scene.report()["warnings"].to_string().contains(sentence));
}

/// The bodies that least squares has found stand beside the possible ones, where they can move at all.
#[test]
fn bodies_of_least_squares_that_cannot_move_are_left_out_with_the_reason() {
    let scene = Scene::new();
    scene.spoiled(|model| {
        for number in model["bodies"][2]["inertial"].as_array_mut().unwrap() {
            *number = (-number.as_f64().unwrap()).into();
        }
    });
    let (stdout, stderr) = scene.done(&SIMULATE.replace("out/model.json", "model.json"));
    assert!(!stdout.contains("least squares") && stdout.contains("identified, open loop"), "{stdout}");
    let reason = "what least squares has found cannot be simulated: its M(q) is not positive definite";
    assert!(stderr.contains(reason) && stderr.contains("link_3"), "{stderr}");
    assert!(scene.report()["least_squares_refused"].as_str().unwrap().contains(reason));
}

#[test]
fn what_cannot_be_simulated_is_refused_with_the_reason() {
    let scene = Scene::new();
    let line = SIMULATE.replace("out/model.json", "model.json");
    scene.spoiled(|model| {
        for number in model["consistent"]["bodies"][2]["inertial"].as_array_mut().unwrap() {
            *number = (-number.as_f64().unwrap()).into();
        }
    });
    scene.refused(&line, &["model.json", "M(q) is not positive definite", "validate.csv", "link_3"]);
    scene.spoiled(|model| {
        model.as_object_mut().unwrap().remove("urdf");
    });
    scene.refused(&line, &["earlier phiw"]);
    scene
        .refused(&(SIMULATE.to_owned() + " --hold joint_3"), &["--hold joint_3", "out/model.json", "torque"]);
    scene.refused(&SIMULATE.replace("validate.csv", "absent.csv"), &["absent.csv", "no such file"]);
    let mut motion = synthetic::recording(3, 10.0);
    motion.tau.clear();
    fs::write(scene.path("motion.csv"), synthetic::csv(&motion)).unwrap();
    scene.refused(&SIMULATE.replace("validate.csv", "motion.csv"), &["motion.csv", "tau.joint_1"]);
    // Gaps everywhere.
    let mut torn = synthetic::recording(3, 10.0);
    (0..torn.t.len()).for_each(|row| torn.t[row] += (row / 90) as f64);
    fs::write(scene.path("torn.csv"), synthetic::csv(&torn)).unwrap();
    scene.refused(&SIMULATE.replace("validate.csv", "torn.csv"), &["torn.csv", "no stretch of 0.5 s"]);
    scene.refused(&SIMULATE.replace("--out sim", "--out validate.csv"), &["validate.csv", "is a file"]);
}

#[test]
fn a_urdf_without_inertia_cannot_be_compared_with() {
    let scene = Scene::new();
    let urdf = fs::read_to_string(scene.path("robot.urdf")).unwrap();
    let light = urdf.replace(r#"mass value="2.5""#, r#"mass value="0""#);
    let none = light.replace(
        r#"<inertia ixx="0.005" iyy="0.02" izz="0.021" ixy="0.001""#,
        r#"<inertia ixx="0" iyy="0" izz="0" ixy="0""#,
    );
    assert_ne!(light, none);
    fs::write(scene.path("robot.urdf"), none).unwrap();
    scene.done(IDENTIFY);
    let (stdout, stderr) = scene.done(SIMULATE);
    assert!(
        stderr.contains("the URDF by itself cannot be simulated") && stderr.contains("link_3"),
        "{stderr}"
    );
    assert!(!stdout.contains("nominal") && stdout.contains("identified, open loop"), "{stdout}");
}

/// An engine moves the same robot: its errors are those of our own algorithms.
#[test]
fn engines_reproduce_alike_where_they_are_built_in() {
    let scene = Scene::new();
    if !cfg!(feature = "simulators") {
        println!("skipped: built without the feature simulators; what it refuses is looked at");
        return scene.refused(
            &format!("{SIMULATE} --backend rapier"),
            &["--backend rapier", "--features simulators"],
        );
    }
    scene.done(SIMULATE);
    let share = |report: &Value| report["cases"][1]["share_of_travel"][9].as_f64().unwrap();
    let ours = share(&scene.report());
    scene.done(&format!("{SIMULATE} --backend rapier"));
    let report = scene.report();
    assert_eq!(report["backend"], "rapier");
    assert!((share(&report) - ours).abs() < 1e-6 * ours, "{} {ours}", share(&report));
}
