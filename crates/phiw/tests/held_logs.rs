//! Logs that are faster than what they log, and logs with rows of zeros, give what the log gives that they
//! were made of, and it is said.

use crate::synthetic;

use phiw::arguments::{ExplainArguments, SessionArguments};
use phiw::console::Console;
use phiw::explain::explain;
use phiw_telemetry::Recording;
use tempfile::TempDir;

/// Effects by name, with their joints.
type Names = Vec<(String, Vec<String>)>;

/// What `explain` says of two logs, the second of which is held out: the names, the error before and after,
/// and the warnings.
fn explained(logs: [Recording; 2]) -> (Names, [f64; 2], Vec<String>) {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    std::fs::write(path("robot.urdf"), synthetic::URDF).unwrap();
    for (log, name) in logs.iter().zip(["train.csv", "validate.csv"]) {
        std::fs::write(path(name), synthetic::csv(log)).unwrap();
    }
    let session = SessionArguments {
        urdf: path("robot.urdf"),
        train: vec![path("train.csv")],
        validate: vec![path("validate.csv")],
        out: path("out"),
        ..SessionArguments::default()
    };
    let arguments = ExplainArguments { session, ..ExplainArguments::default() };
    let report = explain(&arguments, &Console::silent()).unwrap().report;
    let names: Names =
        report.effects.iter().map(|effect| (effect.kind.clone(), effect.joints.clone())).collect();
    let errors = [&report.before, &report.after].map(|errors| errors.validate.relative.unwrap());
    (names, errors, report.phiw.expect("what phiw adds").warnings)
}

/// Each row of a log at the place of the row that `read` says.
fn held(log: &Recording, rows: usize) -> Recording {
    let joints = log.joints.len();
    let of = |values: &[f64]| {
        let rows_read = (0..log.t.len()).map(|row| row / rows * rows);
        rows_read.flat_map(|row| values[joints * row..][..joints].to_vec()).collect()
    };
    Recording { q: of(&log.q), tau: of(&log.tau), ..log.clone() }
}

/// Every so many rows of a log alone.
fn thinned(log: &Recording, rows: usize) -> Recording {
    let joints = log.joints.len();
    let of = |values: &[f64]| values.chunks(joints).step_by(rows).flatten().copied().collect();
    let t = log.t.iter().step_by(rows).copied().collect();
    Recording { t, q: of(&log.q), tau: of(&log.tau), ..log.clone() }
}

/// Rows of a bus at a quarter of the logger's rate stood four times each. `explain` named false delays and
/// left 13 % of the torque where the bus's own rows leave 0.6 %, and said nothing of it.
#[test]
fn a_held_log_gives_the_model_of_the_log_that_it_was_made_of() {
    let logs = || [synthetic::recording(1, 30.0), synthetic::recording(2, 20.0)];
    let (names, errors, warnings) = explained(logs().map(|log| thinned(&log, 4)));
    assert!(!names.is_empty() && names.iter().all(|(kind, _)| kind == "viscous_friction"), "{names:?}");
    assert!(!warnings.iter().any(|warning| warning.contains("repeat")), "{warnings:?}");
    let (held_names, held_errors, warnings) = explained(logs().map(|log| held(&log, 4)));
    assert_eq!((held_names, held_errors), (names, errors));
    assert!(warnings.iter().any(|warning| warning.contains("the repeats are left out")), "{warnings:?}");
}

/// On an arm of six joints, positions of the wrist that were read at a quarter of the log's rate were named
/// elasticities of its drives.
#[test]
fn held_positions_name_what_fresh_ones_do() {
    let logs = || [synthetic::recording(1, 30.0), synthetic::recording(2, 20.0)];
    let stale = |log: Recording| {
        let mut q = held(&log, 4).q;
        q.iter_mut().zip(&log.q).step_by(log.joints.len()).for_each(|(q, fresh)| *q = *fresh);
        Recording { q, ..log }
    };
    let (names, errors, _) = explained(logs());
    let (found, found_errors, warnings) = explained(logs().map(stale));
    assert_eq!(found, names);
    for (error, expected) in found_errors.into_iter().zip(errors) {
        assert!((error - expected).abs() < 0.02 * expected, "{error} instead of {expected}");
    }
    assert!(warnings.iter().any(|warning| warning.contains("between its readings")), "{warnings:?}");
}

/// One row in a hundred had no torques but zeros: an error of 2.7 % was left where 0.3 % is possible, and
/// nothing was said.
#[test]
fn rows_of_zeros_leave_the_model_as_it_is() {
    let logs = || [synthetic::recording(1, 30.0), synthetic::recording(2, 20.0)];
    let zeros = |mut log: Recording| {
        let joints = log.joints.len();
        log.tau.chunks_mut(joints).skip(40).step_by(97).for_each(|row| row.fill(0.0));
        log
    };
    let (names, errors, _) = explained(logs());
    let (found, found_errors, warnings) = explained(logs().map(zeros));
    assert_eq!(found, names);
    for (error, expected) in found_errors.into_iter().zip(errors) {
        assert!((error - expected).abs() < 0.02 * expected, "{error} instead of {expected}");
    }
    assert!(warnings.iter().any(|warning| warning.contains("exactly 0 in")), "{warnings:?}");
}
