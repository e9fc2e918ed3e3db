//! Rows that a logger wrote down several times, and rows of zeros that a driver logged for a message it had
//! not got: they are left out, counted and said, and what is left is read as the log that should have been.

use phiw_telemetry::findings::{CheckSettings, FindingKind, findings};
use phiw_telemetry::segments::GapReason;
use phiw_telemetry::{
    Block, Conditioning, ConditioningOptions, ControllerSignal, Recording, Survey, TorqueColumns, ZeroRows,
    stream, survey,
};
use std::ops::ControlFlow;
use std::path::Path;

const RATE: f64 = 250.0;

/// A minute of two joints that swing, with noise on the torques.
fn log() -> Recording {
    let swing = |t: f64| 0.8 * (2.0 * t).sin() + 0.3 * (5.3 * t + 0.5).sin();
    let mut log = Recording { joints: vec!["a".into(), "b".into()], ..Recording::default() };
    for row in 0..15_000 {
        let t = f64::from(row) / RATE;
        let noise = |stream: f64| ((f64::from(row) * 12.9898 + stream).sin() * 43_758.545_3).fract();
        log.t.push(t);
        log.q.extend([swing(t), swing(0.9 * t + 3.0)]);
        log.tau
            .extend([9.0 * swing(t).sin() + 0.1 * noise(0.0), 4.0 * swing(0.9 * t + 3.0) + 0.1 * noise(1.0)]);
    }
    log
}

/// The rows of a log for which `keep` says so.
fn rows(log: &Recording, keep: impl Fn(usize) -> bool) -> Recording {
    let kept = || (0..log.t.len()).filter(|row| keep(*row));
    let of = |values: &[f64]| kept().flat_map(|row| values[2 * row..2 * row + 2].to_vec()).collect();
    Recording {
        joints: log.joints.clone(),
        t: kept().map(|row| log.t[row]).collect(),
        q: of(&log.q),
        tau: of(&log.tau),
        ..Recording::default()
    }
}

/// A signal of two joints in which each row is that of `read`.
fn held(values: &[f64], read: impl Fn(usize) -> usize) -> Vec<f64> {
    (0..values.len() / 2).flat_map(|row| [values[2 * read(row)], values[2 * read(row) + 1]]).collect()
}

fn read(log: &Recording, path: &Path) -> (Survey, Vec<Block>) {
    log.write_csv(path).unwrap();
    let survey = survey(path, &log.joints, TorqueColumns::Required, &mut |_, _| {}).unwrap();
    let conditioning =
        Conditioning::choose(std::slice::from_ref(&survey), &ConditioningOptions::default()).unwrap();
    let mut blocks = Vec::new();
    stream(&survey, &conditioning, &mut |_, _| {}, &mut |block| {
        blocks.push(block);
        ControlFlow::Continue(())
    })
    .unwrap();
    (survey, blocks)
}

fn kinds(survey: &Survey) -> Vec<(FindingKind, String)> {
    let found = findings(survey, &CheckSettings::default());
    found.into_iter().map(|finding| (finding.kind, finding.column)).collect()
}

/// A logger at 250 Hz of a bus at 62.5 Hz wrote each row four times. Nothing was said, false delays were
/// named, and an error of 13 % was left where 0.6 % is possible.
#[test]
fn a_held_log_is_read_as_the_log_that_it_was_made_of() {
    let folder = tempfile::tempdir().unwrap();
    let log = log();
    for hold in [1, 2, 4, 5] {
        let read_at = |row: usize| row / hold * hold;
        let repeated = Recording { q: held(&log.q, read_at), tau: held(&log.tau, read_at), ..log.clone() };
        let (once, expected) =
            read(&rows(&log, |row| row.is_multiple_of(hold)), &folder.path().join("once.csv"));
        let (found, blocks) = read(&repeated, &folder.path().join("held.csv"));
        assert_eq!(found.held_rows(), (hold > 1).then_some(hold));
        let (all, used) = (log.t.len() as u64, (log.t.len() / hold) as u64);
        assert_eq!((found.rows, found.used_rows), (all, used));
        let repeats = found.gaps.iter().find(|gap| gap.reason == GapReason::Held);
        assert_eq!(repeats.map_or(0, |gap| gap.count), all - used);
        assert_eq!((found.segments.len(), found.period), (1, once.period));
        assert_eq!(found.joints, once.joints);
        assert_eq!(blocks.len(), expected.len());
        for (block, expected) in blocks.iter().zip(&expected) {
            assert!(block.q == expected.q && block.qdd == expected.qdd && block.tau == expected.tau);
        }
        let expected = (hold > 1).then(|| (FindingKind::HeldRows, "t".to_owned()));
        assert_eq!(kinds(&found), Vec::from_iter(expected));
    }
}

