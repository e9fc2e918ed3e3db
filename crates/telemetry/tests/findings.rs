//! Each class of what sensors, drives and loggers do to a log is found, and nothing is found where there is
//! nothing.

use phiw_telemetry::findings::{CheckSettings, FindingKind, findings};
use phiw_telemetry::segments::GapReason;
use phiw_telemetry::{Conditioning, ConditioningOptions, TorqueColumns, stream, survey};
use std::fmt::Write;
use std::ops::ControlFlow;

const RATE: f64 = 200.0;

/// A row of a joint that swings: `[t, q, qd, tau]`, with noise of a hundredth on the torque.
fn clean(k: usize) -> [f64; 4] {
    let t = k as f64 / RATE;
    let swing = |t: f64| {
        [(2.0 * t).sin() + 0.4 * (7.0 * t + 0.5).sin(), 2.0 * (2.0 * t).cos() + 2.8 * (7.0 * t + 0.5).cos()]
    };
    let [q, qd] = swing(t);
    let noise = ((k as f64 * 12.9898).sin() * 43_758.545_3).fract();
    [t, q, qd, 3.0 * q.sin() + 0.5 * qd + 0.05 * noise]
}

/// What is found in 20 s of a log whose rows are `change`d.
fn found(change: impl Fn(usize, [f64; 4]) -> [f64; 4]) -> Vec<FindingKind> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    let mut text = String::from("t,q.a,qd.a,tau.a,q.b,tau.b\n");
    for k in 0..(20.0 * RATE) as usize {
        let [t, q, qd, tau] = change(k, clean(k));
        let [_, other, _, torque] = clean(k + 77);
        let _ = writeln!(text, "{t:.6},{q:.9},{qd:.7},{tau:.6},{other:.9},{torque:.6}");
    }
    std::fs::write(&path, text).expect("written");
    let survey = survey(&path, &["a".to_owned(), "b".to_owned()], TorqueColumns::Required, &mut |_, _| {})
        .expect("a log that reads");
    findings(&survey, &CheckSettings::default()).into_iter().map(|finding| finding.kind).collect()
}

fn check(change: impl Fn(usize, [f64; 4]) -> [f64; 4], expected: &[FindingKind]) {
    assert_eq!(found(change), expected);
}

#[test]
fn nothing_is_found_in_a_clean_log() {
    check(|_, row| row, &[]);
    // Rests are no findings: velocity and torque are 0 where nothing moves.
    check(|k, row| if k < 800 { [row[0], clean(800)[1], 0.0, 0.0] } else { row }, &[]);
    // Gravity may keep a torque's sign.
    check(|_, [t, q, qd, tau]| [t, q, qd, tau + 12.0], &[]);
    // Fine steps of torque and encoder.
    check(|_, [t, q, qd, tau]| [t, (q * 1e4).round() / 1e4, qd, (tau * 50.0).round() / 50.0], &[]);
}

#[test]
fn every_class_is_found() {
    use FindingKind::*;
    // 0.15 s late.
    check(|k, [t, q, _, tau]| [t, q, if k < 30 { 0.0 } else { clean(k - 30)[2] }, tau], &[LateVelocity]);
    check(|_, [t, q, qd, tau]| [t, q, 1.1 * qd, tau], &[VelocityScale]);
    check(|_, [t, q, qd, tau]| [t, q, -9.55 * qd, tau], &[VelocityScale]);
    check(|_, [t, q, qd, tau]| [t, q, if qd.abs() < 0.6 { 0.0 } else { qd }, tau], &[VelocityDeadBand]);
    check(|k, [t, q, qd, tau]| [t, q, qd, if (900..1200).contains(&k) { 0.0 } else { tau }], &[ZeroTorque]);
    check(|k, [t, q, qd, tau]| [t, q, qd, if (900..1200).contains(&k) { 1.25 } else { tau }], &[StillTorque]);
    check(|_, [t, q, qd, tau]| [t, q, qd, tau.abs()], &[UnsignedTorque]);
    check(|_, [t, q, qd, tau]| [t, q, qd, (2.0 * tau).round() / 2.0], &[TorqueSteps]);
    check(|_, [t, q, qd, tau]| [t, q, qd, tau.min(2.5)], &[FlatTop]);
    check(|_, [t, q, qd, tau]| [t, q, qd, tau.max(-2.5)], &[FlatTop]);
    check(|_, [t, q, qd, tau]| [t, q, qd, if tau.abs() < 0.3 { 0.0 } else { tau }], &[TorqueDeadBand]);
    check(
        |_, [t, q, _, tau]| [t, (q * 100.0).round() / 100.0, clean((t * RATE).round() as usize)[2], tau],
        &[EncoderSteps],
    );
    check(|_, [t, _, _, tau]| [t, 0.3, 0.0, tau], &[StandsStill]);
    check(|_, [t, q, qd, tau]| [20.0 * t, q, qd / 20.0, tau], &[Sampling]);
    let late_stamp = |k: usize| if k.is_multiple_of(2) { 0.4 / RATE } else { 0.0 };
    check(move |k, [t, q, qd, tau]| [t + late_stamp(k), q, qd, tau], &[Clock]);
}

