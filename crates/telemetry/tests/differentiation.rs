//! Smoothing and differentiation against closed forms.

use phiw_telemetry::filter::{LowPass, SmoothingKernel};
use phiw_telemetry::{Block, Conditioning, ConditioningOptions, Recording};
use proptest::prelude::*;
use std::f64::consts::TAU;

/// One joint, position `q` of the time, at `rate` for `seconds`.
fn recording(rate: f64, seconds: f64, q: impl Fn(f64) -> f64) -> Recording {
    let t: Vec<f64> = (0..(rate * seconds) as usize).map(|k| k as f64 / rate).collect();
    Recording { joints: vec!["a".into()], q: t.iter().map(|&t| q(t)).collect(), t, ..Default::default() }
}

fn blocks(recording: &Recording, cutoff_hz: f64) -> (Vec<Block>, phiw_telemetry::LogPlan) {
    let survey = recording.survey().unwrap();
    let options =
        ConditioningOptions { cutoff_hz: Some(cutoff_hz), block_samples: usize::MAX, ..Default::default() };
    let conditioning = Conditioning::choose(std::slice::from_ref(&survey), &options).unwrap();
    (recording.blocks(&conditioning).unwrap(), conditioning.plan(&survey).unwrap())
}

/// Root mean square of the errors of q, q̇, q̈ over the samples that `of` names by their number and the
/// block's length, relative to the signals' own.
fn relative_errors(
    block: &Block,
    exact: impl Fn(f64) -> [f64; 3],
    of: impl Fn(usize, usize) -> bool,
) -> [f64; 3] {
    let (mut errors, mut sizes) = ([0.0; 3], [0.0; 3]);
    for k in 0..block.len() {
        let exact = exact(block.t[k]);
        for (order, got) in [block.q[k], block.qd[k], block.qdd[k]].into_iter().enumerate() {
            sizes[order] += exact[order].powi(2) / block.len() as f64;
            if of(k, block.len()) {
                errors[order] += (got - exact[order]).powi(2);
            }
        }
    }
    let count = (0..block.len()).filter(|&k| of(k, block.len())).count() as f64;
    std::array::from_fn(|order| (errors[order] / count / sizes[order]).sqrt())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn cubics_pass_exactly_from_end_to_end(
        c in prop::array::uniform4(-3.0f64..3.0),
        rate in 50.0f64..1000.0,
        share in 0.01f64..0.35,
    ) {
        let cutoff = share * rate;
        // Time in periods of the cut-off, so that all terms matter alike.
        let q = |t: f64| { let u = t * cutoff / 10.0; c[0] + u * (c[1] + u * (c[2] + u * c[3])) };
        let s = cutoff / 10.0;
        let qd = |t: f64| { let u = t * s; s * (c[1] + u * (2.0 * c[2] + u * 3.0 * c[3])) };
        let qdd = |t: f64| s * s * (2.0 * c[2] + 6.0 * c[3] * t * s);
        let (blocks, plan) = blocks(&recording(rate, 12.0 / cutoff + 20.0 / rate, q), cutoff);
        prop_assert_eq!(blocks.len(), 1);
        let block = &blocks[0];
        prop_assert!(block.len() > plan.kernel.half_length());
        for k in 0..block.len() {
            let t = block.t[k];
            prop_assert!((block.q[k] - q(t)).abs() < 1e-8);
            prop_assert!((block.qd[k] - qd(t)).abs() < 1e-8 * cutoff);
            prop_assert!((block.qdd[k] - qdd(t)).abs() < 1e-8 * cutoff * cutoff, "{} {}", block.qdd[k], qdd(t));
        }
    }

    #[test]
    fn gains_are_those_of_ideal_filters(share in 0.01f64..0.35, frequency in 0.001f64..1.0) {
        let (rate, cutoff) = (1000.0, 1000.0 * share);
        let kernel = SmoothingKernel::new(LowPass::new(cutoff, 80.0), 1.0 / rate);
        // Few taps leave a step at the ends of the second derivative's window, found by a scan to cost 1.1e-3
        // at most.
        let tolerance = |order: usize| if order == 2 && share > 0.1 { 1.3e-3 } else { 2e-4 };
        // In the band: 1, iω, −ω²; far outside: nothing, relative to the band's edge. No phase, or exactly a
        // quarter turn.
        let check = |hz: f64, ideal: f64| {
            let omega = TAU * hz;
            for (order, factor) in [1.0, omega, -omega * omega].into_iter().enumerate() {
                let (re, im) = kernel.gain(order, hz);
                let (along, across) = if order == 1 { (im, re) } else { (re, im) };
                let (relative, unit) = (along / factor, kernel.noise_gain()[order]);
                assert!((relative - ideal).abs() < tolerance(order), "order {order} at {hz} Hz: {relative}");
                assert!(across.abs() < 1e-9 * unit);
            }
        };
        check(0.6 * cutoff * frequency, 1.0);
        let stop = 1.4 * cutoff;
        if stop < rate / 2.0 {
            check(stop + (rate / 2.0 - stop) * frequency, 0.0);
        }
        check(cutoff, 0.5);
    }
}

