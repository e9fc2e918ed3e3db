//! `phiw predict`: what an identified model says of logs, row by row.

use crate::synthetic;

use assert_cmd::Command;
use phiw::arguments::PredictArguments;
use phiw::console::Console;
use phiw::predict::predict;
use phiw_report::ReportJson;
use phiw_telemetry::Recording;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A folder with the robot, two logs of it, and what is made of them.
struct Scene(TempDir);

impl Scene {
    fn new(urdf: &str) -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("robot.urdf"), urdf).unwrap();
        for (seed, name) in [(1, "train.csv"), (2, "validate.csv")] {
            let log = synthetic::recording_of(urdf, seed, 40.0);
            fs::write(folder.path().join(name), synthetic::csv(&log)).unwrap();
        }
        Scene(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Exit status, standard output and standard error.
    fn run(&self, line: &str) -> (i32, String, String) {
        let output =
            Command::cargo_bin("phiw").unwrap().current_dir(&self.0).args(line.split(' ')).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (output.status.code().unwrap(), text(&output.stdout), text(&output.stderr))
    }

    fn done(&self, line: &str) -> String {
        let (status, stdout, stderr) = self.run(line);
        assert_eq!(status, 0, "{line}: {stderr}");
        stdout
    }

    fn identified(urdf: &str) -> Self {
        let scene = Scene::new(urdf);
        scene.done(IDENTIFY);
        scene
    }

    /// The prediction is refused with a message that holds `expected`, and nothing is written.
    fn refused(&self, line: &str, expected: &[&str]) {
        let before = names(self.0.path());
        let (status, stdout, stderr) = self.run(line);
        assert_eq!((status, stdout.as_str(), stderr.lines().count()), (2, "", 1), "{line}: {stderr}");
        expected.iter().for_each(|part| assert!(stderr.contains(part), "no `{part}` in {stderr}"));
        assert_eq!(names(self.0.path()), before, "{line}");
    }

    fn log(&self, name: &str, recording: &Recording) {
        fs::write(self.path(name), synthetic::csv(recording)).unwrap();
    }

    fn table(&self, name: &str) -> Table {
        Table::read(&self.path(name))
    }
}

const IDENTIFY: &str = "identify --urdf robot.urdf --train train.csv --validate validate.csv --declare viscous_friction,coulomb_friction --out out";
const PREDICT: &str = "predict --model out/model.json validate.csv --out predicted.csv";

fn names(folder: &Path) -> Vec<String> {
    let entries = folder.read_dir().unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// The predictions as they are in the file.
struct Table {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap();
        let cells = |line: &str| line.split(',').map(str::to_owned).collect::<Vec<_>>();
        let mut lines = text.lines().map(cells);
        let names = lines.next().unwrap();
        let rows: Vec<_> = lines.collect();
        assert!(rows.iter().all(|row| row.len() == names.len()));
        Table { names, rows }
    }

    fn texts(&self, name: &str) -> Vec<String> {
        let place = self.names.iter().position(|other| other == name);
        let place = place.unwrap_or_else(|| panic!("no {name} in {:?}", self.names));
        self.rows.iter().map(|row| row[place].clone()).collect()
    }

    fn numbers(&self, name: &str) -> Vec<f64> {
        self.texts(name).iter().map(|cell| cell.parse().unwrap_or(f64::NAN)).collect()
    }
}

