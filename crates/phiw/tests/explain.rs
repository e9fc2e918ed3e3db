//! `phiw explain` from files to files: a sufficient model, an effect that is found, a held model that has
//! changed.

use crate::synthetic;

use assert_cmd::Command;
use phiw_report::ReportJson;
use phiw_report::json::Verdict;
use phiw_telemetry::Recording;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder with the robot and two logs, `secret(row of q, row of qd by differences, torque)` added to both.
struct Scene {
    folder: TempDir,
}

impl Scene {
    fn new(secret: impl Fn(&[f64], &[f64], &mut [f64])) -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("robot.urdf"), synthetic::URDF).unwrap();
        for (seed, name) in [(1, "train.csv"), (2, "validate.csv")] {
            let mut log = synthetic::recording(seed, 60.0);
            add(&mut log, &secret);
            fs::write(folder.path().join(name), synthetic::csv(&log)).unwrap();
        }
        Scene { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Runs a command of phiw on the logs; gives what it printed.
    fn run(&self, command: &str, out: &str, more: &[&Path]) -> String {
        let mut phiw = Command::cargo_bin("phiw").unwrap();
        phiw.arg(command).arg("--urdf").arg(self.path("robot.urdf"));
        phiw.arg("--train").arg(self.path("train.csv")).arg("--validate").arg(self.path("validate.csv"));
        phiw.args(["--declare", "viscous_friction"]).arg("--out").arg(self.path(out));
        if let [model] = more {
            phiw.arg("--model").arg(model);
        } else {
            phiw.args(more);
        }
        String::from_utf8(phiw.assert().success().get_output().stdout.clone()).unwrap()
    }

    fn report(&self, out: &str) -> ReportJson {
        ReportJson::from_json(&fs::read_to_string(self.path(out).join("report.json")).unwrap()).unwrap()
    }
}

fn add(log: &mut Recording, secret: &impl Fn(&[f64], &[f64], &mut [f64])) {
    let joints = log.joints.len();
    let rows = log.t.len();
    for row in 0..rows {
        let at = |row: usize| row * joints..(row + 1) * joints;
        let (before, after) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let qd: Vec<f64> = (0..joints)
            .map(|joint| {
                (log.q[after * joints + joint] - log.q[before * joints + joint])
                    / (log.t[after] - log.t[before])
            })
            .collect();
        let q = log.q[at(row)].to_vec();
        secret(&q, &qd, &mut log.tau[at(row)]);
    }
}

#[test]
fn a_right_model_is_sufficient() {
    let scene = Scene::new(|_, _, _| ());
    let printed = scene.run("explain", "out", &[]);
    let report = scene.report("out");
    assert_eq!((report.verdict, report.effects.len()), (Some(Verdict::Sufficient), 0));
    assert!(!report.remaining.structured);
    assert!(printed.contains("is sufficient"), "{printed}");
}

#[test]
fn a_missing_friction_is_named_and_the_model_with_it_is_the_next_declared_model() {
    let scene = Scene::new(|_, qd, torque| torque[1] += 2.0 * (qd[1] / 0.005).tanh());
    let printed = scene.run("explain", "out", &[]);
    let report = scene.report("out");
    assert_eq!(report.verdict, Some(Verdict::Explained), "{printed}");
    let [found] = report.effects.as_slice() else { panic!("{printed}") };
    assert_eq!(
        (found.kind.as_str(), found.joints.as_slice()),
        ("coulomb_friction", ["joint_2".to_owned()].as_slice())
    );
    let fc = &found.parameters["joint_2"]["fc"];
    assert!((fc.value - 2.0).abs() < 0.1 && fc.unit == "N·m", "{fc:?}");
    assert!(found.explains > 0.95, "{}", found.explains);
    assert!(report.after.validate.relative < report.before.validate.relative);
    assert!(printed.contains("joint_2 has Coulomb friction"), "{printed}");
    let page = fs::read_to_string(scene.path("out/report.html")).unwrap();
    assert!(page.contains("coulomb_friction") && page.contains("id=\"reproduction\""));

    // Moved by the torques held out, the model goes with the robot further than the URDF, which has no
    // friction.
    let reproduction = report.phiw.unwrap().reproduction.unwrap();
    let (identified, nominal) = (reproduction.identified.unwrap(), reproduction.nominal.unwrap());
    assert!(reproduction.windows > 0 && !identified.share_of_travel.is_empty());
    for (identified, nominal) in identified.share_of_travel.iter().zip(&nominal.share_of_travel) {
        assert!(identified < nominal, "{identified} {nominal}");
    }

    // Held, the grown model has nothing left to explain on the same robot.
    let model = scene.path("out/model.json");
    scene.run("explain", "again", &[&model]);
    let again = scene.report("again");
    assert_eq!((again.verdict, again.effects.len()), (Some(Verdict::Sufficient), 0));
}