/// A velocity that lags was trusted where its slope against dq/dt was near 1, and four false delays came of
/// it.
#[test]
fn a_velocity_that_lags_is_not_used() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    for (late, plausible) in [(0, true), (4, false), (30, false)] {
        let mut text = String::from("t,q.a,qd.a,tau.a\n");
        for k in 0..4000 {
            let [t, q, _, tau] = clean(k + late);
            let _ = writeln!(text, "{t:.6},{q:.9},{:.7},{tau:.6}", clean(k)[2]);
        }
        std::fs::write(&path, text).expect("written");
        let survey =
            survey(&path, &["a".to_owned()], TorqueColumns::Required, &mut |_, _| {}).expect("it reads");
        let velocity = survey.joints[0].velocity.expect("a velocity column");
        assert_eq!(velocity.plausible(), plausible, "{late}: {velocity:?}");
        let lag = velocity.alignment.expect("enough to tell by").lag;
        assert!((lag - late as f64 / RATE).abs() < 0.003, "{late}: {lag}");
    }
}

/// A joint that moves little shows too little of how late its velocity is; it was used, and a delay of this
/// joint was named that was none.
#[test]
fn no_velocity_is_used_where_one_of_the_log_is_late() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    let joints = ["a".to_owned(), "b".to_owned()];
    for late in [0, 2] {
        let mut text = String::from("t,q.a,qd.a,tau.a,q.b,qd.b,tau.b\n");
        for k in 0..4000 {
            let [t, q, _, tau] = clean(k + late);
            let qd = clean(k)[2];
            let noise = (k as f64 * 12.9898).sin();
            let _ = writeln!(
                text,
                "{t:.6},{q:.9},{qd:.7},{tau:.6},{:.9},{:.7},{tau:.6}",
                0.1 * q,
                0.1 * qd + 0.2 * noise
            );
        }
        std::fs::write(&path, text).expect("written");
        let survey = survey(&path, &joints, TorqueColumns::Required, &mut |_, _| {}).expect("it reads");
        let own = survey.joints[1].velocity.expect("a velocity column");
        assert!(own.plausible(), "{own:?}");
        let conditioning =
            Conditioning::choose(std::slice::from_ref(&survey), &ConditioningOptions::default());
        let plan = conditioning.expect("a log like any").plan(&survey).expect("a log like any");
        assert_eq!(plan.measured_velocity, [late == 0; 2], "{late}");
    }
}

/// Where the drives of all joints stop logging, the rows say nothing: they are left out of both passes, and
/// counted.
#[test]
fn rows_in_which_no_torque_changes_are_left_out_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    let joints = ["a".to_owned(), "b".to_owned()];
    for (pause, expected) in [(0..0, 0), (900..1200, 300), (900..960, 0), (100..3900, 0)] {
        let mut text = String::from("t,q.a,tau.a,q.b,tau.b\n");
        for k in 0..4000 {
            let ([t, q, _, tau], [_, other, _, torque]) = (clean(k), clean(k + 77));
            let [tau, torque] = if pause.contains(&k) { [0.0, 1.5] } else { [tau, torque] };
            let _ = writeln!(text, "{t:.6},{q:.9},{tau:.6},{other:.9},{torque:.6}");
        }
        std::fs::write(&path, text).expect("written");
        let survey = survey(&path, &joints, TorqueColumns::Required, &mut |_, _| {}).expect("it reads");
        let gap = survey.gaps.iter().find(|gap| gap.reason == GapReason::StillTorques);
        assert_eq!(gap.map_or(0, |gap| gap.count), expected, "{pause:?}");
        assert_eq!(survey.used_rows, 4000 - expected, "{pause:?}");
        assert_eq!(gap.map_or(pause.start as u64 + 2, |gap| gap.first_line), pause.start as u64 + 2);
        let conditioning =
            Conditioning::choose(std::slice::from_ref(&survey), &ConditioningOptions::default())
                .expect("a cut-off");
        let mut left = 0;
        let inside = |t: f64| expected > 0 && (901..1199).contains(&((t * RATE).round() as usize));
        let streamed = stream(&survey, &conditioning, &mut |_, _| {}, &mut |block| {
            left += block.t.iter().filter(|t| inside(**t)).count();
            ControlFlow::Continue(())
        });
        assert!(streamed.is_ok() && left == 0, "{pause:?}: {left} rows, {streamed:?}");
    }
}

/// A log that is one recording over and over has what the recording has, and no more: ten times the rows made
/// the parameters look three times better known, and its noise foretold itself.
#[test]
fn copies_of_a_recording_in_one_log_are_left_out_and_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("log.csv");
    let surveyed = |copies: usize| {
        let mut text = String::from("t,q.a,tau.a\n");
        for k in 0..2000 * copies {
            let [_, q, _, tau] = clean(k % 2000);
            let _ = writeln!(text, "{:.6},{q:.9},{tau:.6}", k as f64 / RATE);
        }
        std::fs::write(&path, text).expect("written");
        survey(&path, &["a".to_owned()], TorqueColumns::Required, &mut |_, _| {}).expect("it reads")
    };
    let (once, copied) = (surveyed(1), surveyed(5));
    assert!(once.gaps.is_empty() && once.repeated.is_empty(), "{:?}", once.gaps);
    let gap = copied.gaps.iter().find(|gap| gap.reason == GapReason::Repeated).expect("copies");
    assert_eq!((gap.count, gap.first_line), (8000, 2002));
    assert_eq!((copied.rows, copied.used_rows, copied.repeated.len()), (10_000, once.used_rows, 1));
    assert_eq!(copied.segments, once.segments);
    let conditioning = Conditioning::choose(std::slice::from_ref(&copied), &ConditioningOptions::default());
    let mut last = f64::NEG_INFINITY;
    let summary = stream(&copied, &conditioning.expect("a cut-off"), &mut |_, _| {}, &mut |block| {
        last = block.t.iter().fold(last, |last, t| last.max(*t));
        ControlFlow::Continue(())
    });
    assert!(summary.is_ok() && last < 2000.5 / RATE, "{summary:?}, {last}");
}