/// What the report says of the validation log is what the model predicts of it, joint by joint, behind the
/// training logs: a drift counts the time since the session began.
///
/// Columns made of the model's own torque (load-dependent friction) take it from the fitted model here, but
/// from the one before it during the fit: then the `tolerance` has to be larger.
fn same_errors(scene: &Scene, train: &[&str], validate: &str, tolerance: f64) {
    let report = ReportJson::from_json(&fs::read_to_string(scene.path("out/report.json")).unwrap()).unwrap();
    let arguments = PredictArguments {
        model: scene.path("out/model.json"),
        logs: train.iter().chain([&validate]).map(|log| scene.path(log)).collect(),
        out: scene.path("predicted.csv"),
        ..PredictArguments::default()
    };
    let outcome = predict(&arguments, &Console::silent()).unwrap();
    let errors = outcome.of_logs.last().unwrap();
    for (row, joint) in report.joints.iter().enumerate() {
        let (expected, rmse) = (report.after.validate.rmse[joint], errors.rmse(row));
        assert!(
            (rmse - expected).abs() < tolerance * expected,
            "{joint}: {rmse}, but {expected} in the report"
        );
    }
    let relative = report.after.validate.relative.unwrap();
    assert!((errors.relative() - relative).abs() < tolerance * relative);
    // A drift that counts from the start of each log needs no log before it.
    let model: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(scene.path("out/model.json")).unwrap()).unwrap();
    let counts_time = model["effects"]
        .as_array()
        .unwrap()
        .iter()
        .any(|effect| effect["kind"] == "thermal_drift" && effect["constants"]["from_log_start"] != 1.0);
    let is_said = outcome.warnings.iter().any(|warning| warning.contains("since its session began"));
    assert_eq!(is_said, counts_time, "{:?}", outcome.warnings);
}

