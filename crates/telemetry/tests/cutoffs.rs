//! Cut-offs chosen from the data.

use phiw_telemetry::cutoff::Bound;
use phiw_telemetry::{Block, Conditioning, ConditioningOptions, Recording, TorqueColumns, stream, survey};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use std::ops::ControlFlow;
use std::path::Path;

/// Ten sines up to 3 Hz, acceleration of about 1 rms each: (frequency, amplitude, phase).
fn sines(rng: &mut ChaCha8Rng) -> Vec<[f64; 3]> {
    let sine = |i: usize, rng: &mut ChaCha8Rng| {
        let omega = TAU * 0.3 * (i + 1) as f64;
        [omega, 1.0 / (omega * omega), rng.random_range(0.0..TAU)]
    };
    (0..10).map(|i| sine(i, rng)).collect()
}

fn acceleration(sines: &[[f64; 3]], t: f64) -> f64 {
    sines.iter().map(|[omega, amplitude, phase]| -amplitude * omega * omega * (omega * t + phase).sin()).sum()
}

/// Root mean square error of the acceleration in the blocks.
fn error(blocks: &[Block], sines: &[[f64; 3]]) -> f64 {
    let errors = blocks
        .iter()
        .flat_map(|block| (0..block.len()).map(|k| block.qdd[k] - acceleration(sines, block.t[k])));
    let count = blocks.iter().map(Block::len).sum::<usize>() as f64;
    (errors.map(|error| error * error).sum::<f64>() / count).sqrt()
}

fn noisy(sines: &[[f64; 3]], rate: f64, noise: f64, rng: &mut ChaCha8Rng) -> Recording {
    let t: Vec<f64> = (0..(20.0 * rate) as usize).map(|k| k as f64 / rate).collect();
    let position = |t: f64| {
        sines.iter().map(|[omega, amplitude, phase]| amplitude * (omega * t + phase).sin()).sum::<f64>()
    };
    let mut measured = |t: f64| {
        let sample: f64 = StandardNormal.sample(rng);
        position(t) + noise * sample
    };
    Recording {
        joints: vec!["a".into()],
        q: t.iter().map(|&t| measured(t)).collect(),
        t,
        ..Default::default()
    }
}

#[test]
fn the_error_is_near_the_best_that_any_cutoff_gives() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    for rate in [100.0, 250.0, 1000.0] {
        for noise in [0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3] {
            let sines = sines(&mut rng);
            let recording = noisy(&sines, rate, noise, &mut rng);
            let survey = recording.survey().unwrap();
            let with = |cutoff_hz: Option<f64>| {
                let options = ConditioningOptions { cutoff_hz, ..Default::default() };
                let conditioning = Conditioning::choose(std::slice::from_ref(&survey), &options).unwrap();
                (conditioning.cutoff_hz, error(&recording.blocks(&conditioning).unwrap(), &sines))
            };
            let (chosen, got) = with(None);
            let grid = (0..30).map(|i| 2.0 * (0.18 * rate / 2.0f64).powf(i as f64 / 29.0));
            let (best, least) =
                grid.map(|cutoff| with(Some(cutoff))).min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            println!(
                "{rate} Hz, noise {noise:.0e}: {chosen:.1} Hz gives {got:.1e}, best {best:.1} Hz {least:.1e}"
            );
            assert!((2.5..41.0).contains(&chosen), "{chosen}");
            // A thousandth of the acceleration, which is about 2 rms, is as good as none: on quiet data the
            // cut-off stays above the best, since motions with corners need more than these sines.
            assert!(
                got < 2.0 * least + 2e-3,
                "{rate} Hz, noise {noise}: {got} by {chosen} Hz, {least} by {best} Hz"
            );
        }
    }
}

#[test]
fn noise_is_estimated() {
    // One log of 5000 samples scatters by 3 %; the mean of forty shows whether the estimate is true.
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for (rate, noise) in [(1000.0, 1e-7), (1000.0, 1e-4), (250.0, 1e-5), (250.0, 1e-3)] {
        let mut estimate = || {
            let sines = sines(&mut rng);
            let mut recording = noisy(&sines, rate, noise, &mut rng);
            recording.tau = recording.q.iter().map(|q| 50.0 * q).collect();
            let joint = recording.survey().unwrap().joints.remove(0);
            [joint.position_noise_std / noise, joint.torque.unwrap().noise_std / (50.0 * noise)]
        };
        let estimates: Vec<_> = (0..40).map(|_| estimate()).collect();
        for signal in 0..2 {
            let mean = estimates.iter().map(|estimate| estimate[signal]).sum::<f64>() / 40.0;
            assert!((0.98..1.02).contains(&mean), "{rate} Hz, noise {noise}: {mean}");
        }
    }
}

