//! A verdict rests on motion held out: on all of it, and on nothing where there is none.

use crate::synthetic;

use assert_cmd::Command;
use phiw_dynamics::random_tree::RandomNumbers;
use phiw_report::ReportJson;
use phiw_telemetry::Recording;
use std::fs;
use tempfile::TempDir;

/// Runs a command on the logs, and gives its output and the folder that it worked in.
fn run(command: &str, train: &Recording, validate: Option<&Recording>) -> (std::process::Output, TempDir) {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    fs::write(path("train.csv"), synthetic::csv(train)).unwrap();
    let mut phiw = Command::cargo_bin("phiw").unwrap();
    phiw.arg(command).arg("--urdf").arg(path("robot.urdf")).arg("--train").arg(path("train.csv"));
    if let Some(validate) = validate {
        fs::write(path("validate.csv"), synthetic::csv(validate)).unwrap();
        phiw.arg("--validate").arg(path("validate.csv"));
    }
    phiw.args(["--declare", "viscous_friction"]).arg("--out").arg(path("out"));
    (phiw.output().unwrap(), folder)
}

fn report(folder: &TempDir) -> ReportJson {
    ReportJson::from_json(&fs::read_to_string(folder.path().join("out/report.json")).unwrap()).unwrap()
}

/// A friction of which the model knows nothing, from the middle of the log's last part on.
fn log() -> Recording {
    let mut log = synthetic::recording(1, 40.0);
    for row in 1..log.t.len() {
        let speed = (log.q[3 * row + 1] - log.q[3 * row - 2]) * synthetic::RATE;
        log.tau[3 * row + 1] += 2.0 * (speed / 0.005).tanh();
    }
    log
}

/// Stamps since 1970 were widened by a billionth of themselves, 1.7 s: training swallowed the start of what
/// was held out.
#[test]
fn stamps_since_1970_say_the_same_as_stamps_from_zero() {
    let zero = log();
    let mut epoch = zero.clone();
    epoch.t.iter_mut().for_each(|t| *t += 1.7e9);
    for command in ["identify", "explain"] {
        let [zero, epoch] = [&zero, &epoch].map(|log| {
            let (output, folder) = run(command, log, None);
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            report(&folder)
        });
        let kinds = |report: &ReportJson| {
            report
                .effects
                .iter()
                .map(|effect| (effect.kind.clone(), effect.joints.clone()))
                .collect::<Vec<_>>()
        };
        assert_eq!((zero.verdict, kinds(&zero)), (epoch.verdict, kinds(&epoch)));
        let of = |report: &ReportJson| report.after.validate.relative.unwrap();
        assert!((of(&zero) / of(&epoch) - 1.0).abs() < 1e-3, "{} {}", of(&zero), of(&epoch));
    }
}

/// The log stands still from `start` to `end` \[s\].
fn still(log: &mut Recording, start: f64, end: f64) {
    let first = (start * synthetic::RATE) as usize;
    for row in first..((end * synthetic::RATE) as usize).min(log.t.len()) {
        for joint in 0..3 {
            log.q[3 * row + joint] = log.q[3 * first + joint];
        }
    }
}

fn refused(command: &str, train: &Recording, validate: Option<&Recording>, expected: &str) {
    let (output, folder) = run(command, train, validate);
    let message = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(expected) && message.contains("no joint moves there"), "{message}");
    assert!(!folder.path().join("out").exists());
}

/// What had a name, and what stayed in the model, was judged on the very motion whose error was reported: a
/// log held out in which the friction is half as large, or the torques are noise, told another model.
#[test]
fn what_is_found_does_not_depend_on_the_log_that_is_held_out() {
    let with_friction = |seed: u64, size: f64, noise: f64| {
        let mut random = RandomNumbers::new(seed);
        let mut log = synthetic::recording(seed, 30.0);
        for row in 1..log.t.len() {
            let speed = (log.q[3 * row + 1] - log.q[3 * row - 2]) * synthetic::RATE;
            log.tau[3 * row + 1] += size * (speed / 0.005).tanh();
            (0..3).for_each(|joint| log.tau[3 * row + joint] += noise * random.uniform(-1.0, 1.0));
        }
        log
    };
    let train = with_friction(1, 2.0, 0.2);
    let held_out = [with_friction(2, 2.0, 0.2), with_friction(3, 1.0, 0.2), with_friction(4, 2.0, 3.0)];
    let found = held_out.map(|validate| {
        let (output, folder) = run("explain", &train, Some(&validate));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let report = report(&folder);
        assert!(
            report.effects.iter().any(|effect| effect.kind == "coulomb_friction"),
            "{:?}",
            report.effects
        );
        let kinds = report.effects.iter().chain(&report.refinements);
        let kinds: Vec<String> = kinds.map(|effect| format!("{} {:?}", effect.kind, effect.joints)).collect();
        (kinds, fs::read_to_string(folder.path().join("out/identified.urdf")).unwrap())
    });
    assert!(found.iter().all(|other| *other == found[0]), "{:?}", found.map(|(kinds, _)| kinds));
}

