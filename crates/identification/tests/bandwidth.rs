//! Cut-offs compared in one band.

use crate::synthetic;

use phiw_identification::bandwidth::{Bandwidth, BandwidthSettings, bandwidth};
use phiw_identification::{LogSet, Variants};
use phiw_telemetry::{ConditioningOptions, Recording};
use std::f64::consts::TAU;
use synthetic::{Viscous, recording, robot};

/// What a log of two joints says of the rigid body with viscous friction, columns and torque low-passed at
/// 5 Hz. `spoil` changes the log.
fn compared(settings: &BandwidthSettings, spoil: impl Fn(&mut Recording)) -> Option<Bandwidth> {
    let tree = robot(4, 2);
    let mut log = Recording { qd: None, qdd: None, ..recording(&tree, 1, 60.0, 2.0, 0.5, 2) };
    spoil(&mut log);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("train.csv");
    log.write_csv(&path).unwrap();
    let options = ConditioningOptions { parallel_cutoff_hz: Some(5.0), ..ConditioningOptions::default() };
    let logs = LogSet::open(&tree, &[path], &[], &options, &|_, _, _| ()).unwrap();
    let effects: Vec<Variants> = (0..2).map(|joint| vec![Viscous::on(&tree, joint)]).collect();
    bandwidth(&tree, effects, &logs, settings, &|_, _, _| ()).unwrap()
}

#[test]
fn a_right_models_answer_does_not_depend_on_the_cut_off() {
    let found = compared(&BandwidthSettings { ratio: 3.0, ..Default::default() }, |_| ()).unwrap();
    let cutoffs: Vec<f64> = found.rungs.iter().map(|rung| rung.cutoff_hz).collect();
    assert!(cutoffs.is_sorted() && cutoffs.len() > 3 && cutoffs.contains(&5.0), "{cutoffs:?}");
    assert_eq!((found.reference_hz, found.better_hz), (5.0, None));
    assert!(found.moved.is_empty(), "{:?}", found.moved);
    // Where motion is low-passed away there is less to learn from.
    let saving: Vec<f64> = found.rungs.iter().map(|rung| rung.comparison.saving).collect();
    assert!(saving[0] < -0.01 && saving.iter().all(|&saving| saving < 0.01), "{saving:?}");
}

/// In the band of the vibration the accelerations are not the robot's: its inertia comes out too small.
#[test]
fn an_encoder_that_vibrates_makes_the_answer_depend_on_the_cut_off() {
    let vibrating = |log: &mut Recording| {
        log.q.iter_mut().enumerate().for_each(|(place, q)| {
            *q += 0.01 * (TAU * 4.3 * 0.01 * (place / 2) as f64).sin();
        });
    };
    let found = compared(&BandwidthSettings::default(), vibrating).unwrap();
    assert_eq!(found.moved[0].cutoff_hz, 2.5, "{:?}", found.moved);
    assert!(found.moved.is_sorted_by(|a, b| a.deviations >= b.deviations));
}

#[test]
fn long_logs_are_compared_on_the_beginning_of_each_fold() {
    // In the first three tenths of each fold nothing is wrong.
    let spoiled = |log: &mut Recording| {
        let fold = 0.7 * 60.0 / 10.0;
        for (row, t) in log.t.iter().enumerate() {
            if (0.5 * fold..0.75 * fold).contains(&(t % fold)) {
                (0..2).for_each(|joint| log.tau[2 * row + joint] += 1e3 * (TAU * 2.0 * t).sin());
            }
        }
    };
    let all = compared(&BandwidthSettings::default(), spoiled).unwrap();
    let seconds = BandwidthSettings { seconds: 0.3 * 42.0, ..BandwidthSettings::default() };
    let samples = BandwidthSettings { samples: 1260, ..BandwidthSettings::default() };
    let [seconds, samples] = [seconds, samples].map(|settings| compared(&settings, spoiled).unwrap());
    let error = |found: &Bandwidth| {
        found.rungs.iter().find(|rung| rung.cutoff_hz == 5.0).map(|rung| rung.relative).unwrap()
    };
    assert!(error(&all) > 0.3 && error(&seconds) < 0.2, "{} {}", error(&all), error(&seconds));
    assert!((error(&samples) / error(&seconds) - 1.0).abs() < 1e-6);
}

#[test]
fn logs_too_short_for_a_fit_give_no_comparison() {
    let short = |log: &mut Recording| {
        log.t.truncate(36);
        log.q.truncate(72);
        log.tau.truncate(72);
    };
    assert_eq!(compared(&BandwidthSettings::default(), short), None);
}