/// Torques that are read every fourth row are late by a row and a half; nothing was said of it.
#[test]
fn torques_that_are_held_by_themselves_are_said_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let log = log();
    let every_fourth = |row: usize| row / 4 * 4;
    let (torques, _) = read(&Recording { tau: held(&log.tau, every_fourth), ..log.clone() }, &path);
    assert_eq!(kinds(&torques), [(FindingKind::HeldSignal, "tau".to_owned())]);
    assert_eq!((torques.held_rows(), torques.used_rows), (None, torques.rows));
}

/// Positions of three wrist joints that were read every fourth row were named elasticities of their drives.
#[test]
fn positions_that_are_held_by_themselves_are_interpolated_between_their_readings() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let log = log();
    let (_, fresh) = read(&log, &path);
    let of_all = held(&log.q, |row| row / 4 * 4);
    let mut one = log.clone();
    one.q.iter_mut().zip(&of_all).skip(1).step_by(2).for_each(|(q, held)| *q = *held);
    for (q, column) in [(one.q, "q.b"), (of_all, "q")] {
        let (survey, blocks) = read(&Recording { q, ..log.clone() }, &path);
        assert_eq!(kinds(&survey), [(FindingKind::HeldPosition, column.to_owned())]);
        assert_eq!((survey.held_rows(), survey.used_rows), (None, survey.rows));
        let pairs = blocks.iter().zip(&fresh).flat_map(|(block, fresh)| {
            let accelerations = block.qdd.iter().copied().zip(fresh.qdd.iter().copied());
            block.q.iter().copied().zip(fresh.q.iter().copied()).chain(accelerations)
        });
        let (wrong, whole) = pairs.fold((0.0, 0.0), |(wrong, whole), (q, fresh)| {
            (wrong + (q - fresh).powi(2), whole + fresh.powi(2))
        });
        assert!(wrong < 0.01_f64.powi(2) * whole, "{}", (wrong / whole).sqrt());
    }
}

/// One row in a hundred in which all torques were 0 left an error of 2.7 % where 0.3 % is possible; nothing
/// was said.
#[test]
fn rows_of_zeros_of_missed_messages_part_no_log_and_leave_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let log = log();
    let (whole, expected) = read(&log, &folder.path().join("whole.csv"));
    let missed = |row: &usize| row % 103 == 50 || row % 1009 == 151;
    let joints_far_from_zero =
        |log: &Recording, row: usize| log.tau[2 * row].abs().max(log.tau[2 * row + 1].abs()) > 2.0;
    let lost: Vec<usize> =
        (0..log.t.len()).filter(missed).filter(|row| joints_far_from_zero(&log, *row)).collect();
    for (positions, torques) in [(false, true), (true, false), (true, true)] {
        let mut zeros = log.clone();
        for row in &lost {
            if positions {
                zeros.q[2 * row..2 * row + 2].fill(0.0);
            }
            if torques {
                zeros.tau[2 * row..2 * row + 2].fill(0.0);
            }
        }
        let (found, blocks) = read(&zeros, &folder.path().join("zeros.csv"));
        let count = lost.len() as u64;
        let ZeroRows { positions: of_positions, torques: of_torques } = found.zero_rows();
        assert_eq!((of_positions, of_torques), if positions { (count, 0) } else { (0, count) });
        assert_eq!((found.used_rows, found.rows, found.segments.len()), (whole.rows - count, whole.rows, 1));
        let column = if positions { "q" } else { "tau" };
        assert_eq!(kinds(&found), [(FindingKind::ZeroRows, column.to_owned())]);
        assert_eq!(blocks.len(), expected.len());
        for (block, expected) in blocks.iter().zip(&expected) {
            let off = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off(&block.q, &expected.q) < 1e-5 && off(&block.tau, &expected.tau) < 0.5);
        }
    }
}