#[test]
fn ends_are_better_than_by_reflection_from_rest_and_in_motion() {
    // In motion: two sines, the faster at 0.3 of the cut-off. At rest: a quintic from rest to rest, the way
    // robots start.
    let (w1, w2) = (TAU * 1.3, TAU * 3.0);
    let in_motion = |t: f64| {
        let (s1, c1, s2, c2) = ((w1 * t).sin(), (w1 * t).cos(), (w2 * t).sin(), (w2 * t).cos());
        [s1 + 0.2 * c2, w1 * c1 - 0.2 * w2 * s2, -w1 * w1 * s1 - 0.2 * w2 * w2 * c2]
    };
    let from_rest = |t: f64| {
        let u = t / 4.0;
        let (u2, u3) = (u * u, u * u * u);
        let qd = 30.0 * u2 - 60.0 * u3 + 30.0 * u2 * u2;
        let qdd = 60.0 * u - 180.0 * u2 + 120.0 * u3;
        [u3 * (10.0 - 15.0 * u + 6.0 * u2), qd / 4.0, qdd / 16.0]
    };
    let check = |name: &str, exact: &dyn Fn(f64) -> [f64; 3], limits: [f64; 3]| {
        let (blocks, plan) = blocks(&recording(500.0, 4.0, |t| exact(t)[0]), 10.0);
        let half = plan.kernel.half_length();
        let ends = relative_errors(&blocks[0], exact, |k, n| k < half || k + half >= n);
        let middle = relative_errors(&blocks[0], exact, |k, n| k >= half && k + half < n);
        println!("{name}: ends {ends:?}, middle {middle:?}, {} samples left out", plan.edge);
        for order in 0..3 {
            assert!(
                ends[order] < limits[order] && middle[order] < limits[order],
                "{name} {order}: {ends:?} {middle:?}"
            );
        }
        // For comparison, what prolonging by point reflection about the end would do to the acceleration,
        // over the same samples.
        let reflected = |k: isize| {
            let (n, x) = (2000isize, |k: isize| exact(k as f64 / 500.0)[0]);
            match k {
                k if k < 0 => 2.0 * x(0) - x(-k),
                k if k >= n => 2.0 * x(n - 1) - x(2 * (n - 1) - k),
                k => x(k),
            }
        };
        let error = |k: usize| -> f64 {
            let taps = plan.kernel.taps(2).iter().enumerate();
            let value: f64 = taps.map(|(j, tap)| tap * reflected((k + j) as isize - half as isize)).sum();
            (value - exact(k as f64 / 500.0)[2]).powi(2)
        };
        let rms = |errors: Vec<f64>| (errors.iter().sum::<f64>() / errors.len() as f64).sqrt();
        let reflection = rms((plan.edge..half).map(error).collect());
        let size = rms((0..2000).map(|k| exact(k as f64 / 500.0)[2].powi(2)).collect());
        println!("  by reflection {:.1e}", reflection / size);
        assert!(ends[2] < reflection / size, "{name}");
    };
    check("in motion", &in_motion, [1e-3, 5e-3, 2e-2]);
    check("from rest", &from_rest, [1e-5, 1e-4, 1e-3]);
}

#[test]
fn noise_grows_at_most_twofold_at_the_ends() {
    for cutoff in [2.0, 10.0, 40.0, 150.0] {
        let (blocks, plan) = blocks(&recording(500.0, 5.0, f64::sin), cutoff);
        let (edge, inside) = (plan.kernel.noise_gain_at_end(plan.edge)[2], plan.kernel.noise_gain()[2]);
        assert!(edge <= 2.0 * inside, "{cutoff} Hz: {edge} {inside}");
        assert!(plan.edge as f64 * cutoff / 500.0 < 0.7, "{} samples left out at {cutoff} Hz", plan.edge);
        assert_eq!(blocks[0].len(), 2500 - 2 * plan.edge);
    }
}

#[test]
fn measured_derivatives_are_used_where_they_are_plausible() {
    let w = TAU * 1.5;
    let mut recording = recording(200.0, 6.0, |t| (w * t).sin());
    let velocity: Vec<f64> = recording.t.iter().map(|t| 1.01 * w * (w * t).cos()).collect();
    // The factor 1.01 shows where a value comes from.
    let check = |recording: &Recording, use_measured_derivatives: bool, qd: f64, qdd: f64| {
        let options = ConditioningOptions {
            cutoff_hz: Some(20.0),
            use_measured_derivatives,
            ..ConditioningOptions::default()
        };
        let survey = recording.survey().unwrap();
        let conditioning = Conditioning::choose(&[survey], &options).unwrap();
        for block in recording.blocks(&conditioning).unwrap() {
            for k in 20..block.len() - 20 {
                let t = block.t[k];
                assert!((block.qd[k] - qd * w * (w * t).cos()).abs() < 1e-3 * w);
                assert!((block.qdd[k] + qdd * w * w * (w * t).sin()).abs() < 1e-3 * w * w);
            }
        }
    };
    check(&recording, true, 1.0, 1.0);
    recording.qd = Some(velocity.clone());
    check(&recording, true, 1.01, 1.01);
    check(&recording, false, 1.0, 1.0);
    recording.qdd = Some(recording.t.iter().map(|t| -1.02 * w * w * (w * t).sin()).collect());
    check(&recording, true, 1.01, 1.02);
    // In degrees, all zero, of the wrong sign: not the derivative.
    recording.qdd = None;
    for factor in [57.3, 0.0, -1.0] {
        recording.qd = Some(velocity.iter().map(|x| factor * x).collect());
        check(&recording, true, 1.0, 1.0);
    }
}
