//! Stamps that jitter: were the samples taken then, or only stamped then?

use phiw_telemetry::clock::{Clock, ClockChoice};
use phiw_telemetry::{Conditioning, ConditioningOptions, Recording, Survey};
use std::f64::consts::TAU;

const PERIOD: f64 = 0.004;

fn motion(t: f64) -> [f64; 3] {
    let w = TAU * 1.2;
    [(w * t).sin(), w * (w * t).cos(), -w * w * (w * t).sin()]
}

/// A fixed sequence in −1…1.
fn noise(i: usize) -> f64 {
    let x = (i as f64 * 12.9898).sin() * 43758.5453;
    2.0 * (x - x.floor()) - 1.0
}

/// 8 s of motion; stamps off the grid by up to `jitter` periods, the samples taken at the stamps or on the
/// grid, with some noise.
fn recording(jitter: f64, taken: Clock, noise_size: f64) -> Recording {
    let grid = |k: usize| PERIOD * k as f64;
    let t: Vec<f64> = (0..2000).map(|k| grid(k) + jitter * PERIOD * noise(k)).collect();
    let at = |k: usize| if taken == Clock::Uniform { grid(k) } else { t[k] };
    let q = (0..2000).map(|k| motion(at(k))[0] + noise_size * noise(k + 5000)).collect();
    Recording { joints: vec!["a".into()], t: t.clone(), q, ..Default::default() }
}

/// Largest error of the acceleration inside, relative to the largest acceleration.
fn acceleration_error(recording: &Recording, survey: &Survey, clock: ClockChoice) -> f64 {
    let options = ConditioningOptions { cutoff_hz: Some(10.0), clock, ..Default::default() };
    let conditioning = Conditioning::choose(std::slice::from_ref(survey), &options).unwrap();
    let largest = motion(0.0)[1].powi(2);
    let errors = recording.blocks(&conditioning).unwrap().into_iter().flat_map(|block| {
        (0..block.len()).map(|k| (block.qdd[k] - motion(block.t[k])[2]).abs()).skip(30).collect::<Vec<_>>()
    });
    errors.fold(0.0, f64::max) / largest
}

#[test]
fn the_smoother_clock_is_taken() {
    for jitter in [0.02, 0.1, 0.3] {
        for taken in [Clock::Uniform, Clock::Stamped] {
            let recording = recording(jitter, taken, 1e-6);
            let survey = recording.survey().unwrap();
            assert_eq!(survey.clock, taken, "jitter {jitter}");
            assert_eq!(survey.segments.len(), 1);
            assert!((survey.period / PERIOD - 1.0).abs() < 1e-3);
            let auto = acceleration_error(&recording, &survey, ClockChoice::Auto);
            let other = if taken == Clock::Uniform { Clock::Stamped } else { Clock::Uniform };
            let wrong = acceleration_error(&recording, &survey, ClockChoice::Fixed(other));
            println!("jitter {jitter}, taken {taken}: error {auto:.1e}, by the other clock {wrong:.1e}");
            assert!(
                auto < wrong && (taken == Clock::Uniform || auto < 2e-2),
                "{jitter} {taken}: {auto} {wrong}"
            );
        }
    }
}

#[test]
fn stamps_are_believed_where_noise_hides_the_difference() {
    let survey = recording(0.02, Clock::Uniform, 1e-2).survey().unwrap();
    assert_eq!(survey.clock, Clock::Stamped);
}

#[test]
fn even_stamps_leave_samples_alone() {
    let recording = recording(0.0, Clock::Uniform, 0.0);
    let survey = recording.survey().unwrap();
    assert!(survey.jitter < 1e-9);
    let conditioning =
        Conditioning::choose(std::slice::from_ref(&survey), &ConditioningOptions::default()).unwrap();
    assert!(!conditioning.plan(&survey).unwrap().resample);
}

#[test]
fn a_rate_that_changes_is_followed() {
    // Four seconds at 250 Hz, four at 130: under stamps that is one smooth motion.
    let t: Vec<f64> =
        (0..1520usize).map(|k| 0.004 * k.min(1000) as f64 + 0.0077 * k.saturating_sub(1000) as f64).collect();
    let q = t.iter().map(|&t| motion(t)[0]).collect();
    let recording = Recording { joints: vec!["a".into()], t, q, ..Default::default() };
    let survey = recording.survey().unwrap();
    assert_eq!((survey.clock, survey.segments.len()), (Clock::Stamped, 1));
    assert!(acceleration_error(&recording, &survey, ClockChoice::Auto) < 1e-2);
}

#[test]
fn a_head_unlike_the_rest_does_not_split_it() {
    // 70 000 stamps at 1 kHz, then twice as many at 200 Hz.
    let stamp = |k: usize| 0.001 * k.min(70_000) as f64 + 0.005 * k.saturating_sub(70_000) as f64;
    let t: Vec<f64> = (0..210_000).map(stamp).collect();
    let q = t.iter().map(|&t| motion(t)[0]).collect();
    let survey = Recording { joints: vec!["a".into()], t, q, ..Default::default() }.survey().unwrap();
    assert!((survey.median_period / 0.005 - 1.0).abs() < 0.05, "{}", survey.median_period);
    assert_eq!(survey.segments.len(), 1);
}

#[test]
fn sessions_share_an_origin_or_are_put_in_a_row() {
    let at = |start: f64| {
        let mut recording = recording(0.0, Clock::Uniform, 0.0);
        recording.t.iter_mut().for_each(|t| *t += start);
        recording.survey().unwrap()
    };
    let check = |starts: [f64; 3], offsets: [f64; 3]| {
        let mut surveys = starts.map(at);
        phiw_telemetry::arrange_session(&mut surveys);
        for (log, survey) in surveys.iter().enumerate() {
            assert_eq!(survey.session.log, log);
            assert!((survey.session.offset - offsets[log]).abs() < 1e-9, "{:?}", survey.session);
        }
    };
    check([0.0, 10.0, 50.0], [0.0; 3]);
    check([50.0, 0.0, 10.0], [0.0; 3]);
    // 2000 samples, 8 s each.
    check([0.0, 0.0, 0.0], [0.0, 8.0, 16.0]);
    check([0.0, 4.0, 30.0], [0.0, 4.0, -14.0]);
}