#[test]
fn bootstrap_draws_say_how_often_an_effect_is_named() {
    let scene = Scene::new(|_, qd, torque| torque[1] += 2.0 * (qd[1] / 0.005).tanh());
    let printed = scene.run("explain", "out", &[Path::new("--draws"), Path::new("3")]);
    let report = scene.report("out");
    let draws =
        report.phiw.as_ref().and_then(|program| program.draws.as_ref()).expect("draws were asked for");
    assert_eq!(draws.count, 3);
    let first = &draws.named[0];
    assert_eq!(
        (first.kind.as_str(), first.joints[0].as_str(), first.draws),
        ("coulomb_friction", "joint_2", 3)
    );
    assert_eq!(report.phiw.as_ref().map(|program| program.evidence[0].stability), Some(1.0));
    assert!(printed.contains("Named on 3 bootstrap draws"), "{printed}");
}

#[test]
fn against_a_held_model_a_payload_is_found() {
    let clean = Scene::new(|_, _, _| ());
    clean.run("identify", "out", &[]);
    // The same robot with 0.8 kg more on its last link.
    let heavier = synthetic::URDF.replace(
        r#"<link name="link_3"><inertial><origin xyz="0.15 -0.02 0.02"/><mass value="1.5"/>"#,
        r#"<link name="link_3"><inertial><origin xyz="0.18 -0.02 0.02"/><mass value="2.3"/>"#,
    );
    assert_ne!(heavier, synthetic::URDF);
    let loaded = Scene::new(|_, _, _| ());
    for (seed, name) in [(5, "train.csv"), (6, "validate.csv")] {
        let log = synthetic::recording_of(&heavier, seed, 60.0);
        fs::write(loaded.path(name), synthetic::csv(&log)).unwrap();
    }
    let printed = loaded.run("explain", "out", &[&clean.path("out/model.json")]);
    let report = loaded.report("out");
    let [found] = report.effects.as_slice() else { panic!("{printed}") };
    assert_eq!(
        (found.kind.as_str(), found.joints.as_slice()),
        ("payload", ["joint_3".to_owned()].as_slice()),
        "{printed}"
    );
    assert!((found.parameters["joint_3"]["m"].value - 0.8).abs() < 0.2, "{printed}");
    assert!(report.after.validate.relative.unwrap() < 0.5 * report.before.validate.relative.unwrap());
}

#[test]
fn a_model_that_does_not_fit_is_refused() {
    let scene = Scene::new(|_, _, _| ());
    scene.run("identify", "out", &[]);
    let good: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(scene.path("out/model.json")).unwrap()).unwrap();
    let spoiled = |spoil: &dyn Fn(&mut serde_json::Value)| {
        let mut model = good.clone();
        spoil(&mut model);
        model.to_string()
    };
    let other_joint = spoiled(&|model| model["joints"][1] = "elbow".into());
    let other_kinematics = spoiled(&|model| {
        let parameters = model["base_parameters"].as_array_mut().unwrap();
        let mut more = parameters[0].clone();
        more["name"] = "elbow.m".into();
        parameters.insert(0, more);
    });
    let other_bodies = spoiled(&|model| {
        model["bodies"].as_array_mut().unwrap().remove(0);
    });
    for (text, expected) in [
        ("{}", "model.json: not a model.json of phiw"),
        ("nonsense", "model.json: not a model.json of phiw"),
        // The file and the first difference were not named.
        (&other_joint, "robot.urdf: joint 2 is `elbow` in the model but `joint_2` in the URDF"),
        (&other_kinematics, "robot.urdf: the kinematics differ"),
        (&other_kinematics, "base parameter 1 is `elbow.m` in the model"),
        (&other_bodies, "robot.urdf: the model has 2 bodies, but the URDF 3"),
    ] {
        fs::write(scene.path("model.json"), text).unwrap();
        let mut phiw = Command::cargo_bin("phiw").unwrap();
        phiw.arg("explain")
            .arg("--urdf")
            .arg(scene.path("robot.urdf"))
            .arg("--train")
            .arg(scene.path("train.csv"));
        phiw.arg("--model").arg(scene.path("model.json")).arg("--out").arg(scene.path("refused"));
        let output = phiw.assert().code(2).get_output().clone();
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(message.contains(expected) && message.contains("model.json"), "{message}");
        assert!(!scene.path("refused").exists());
    }
}