#[test]
fn a_prediction_has_the_errors_that_the_report_has_of_the_same_log() {
    let slide =
        synthetic::URDF.replace(r#"name="joint_2" type="revolute""#, r#"name="joint_2" type="prismatic""#);
    let turned = synthetic::URDF.replace(r#"<axis xyz="0 1 0"/>"#, r#"<axis xyz="0.6 0 0.8"/>"#);
    for urdf in [synthetic::URDF, &slide, &turned] {
        let scene = Scene::identified(urdf);
        same_errors(&scene, &[], "validate.csv", 1e-9);
    }
    let scene = Scene::new(synthetic::URDF);
    scene.done(
        &IDENTIFY
            .replace("identify", "explain")
            .replace("viscous_friction,coulomb_friction", "rotor_inertia"),
    );
    same_errors(&scene, &[], "validate.csv", 1e-9);
    let header = scene.table("predicted.csv").names.join(",");
    assert!(header.contains("viscous_friction.joint_1"), "found effects have columns, too: {header}");
}

#[test]
fn a_prediction_of_real_robots_has_the_errors_that_the_report_has() {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/logs");
    let robots = [
        ("tx40", "train.csv", "validate.csv"),
        ("emps", "train.csv", "validate.csv"),
        ("kr300", "traj_A.csv", "traj_B.csv"),
    ];
    for (robot, train, validate) in robots {
        let file = |name: &str| data.join(robot).join(name).display().to_string();
        let urdf = file(&format!("{robot}.urdf"));
        if !Path::new(&urdf).exists() {
            println!("skipped: {urdf} is absent");
            continue;
        }
        let scene = Scene(TempDir::new().unwrap());
        let (train, validate) = (file(train), file(validate));
        for command in ["identify", "explain"] {
            scene.done(&format!(
                "{command} --urdf {urdf} --train {train} --validate {validate} \
                 --declare viscous_friction,coulomb_friction,rotor_inertia --out out"
            ));
            same_errors(&scene, &[&train], &validate, if command == "identify" { 1e-9 } else { 0.03 });
        }
    }
}

#[test]
fn every_row_has_the_torque_its_deviation_the_residual_and_each_effect() {
    let scene = Scene::identified(synthetic::URDF);
    let stdout = scene.done(PREDICT);
    let table = scene.table("predicted.csv");
    let joints = ["joint_1", "joint_2", "joint_3"];
    let of = |what: &str| joints.map(|joint| format!("{what}.{joint}"));
    let expected: Vec<String> = std::iter::once("t".to_owned())
        .chain(
            ["tau", "tau_std", "residual", "viscous_friction", "coulomb_friction"]
                .iter()
                .flat_map(|what| of(what)),
        )
        .collect();
    assert_eq!(table.names, expected);
    // Every row but the few at the ends, where the filter's kernel is cut.
    let log = synthetic::recording(2, 40.0);
    let t = table.numbers("t");
    assert!(t.len() > log.t.len() - 100 && t.len() < log.t.len());
    assert!(t.iter().all(|t| log.t.contains(t)));
    let first = log.t.iter().position(|other| *other == t[0]).unwrap();
    for (index, joint) in joints.iter().enumerate() {
        let (tau, std) = (table.numbers(&format!("tau.{joint}")), table.numbers(&format!("tau_std.{joint}")));
        let residual = table.numbers(&format!("residual.{joint}"));
        // Filtered alike, so what was measured is their sum but for the noise that the filter takes away.
        let difference = |row: usize| tau[row] + residual[row] - log.tau[(first + row) * 3 + index];
        let rms = ((0..t.len()).map(|row| difference(row).powi(2)).sum::<f64>() / t.len() as f64).sqrt();
        assert!(rms < 1.1 * synthetic::NOISE[index], "{joint}: {rms}");
        let friction = table.numbers(&format!("viscous_friction.{joint}"));
        let speed = |row: usize| {
            let at = |row: usize| log.q[(first + row) * 3 + index];
            (at(row + 1) - at(row - 1)) * 0.5 * synthetic::RATE
        };
        let squares = |of: &dyn Fn(usize) -> f64| (1..t.len() - 1).map(|row| of(row).powi(2)).sum::<f64>();
        let error = squares(&|row| friction[row] - synthetic::VISCOUS[index] * speed(row))
            / squares(&|row| friction[row]);
        assert!(error < 0.05_f64.powi(2), "{joint}: {error}");
        assert!(std.iter().all(|std| *std > 0.0 && *std < synthetic::NOISE[index]), "{joint}");
    }
    // 40 s of white noise under a right model: the band holds what it says.
    let band = stdout.lines().find(|line| line.starts_with("pooled")).unwrap();
    let share = band.split_whitespace().rev().nth(4).unwrap().parse::<f64>().unwrap();
    assert!((93.0..97.0).contains(&share), "{share} % in\n{stdout}");
}

#[test]
fn a_gap_of_a_log_is_a_gap_of_its_prediction() {
    let scene = Scene::identified(synthetic::URDF);
    let text = fs::read_to_string(scene.path("validate.csv")).unwrap();
    let t = |line: &str| line.split(',').next().unwrap().parse().unwrap_or(f64::NAN);
    let left: Vec<&str> = text.lines().filter(|line| !(10.0..=12.0).contains(&t(line))).collect();
    fs::write(scene.path("validate.csv"), left.join("\n") + "\n").unwrap();
    scene.done(PREDICT);
    let times = scene.table("predicted.csv").numbers("t");
    assert!(times.iter().all(|t| !(10.0..=12.0).contains(t)));
    assert!(times.iter().any(|t| *t < 10.0) && times.iter().any(|t| *t > 12.0));
}

#[test]
fn logs_without_torque_are_predicted_and_each_row_of_several_names_its_log() {
    let scene = Scene::identified(synthetic::URDF);
    let mut motion = synthetic::recording(3, 10.0);
    motion.tau.clear();
    scene.log("motion.csv", &motion);
    let stdout = scene.done(&PREDICT.replace("validate.csv", "motion.csv"));
    assert!(stdout.contains("nothing to compare with"), "{stdout}");
    let alone = scene.table("predicted.csv");
    assert!(alone.names.iter().all(|name| !name.starts_with("residual.") && name != "log"));
    let stdout = scene.done(&PREDICT.replace("validate.csv", "validate.csv motion.csv"));
    assert!(stdout.contains("validate.csv: ") && !stdout.contains("motion.csv: "), "{stdout}");
    let both = scene.table("predicted.csv");
    let (logs, residuals) = (both.texts("log"), both.texts("residual.joint_2"));
    assert_eq!(logs.iter().filter(|log| *log == "motion.csv").count(), alone.rows.len());
    for (log, residual) in logs.iter().zip(&residuals) {
        assert_eq!(residual.is_empty(), log == "motion.csv");
    }
    let end = both.numbers("tau.joint_2").split_off(both.rows.len() - alone.rows.len());
    assert_eq!(end, alone.numbers("tau.joint_2"), "a log is predicted as it is by itself");
}

#[test]
fn a_held_joint_needs_no_column_and_counts_where_it_stands() {
    let scene = Scene::identified(synthetic::URDF);
    let mut log = synthetic::recording(2, 10.0);
    log.q.iter_mut().skip(2).step_by(3).for_each(|q| *q = 0.4);
    scene.log("still.csv", &log);
    scene.done(&PREDICT.replace("validate.csv", "still.csv"));
    let all = scene.table("predicted.csv");
    let text = fs::read_to_string(scene.path("still.csv")).unwrap();
    fs::write(scene.path("still.csv"), text.replace("joint_3", "ignored")).unwrap();
    scene.refused(
        &PREDICT.replace("validate.csv", "still.csv"),
        &["still.csv", "q.joint_3", "hold the joint"],
    );
    let hold = " --hold joint_3=0.4";
    scene.done(&(PREDICT.replace("validate.csv", "still.csv") + hold));
    let held = scene.table("predicted.csv");
    for name in ["tau.joint_1", "tau.joint_2", "tau.joint_3", "tau_std.joint_1"] {
        for (one, other) in all.numbers(name).iter().zip(held.numbers(name)) {
            assert!((one - other).abs() < 1e-6, "{name}: {one} {other}");
        }
    }
    assert!(!held.names.contains(&"residual.joint_3".to_owned()));
    // What the model itself holds cannot be held elsewhere.
    scene.done(&(IDENTIFY.replace("train.csv", "still.csv") + hold));
    scene.done(&PREDICT.replace("validate.csv", "still.csv"));
    scene.done(&(PREDICT.replace("validate.csv", "still.csv") + hold));
    scene.refused(
        &(PREDICT.replace("validate.csv", "still.csv") + " --hold joint_3=0.5"),
        &["--hold joint_3=0.5", "out/model.json", "held at 0.4"],
    );
    scene.refused(&(PREDICT.to_owned() + " --hold elbow"), &["out/model.json", "elbow"]);
}

#[test]
fn what_cannot_be_predicted_from_is_refused_and_leaves_nothing() {
    let scene = Scene::identified(synthetic::URDF);
    let good = fs::read_to_string(scene.path("out/model.json")).unwrap();
    let spoiled = |spoil: &dyn Fn(&mut serde_json::Value)| {
        let mut model: serde_json::Value = serde_json::from_str(&good).unwrap();
        spoil(&mut model);
        fs::write(scene.path("model.json"), model.to_string()).unwrap();
    };
    let line = PREDICT.replace("out/model.json", "model.json");
    // As an earlier phiw wrote it.
    spoiled(&|model| {
        let model = model.as_object_mut().unwrap();
        ["urdf", "covariance", "base_map", "data", "rest_speeds"].iter().for_each(|key| {
            model.remove(*key);
        });
        model.insert("schema".to_owned(), 1.into());
    });
    scene.refused(&line, &["model.json", "earlier phiw", "phiw identify"]);
    scene.done(
        &(IDENTIFY.replace("identify", "explain").replace("--out out", "--out other")
            + " --model model.json"),
    );
    spoiled(&|model| model["urdf"] = "<robot".into());
    scene.refused(&line, &["model.json: the robot in it"]);
    spoiled(&|model| model["urdf"] = model["urdf"].as_str().unwrap().replace("joint_3", "joint_4").into());
    scene.refused(&line, &["model.json", "joint_3", "joint_4"]);
    spoiled(&|model| model["covariance"]["entries"] = vec![1.0].into());
    scene.refused(&line, &["model.json", "covariance"]);
    spoiled(&|model| model["covariance"]["parameters"][0] = 10_000.into());
    scene.refused(&line, &["model.json", "covariance"]);
    spoiled(&|model| model["rest_speeds"] = vec![1.0].into());
    scene.refused(&line, &["model.json", "rest_speeds"]);
    spoiled(&|model| model["schema"] = 3.into());
    scene.refused(&line, &["model.json", "schema 3"]);
    scene.refused(&PREDICT.replace("out/model.json", "validate.csv"), &["validate.csv", "not a model.json"]);
    scene.refused(&PREDICT.replace("validate.csv", "absent.csv"), &["absent.csv", "no such file"]);
    scene.refused(&PREDICT.replace("predicted.csv", "validate.csv"), &["overwrite the input"]);
    scene.refused(&PREDICT.replace("predicted.csv", "out"), &["out", "folder"]);
    scene.refused(&(PREDICT.to_owned() + " --cutoff-hz 900"), &["validate.csv", "900 Hz"]);
    fs::write(scene.path("bad.csv"), "t,q.joint_1,q.joint_2,q.joint_3\n0,1,2,3\n0.1,1,x,3\n").unwrap();
    scene.refused(&PREDICT.replace("validate.csv", "bad.csv"), &["bad.csv", "q.joint_2", "3"]);
    // What was there stays as it was when a later run fails.
    fs::write(scene.path("predicted.csv"), "mine").unwrap();
    scene.refused(&PREDICT.replace("validate.csv", "bad.csv"), &["bad.csv"]);
    assert_eq!(fs::read_to_string(scene.path("predicted.csv")).unwrap(), "mine");
}

#[test]
fn a_model_can_be_carried_away_with_what_it_was_made_of() {
    let scene = Scene::identified(synthetic::URDF);
    let model: phiw_identification::Model =
        serde_json::from_str(&fs::read_to_string(scene.path("out/model.json")).unwrap()).unwrap();
    assert_eq!(model.urdf.as_deref(), Some(synthetic::URDF));
    let logs: Vec<(&str, u64)> = model.data.iter().map(|data| (data.log.as_str(), data.used_rows)).collect();
    assert_eq!(logs, [("train.csv", 8000), ("validate.csv", 8000)]);
    assert!(
        model.data.iter().all(|data| data.sha256.len() == 64) && model.data[0].sha256 != model.data[1].sha256
    );
    // The map gives the base parameters of the standard ones in the file.
    let standard: Vec<f64> = model.bodies.iter().flat_map(|body| body.inertial).collect();
    let base = model.base_map.unwrap().base_of(&standard);
    assert_eq!(base.len(), model.base_parameters.len());
    for (mapped, parameter) in base.iter().zip(&model.base_parameters) {
        assert!((mapped - parameter.value).abs() < 1e-8 * (1.0 + mapped.abs()), "{}", parameter.name);
    }
    // The diagonal of the covariance is what is said of each parameter.
    let covariance = model.covariance.unwrap();
    let deviations = covariance.deviations(base.len() + 6).unwrap();
    let effects = model.effects.iter().flat_map(|effect| &effect.parameters);
    for (index, parameter) in model.base_parameters.iter().chain(effects).enumerate() {
        if let Some(std) = parameter.std {
            let variance: f64 = deviations.iter().map(|deviation| deviation[index].powi(2)).sum();
            assert!((variance.sqrt() - std).abs() < 1e-6 * std, "{}", parameter.name);
        }
    }
    fs::remove_file(scene.path("robot.urdf")).unwrap();
    scene.done(PREDICT);
}
