//! A survey that is written down and read back is the same to the last bit, whatever the log is like.

use phiw_telemetry::{Conditioning, ConditioningOptions, Recording, Survey, TorqueColumns, survey};

const ROWS: usize = 3_000;

/// Two joints at 200 Hz.
fn moving() -> Recording {
    let t: Vec<f64> = (0..ROWS).map(|row| row as f64 / 200.0).collect();
    let q = t.iter().flat_map(|t| [(1.3 * t).sin(), 0.4 * (2.1 * t + 0.3).cos()]);
    let tau = t.iter().flat_map(|t| [3.0 * (1.3 * t).sin() + 0.1 * (777.0 * t).sin(), (2.1 * t).cos()]);
    let (q, tau) = (q.collect(), tau.collect());
    Recording { joints: vec!["a".into(), "b".into()], t, q, tau, ..Recording::default() }
}

fn check(recording: &Recording) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    recording.write_csv(&path).unwrap();
    let found = survey(&path, &recording.joints, TorqueColumns::Optional, &mut |_, _| ()).unwrap();
    let written = serde_json::to_string(&found).unwrap();
    let mut read: Survey = serde_json::from_str(&written).unwrap();
    // How the log is read is not written: who reads the survey back says it.
    read.source = found.source.clone();
    // A NaN is not equal to itself, but its text is.
    assert_eq!(format!("{read:?}"), format!("{found:?}"));

    let chosen = Conditioning::choose(&[found], &ConditioningOptions::default()).unwrap();
    let read: Conditioning = serde_json::from_str(&serde_json::to_string(&chosen).unwrap()).unwrap();
    assert_eq!(read, chosen);
}

#[test]
fn a_survey_reads_back_to_the_last_bit() {
    check(&moving());
}

/// JSON writes NaN as null, which no number can be read from.
#[test]
fn a_survey_with_numbers_that_are_none_reads_back() {
    let still = Recording { q: vec![0.5; 2 * ROWS], qd: Some(vec![0.0; 2 * ROWS]), ..moving() };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log.csv");
    still.write_csv(&path).unwrap();
    let found = survey(&path, &still.joints, TorqueColumns::Optional, &mut |_, _| ()).unwrap();
    assert!(found.joints[0].velocity.unwrap().agreement.is_nan(), "this log no longer shows the case");
    check(&still);
}

#[test]
fn a_survey_of_a_log_with_gaps_and_spikes_reads_back() {
    let mut spoiled = moving();
    spoiled.q[2 * 700] += 40.0;
    spoiled.tau[2 * 1_200] = f64::NAN;
    check(&spoiled);
    check(&Recording { tau: Vec::new(), ..moving() });
}