#[test]
fn what_the_user_says_counts() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let sines = sines(&mut rng);
    let survey = noisy(&sines, 500.0, 1e-5, &mut rng).survey().unwrap();
    let options = ConditioningOptions {
        cutoff_hz: Some(12.0),
        parallel_cutoff_hz: Some(5.0),
        decimation: Some(3),
        ..Default::default()
    };
    let conditioning = Conditioning::choose(std::slice::from_ref(&survey), &options).unwrap();
    assert_eq!((conditioning.cutoff_hz, conditioning.parallel_cutoff_hz), (12.0, 5.0));
    assert!(!conditioning.cutoff_from_data);
    let plan = conditioning.plan(&survey).unwrap();
    assert_eq!(plan.decimation(), 3);
    assert!((plan.output_rate_hz() - 500.0 / 3.0).abs() < 1e-6);
    let text = format!("{conditioning}; {plan}");
    assert!(text.contains("12.00 Hz (as told)") && text.contains("one output in 3 samples"), "{text}");
}

#[test]
fn joints_at_rest_suggest_nothing() {
    let t: Vec<f64> = (0..2000).map(|k| 0.002 * k as f64).collect();
    let q = t.iter().flat_map(|t| [(2.0 * t).sin(), 0.5]).collect();
    let recording = Recording { joints: vec!["moves".into(), "rests".into()], t, q, ..Default::default() };
    let survey = recording.survey().unwrap();
    assert_eq!((survey.joints[1].travel(), survey.joints[1].position_noise_std), (0.0, 0.0));
    let conditioning = Conditioning::choose(&[survey], &ConditioningOptions::default()).unwrap();
    let names: Vec<_> = conditioning.suggestions.iter().map(|suggestion| suggestion.joint.as_str()).collect();
    assert_eq!(names, ["moves"]);
}

/// Real logs: cut-offs of some tens of hertz, and every sample reaches an output.
#[test]
fn real_logs() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/logs");
    if !folder.is_dir() {
        println!("skipped: no logs in ../shared/data/logs");
        return;
    }
    let check = |names: &[&str], joints: &[&str], range: std::ops::Range<f64>| {
        let joints: Vec<String> = joints.iter().map(|joint| (*joint).into()).collect();
        let survey = |name: &&str| {
            survey(folder.join(name), &joints, TorqueColumns::Required, &mut |_, _| {}).unwrap()
        };
        let surveys: Vec<_> = names.iter().map(survey).collect();
        let conditioning = Conditioning::choose(&surveys, &ConditioningOptions::default()).unwrap();
        println!("{names:?}: {conditioning}");
        for suggestion in &conditioning.suggestions {
            println!(
                "  {} {}: {:.1} Hz ({})",
                names[suggestion.log], suggestion.joint, suggestion.cutoff_hz, suggestion.bound
            );
        }
        assert!(range.contains(&conditioning.cutoff_hz), "{}", conditioning.cutoff_hz);
        for survey in &surveys {
            assert!(
                survey.segments.len() == 1 && survey.gaps.is_empty() && survey.ignored_columns.is_empty()
            );
            let plan = conditioning.plan(survey).unwrap();
            println!("  {plan}");
            let used = survey.rows as usize - 2 * plan.edge;
            let count = |block: Block| {
                assert!(block.qdd.iter().all(|x| x.is_finite()));
                ControlFlow::Continue(())
            };
            let summary = stream(survey, &conditioning, &mut |_, _| {}, &mut { count }).unwrap();
            assert_eq!(summary.outputs, (used - 1) / plan.decimation() + 1);
        }
        conditioning.suggestions
    };
    let six: Vec<String> = (1..=6).map(|i| format!("joint_{i}")).collect();
    let six: Vec<&str> = six.iter().map(String::as_str).collect();
    check(&["tx40/train.csv", "tx40/validate.csv"], &six, 20.0..120.0);
    check(&["kr300/traj_A.csv", "kr300/traj_B.csv"], &["A1", "A2", "A3", "A4", "A5", "A6"], 10.0..60.0);
    let slide = check(&["emps/train.csv"], &["slide"], 20.0..210.0);
    assert_ne!(slide[0].bound, Bound::SampleRate);
}

/// The slowest log of a session bounded the cut-off of all.
#[test]
fn a_log_without_a_say_is_read_with_the_cut_offs_that_its_sampling_carries() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let sines = sines(&mut rng);
    let [fast, slow] = [500.0, 40.0].map(|rate| noisy(&sines, rate, 1e-6, &mut rng).survey().unwrap());
    let options = ConditioningOptions::default();
    let chosen = Conditioning::choose(std::slice::from_ref(&fast), &options).unwrap();
    assert_eq!(chosen.cutoffs_for(&fast), [chosen.cutoff_hz, chosen.parallel_cutoff_hz]);
    assert!(chosen.cutoff_hz > 8.0, "{chosen}");
    assert_eq!(chosen.cutoffs_for(&slow), [8.0, 8.0]);
    assert!((chosen.plan(&slow).unwrap().kernel.low_pass().cutoff_hz - 8.0).abs() < 1e-9);
    // What the user says counts, or is refused.
    let options = ConditioningOptions { cutoff_hz: Some(20.0), ..options };
    let told = Conditioning::choose(&[fast], &options).unwrap();
    assert!(told.plan(&slow).unwrap_err().to_string().contains("up to 14.0 Hz"));
}