/// It was called sufficient, with an error of "– %".
#[test]
fn a_robot_at_rest_where_held_out_gets_no_verdict() {
    let mut rests = synthetic::recording(1, 40.0);
    still(&mut rests, 26.0, 40.0);
    let mut constant = synthetic::recording(2, 20.0);
    still(&mut constant, 0.0, 20.0);
    for command in ["identify", "explain"] {
        refused(command, &rests, None, "the last 30 % of");
        refused(command, &synthetic::recording(1, 40.0), Some(&constant), "validate.csv");
    }
}

#[test]
fn a_joint_at_rest_where_held_out_is_said() {
    let mut validate = synthetic::recording(2, 20.0);
    let rows = validate.t.len();
    (0..rows).for_each(|row| validate.q[3 * row + 2] = 0.3);
    let (output, folder) = run("identify", &synthetic::recording(1, 40.0), Some(&validate));
    assert!(output.status.success());
    let warnings = report(&folder).phiw.unwrap().warnings;
    assert!(
        warnings.iter().any(|line| line.contains("`joint_3` does not move in what is held out")),
        "{warnings:?}"
    );
}

/// The variants of an effect had different numbers of determined columns: "columns of the merged factor has
/// 49 elements, but this robot needs 48".
#[test]
fn short_logs_and_effects_that_need_the_models_torque_end_in_a_result_or_a_reason() {
    let whole = synthetic::recording(1, 20.0);
    let declared = "viscous_friction,coulomb_friction,load_dependent_friction";
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    let (mut results, mut nothing_held_out) = (0, 0);
    for (case, rows) in (10..200).step_by(19).chain([400, 4000]).enumerate() {
        let mut log = whole.clone();
        log.t.truncate(rows);
        log.q.truncate(3 * rows);
        log.tau.truncate(3 * rows);
        fs::write(path("train.csv"), synthetic::csv(&log)).unwrap();
        for command in ["identify", "explain"] {
            let mut phiw = Command::cargo_bin("phiw").unwrap();
            phiw.arg(command).arg("--urdf").arg(path("robot.urdf")).arg("--train").arg(path("train.csv"));
            let out = path(&format!("{command}-{case}"));
            let output = phiw.args(["--declare", declared]).arg("--out").arg(&out).output().unwrap();
            let message = String::from_utf8_lossy(&output.stderr);
            let code = output.status.code().unwrap();
            assert!(code == 0 || code == 2, "{rows} rows, {command}: {message}");
            assert!(
                code == 0 || message.starts_with("error: ") && !message.contains("elements"),
                "{message}"
            );
            if code == 0 {
                // A result has an error on what was held out.
                let report = fs::read_to_string(out.join("report.json")).unwrap();
                let report = ReportJson::from_json(&report).unwrap();
                assert!(report.after.validate.relative.is_some_and(|error| error > 0.0 && error.is_finite()));
                results += 1;
            } else {
                assert!(!out.exists());
                nothing_held_out += usize::from(message.contains("no joint moves there for long enough"));
            }
        }
    }
    // Both commands, on the log whose rows suffice for training but not for what is held out.
    assert!(results >= 2 && nothing_held_out >= 2, "{results} {nothing_held_out}");
}

/// Every log had a say in the cut-offs, so a faster, quieter or slower sampled log held out changed the fit.
#[test]
fn a_validation_log_of_other_noise_does_not_change_the_parameters() {
    let mut random = RandomNumbers::new(3);
    let mut noisy = |mut log: Recording, size: f64| {
        log.q.iter_mut().for_each(|q| *q += size * random.uniform(-1.0, 1.0));
        log
    };
    let train = noisy(synthetic::recording(1, 40.0), 1e-4);
    let quiet = synthetic::recording(2, 20.0);
    let loud = noisy(quiet.clone(), 1e-2);
    let mut shaking = quiet.clone();
    for (row, t) in quiet.t.iter().enumerate() {
        (0..3).for_each(|joint| shaking.q[3 * row + joint] += 0.01 * (60.0 * t).sin());
    }
    let mut sparse = quiet.clone();
    let every_eighth = |values: &[f64], width: usize| -> Vec<f64> {
        values.chunks_exact(width).step_by(8).flatten().copied().collect()
    };
    sparse.t = every_eighth(&quiet.t, 1);
    sparse.q = every_eighth(&quiet.q, 3);
    sparse.tau = every_eighth(&quiet.tau, 3);
    let fitted = [&quiet, &loud, &shaking, &sparse].map(|validate| {
        let (output, folder) = run("identify", &train, Some(validate));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        fs::read_to_string(folder.path().join("out/identified.urdf")).unwrap()
    });
    assert!(fitted.iter().all(|urdf| *urdf == fitted[0]));
}