/// What is truly zero stays: a robot that is switched off, a torque that crosses zero, one that chatters
/// about it.
#[test]
fn zeros_that_belong_to_a_signal_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    let log = log();
    let kept = |change: &dyn Fn(usize, &mut f64)| {
        let mut changed = log.clone();
        changed.tau.iter_mut().enumerate().for_each(|(place, tau)| change(place / 2, tau));
        let (survey, _) = read(&changed, &path);
        assert!(
            survey.zero_rows() == ZeroRows::default() && survey.used_rows == survey.rows,
            "{:?}",
            survey.gaps
        );
    };
    kept(&|row, tau| *tau = if (5000..5040).contains(&row) { 0.0 } else { *tau });
    kept(&|_, tau| *tau = (*tau / 0.5).round() * 0.5);
    kept(&|row, tau| *tau = if row % 2 == 0 { 0.0 } else { *tau });
    kept(&|_, tau| *tau = tau.signum() * (tau.abs() - 6.0).max(0.0));
}

/// An angle that a driver keeps within a turn jumps where it leaves it. Nothing was said; external forces and
/// couplings were named on right models, and 2 to 18 % of the torques were left.
#[test]
fn an_angle_that_begins_anew_after_a_turn_runs_on() {
    use std::f64::consts::TAU;
    let folder = tempfile::tempdir().unwrap();
    let log = log();
    let (_, expected) = read(&log, &folder.path().join("whole.csv"));
    let mut wrapped = log.clone();
    // The joint swings about where the angle begins anew, to and fro; the first row is on one side of it.
    let first = log.q[0].rem_euclid(TAU) - log.q[0];
    wrapped.q.iter_mut().step_by(2).for_each(|q| *q = q.rem_euclid(TAU));
    let (found, blocks) = read(&wrapped, &folder.path().join("wrapped.csv"));
    let crossings = log.q.chunks(2).zip(log.q.chunks(2).skip(1));
    let crossings = crossings.filter(|(a, b)| (a[0] < 0.0) != (b[0] < 0.0)).count() as u64;
    assert_eq!(found.turns(), [crossings, 0]);
    assert_eq!(kinds(&found), [(FindingKind::Turns, "q.a".to_owned())]);
    assert_eq!((found.segments.len(), found.used_rows), (1, found.rows));
    for (block, expected) in blocks.iter().zip(&expected) {
        for (q, expected) in block.q.chunks(2).zip(expected.q.chunks(2)) {
            assert!((q[0] - first - expected[0]).abs() < 1e-9 && (q[1] - expected[1]).abs() < 1e-12);
        }
        assert!(block.qdd.iter().zip(&expected.qdd).all(|(a, b)| (a - b).abs() < 1e-4));
    }
}

/// Degrees and millimetres of a quick joint move by more than 2π from row to row.
#[test]
fn quick_motion_in_another_unit_is_no_turn() {
    let folder = tempfile::tempdir().unwrap();
    let log = log();
    for factor in [1000.0, 5000.0] {
        let scaled = Recording { q: log.q.iter().map(|q| factor * q).collect(), ..log.clone() };
        let (found, _) = read(&scaled, &folder.path().join("scaled.csv"));
        assert_eq!(found.turns(), [0, 0], "{factor}");
    }
}

/// A recording is what `phiw next` reads, with the controller's reference beside: both run on.
#[test]
fn a_recording_and_its_reference_run_on_too() {
    use std::f64::consts::TAU;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrapped.csv");
    let log = log();
    let first = log.q[0].rem_euclid(TAU) - log.q[0];
    // The reference is a row ahead, so that it leaves the turn earlier.
    let mut text = String::from("t,q.a,qref.a,tau.a\n");
    for row in 0..log.t.len() - 1 {
        let (q, ahead) = (log.q[2 * row].rem_euclid(TAU), log.q[2 * row + 2].rem_euclid(TAU));
        text.push_str(&format!("{},{q},{ahead},{}\n", log.t[row], log.tau[2 * row]));
    }
    std::fs::write(&path, text).unwrap();
    let joints = ["a".to_owned()];
    let recording = Recording::read(&path, &joints, TorqueColumns::Required).unwrap();
    let reference = ControllerSignal::Reference.read(&path, &joints).unwrap().unwrap();
    for row in 0..log.t.len() - 1 {
        assert!((recording.q[row] - first - log.q[2 * row]).abs() < 1e-9);
        assert!((reference[row] - first - log.q[2 * row + 2]).abs() < 1e-9);
    }
}
