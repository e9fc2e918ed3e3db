//! Blocks give what the whole record gives, and that is plain convolution.

use phiw_telemetry::filter::FilterScratch;
use phiw_telemetry::{Block, Conditioning, ConditioningOptions, LogPlan, Recording, stream, survey};
use proptest::prelude::*;
use std::ops::ControlFlow;

/// Two joints at 100 Hz: smooth motion, pseudo-random torque, NaN in the rows of `gaps`.
fn recording(rows: usize, gaps: &[usize]) -> Recording {
    let t: Vec<f64> = (0..rows).map(|k| 5.0 + 0.01 * k as f64).collect();
    let q = |k: usize, joint: usize| match gaps.contains(&k) {
        true => f64::NAN,
        false => (joint as f64 + (2.0 + joint as f64) * t[k]).sin() + 1e-3 * noise(2 * k + joint),
    };
    Recording {
        joints: vec!["a".into(), "b".into()],
        q: (0..rows).flat_map(|k| [q(k, 0), q(k, 1)]).collect(),
        tau: (0..2 * rows).map(|i| noise(i + 7)).collect(),
        t,
        ..Default::default()
    }
}

/// A fixed sequence in −1…1.
fn noise(i: usize) -> f64 {
    (i as f64 * 12.9898 + (i * i) as f64 * 0.618).sin()
}

#[derive(Debug, Clone, PartialEq)]
struct Output {
    segment: usize,
    t: f64,
    row: Vec<f64>,
}

/// A row of products and of the signals themselves.
fn evaluate(block: &Block, sample: usize, row: &mut [f64]) {
    let s = block.signals(sample);
    row.copy_from_slice(&[s.q[0], s.q[1], s.qd[0], s.qdd[1], s.qd[0] * s.qdd[1], s.tau[0], s.tau[1]]);
}

fn outputs(blocks: &[Block]) -> Vec<Output> {
    let mut scratch = FilterScratch::default();
    let mut outputs = Vec::new();
    for block in blocks {
        let mut expected = 0;
        block.filter(
            7,
            &mut scratch,
            |k, row| evaluate(block, k, row),
            |output, t, row| {
                assert_eq!(output, expected);
                expected += 1;
                outputs.push(Output { segment: block.segment, t, row: row.to_vec() });
            },
        );
        assert_eq!(expected, block.outputs.len());
    }
    outputs
}

fn conditioning(recording: &Recording, options: ConditioningOptions) -> (Conditioning, LogPlan) {
    let survey = recording.survey().unwrap();
    let conditioning = Conditioning::choose(std::slice::from_ref(&survey), &options).unwrap();
    let plan = conditioning.plan(&survey).unwrap();
    (conditioning, plan)
}

fn assert_same(a: &[Output], b: &[Output]) {
    assert_eq!(a.len(), b.len());
    for (a, b) in a.iter().zip(b) {
        assert_eq!((a.segment, a.t), (b.segment, b.t));
        for (x, y) in a.row.iter().zip(&b.row) {
            assert!((x - y).abs() < 1e-9 * (1.0 + y.abs()), "t {}: {x} {y}", a.t);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_size_of_blocks_does_not_matter(
        rows in 150usize..900,
        gaps in prop::collection::vec(0usize..900, 0..4),
        cutoff in 3.0f64..34.0,
        parallel in 3.0f64..34.0,
        decimation in prop::option::of(1usize..12),
        block_samples in 1usize..400,
        warm_up in 0.0f64..0.5,
    ) {
        let recording = recording(rows, &gaps);
        let options = ConditioningOptions {
            cutoff_hz: Some(cutoff), parallel_cutoff_hz: Some(parallel), decimation, warm_up, block_samples,
            ..Default::default()
        };
        let whole = ConditioningOptions { block_samples: usize::MAX, warm_up: 0.0, ..options.clone() };
        let (small, plan) = conditioning(&recording, options);
        let (whole, _) = conditioning(&recording, whole);
        match recording.blocks(&whole) {
            Ok(blocks) => {
                let small = recording.blocks(&small).unwrap();
                assert_same(&outputs(&small), &outputs(&blocks));
                prop_assert!(small.iter().all(|block| block.outputs.len() <= plan.outputs_per_block));
                // Every segment is one block then, and has an output every so many samples.
                for block in &blocks {
                    prop_assert_eq!(block.outputs.len(), (block.len() - 1) / plan.decimation() + 1);
                    prop_assert!(block.outputs.windows(2).all(|pair| pair[1] - pair[0] == plan.decimation()));
                }
            }
            Err(error) => {
                prop_assert!(error.to_string().contains("long enough"), "{}", error);
                prop_assert!(recording.blocks(&small).is_err());
            }
        }
    }

    /// Long logs were searched in pieces of 5 s, but every block that a piece touched was worked on whole.
    #[test]
    fn parts_of_blocks_give_what_the_whole_gives_there_and_are_no_longer_than_they_need(
        rows in 200usize..900,
        gaps in prop::collection::vec(0usize..900, 0..4),
        block_samples in 1usize..400,
        warm_up in 0usize..20,
        pieces in prop::collection::vec((0.0f64..1.0, 0.0f64..0.3), 1..4),
    ) {
        let recording = recording(rows, &gaps);
        let options = ConditioningOptions {
            cutoff_hz: Some(20.0), parallel_cutoff_hz: Some(8.0), block_samples, ..Default::default()
        };
        let Ok(blocks) = recording.blocks(&conditioning(&recording, options).0) else { return Ok(()) };
        let times: Vec<f64> = blocks.iter().flat_map(|block| block.t.clone()).collect();
        let (first, length) = (times[0], times[times.len() - 1] - times[0]);
        let wanted = |t: f64| {
            pieces.iter().any(|(start, part)| (start..&(start + part)).contains(&&((t - first) / length)))
        };
        let parts: Vec<Block> = blocks.iter().flat_map(|block| block.narrowed(warm_up, wanted)).collect();
        let all = outputs(&blocks).into_iter().filter(|output| wanted(output.t)).collect::<Vec<_>>();
        assert_same(&outputs(&parts), &all);
        for part in &parts {
            let reach = part.parallel_filter().half_length();
            let span = part.outputs[part.outputs.len() - 1] - part.outputs[0];
            prop_assert!(part.len() <= span + 2 * reach + 1 + warm_up);
        }
        let cut: Vec<Block> =
            blocks.iter().flat_map(|block| block.clone().in_parts(pieces.len(), warm_up)).collect();
        prop_assert!(cut.len() >= blocks.len() && cut.len() <= pieces.len() * blocks.len());
        assert_same(&outputs(&cut), &outputs(&blocks));
    }

    #[test]
    fn another_filter_gives_what_conditioning_with_it_gives(
        rows in 200usize..900,
        gaps in prop::collection::vec(0usize..900, 0..4),
        block_samples in 1usize..400,
    ) {
        let recording = recording(rows, &gaps);
        let options = |parallel_cutoff_hz, decimation| ConditioningOptions {
            cutoff_hz: Some(20.0),
            parallel_cutoff_hz: Some(parallel_cutoff_hz),
            decimation: Some(decimation),
            block_samples,
            ..Default::default()
        };
        let (low, high) = (conditioning(&recording, options(3.0, 8)).0, conditioning(&recording, options(12.0, 2)));
        let Ok(blocks) = recording.blocks(&low) else { return Ok(()) };
        let filtered: Vec<Block> = blocks.iter().map(|block| block.with_filter(&high.1.parallel)).collect();
        assert_same(&outputs(&filtered), &outputs(&recording.blocks(&high.0).unwrap()));
    }

    #[test]
    fn outputs_are_plain_convolutions(rows in 200usize..500, cutoff in 8.0f64..30.0, parallel in 8.0f64..30.0) {
        let recording = recording(rows, &[]);
        let options = ConditioningOptions {
            cutoff_hz: Some(cutoff), parallel_cutoff_hz: Some(parallel), block_samples: 64, ..Default::default()
        };
        let (conditioning, plan) = conditioning(&recording, options);
        let half = plan.kernel.half_length();
        let smooth = |order: usize, joint: usize, k: usize| -> f64 {
            let x = |j: usize| recording.q[2 * (k + j - half) + joint];
            plan.kernel.taps(order).iter().enumerate().map(|(j, tap)| tap * x(j)).sum()
        };
        let reach = plan.parallel.half_length();
        let outputs = outputs(&recording.blocks(&conditioning).unwrap());
        for (i, output) in outputs.iter().enumerate() {
            let k = plan.edge + i * plan.decimation();
            prop_assert_eq!(output.t, recording.t[k]);
            // The torque's filter is cut at the ends of what is used, and scaled to sum one.
            let used = plan.edge.max(k.saturating_sub(reach))..(k + reach + 1).min(rows - plan.edge);
            let tap = |m: usize| plan.parallel.taps()[m + reach - k];
            let sum: f64 = used.clone().map(tap).sum();
            let filtered = |x: &dyn Fn(usize) -> f64| used.clone().map(|m| tap(m) * x(m)).sum::<f64>() / sum;
            let tau = filtered(&|m| recording.tau[2 * m]);
            prop_assert!((tau - output.row[5]).abs() < 1e-9);
            if used.start >= half && used.end + half <= rows {
                let expected = [
                    filtered(&|m| smooth(0, 0, m)),
                    filtered(&|m| smooth(0, 1, m)),
                    filtered(&|m| smooth(1, 0, m)),
                    filtered(&|m| smooth(2, 1, m)),
                    filtered(&|m| smooth(1, 0, m) * smooth(2, 1, m)),
                ];
                for (x, y) in expected.iter().zip(&output.row) {
                    prop_assert!((x - y).abs() < 1e-9 * (1.0 + x.abs()), "{} {}", x, y);
                }
            }
        }
    }

    #[test]
    fn the_parallel_filter_is_linear(a in -5.0f64..5.0, b in -5.0f64..5.0) {
        // Filter(A·x) = A·Filter(x), at the ends too: so a model that holds before the filter holds after it.
        let recording = recording(300, &[150]);
        let (conditioning, _) = conditioning(&recording, ConditioningOptions::default());
        let mut scratch = FilterScratch::default();
        for block in recording.blocks(&conditioning).unwrap() {
            block.filter(
                3,
                &mut scratch,
                |k, row| row.copy_from_slice(&[block.qdd[2 * k], block.tau[2 * k], a * block.qdd[2 * k] + b * block.tau[2 * k]]),
                |_, _, row| assert!((a * row[0] + b * row[1] - row[2]).abs() < 1e-9 * (1.0 + row[2].abs())),
            );
        }
    }
}

#[test]
fn a_file_gives_the_blocks_of_its_recording() {
    let mut recording = recording(700, &[300, 301, 500]);
    recording.temp = Some((0..1400).map(|i| if i % 14 == 0 { i as f64 } else { f64::NAN }).collect());
    let file = tempfile::NamedTempFile::new().unwrap();
    recording.write_csv(file.path()).unwrap();
    let survey =
        survey(file.path(), &recording.joints, phiw_telemetry::TorqueColumns::Required, &mut |_, _| {})
            .unwrap();
    let (conditioning, _) = conditioning(
        &recording,
        ConditioningOptions { block_samples: 100, warm_up: 0.2, ..Default::default() },
    );
    let mut streamed = Vec::new();
    let mut sink = |block: Block| {
        streamed.push(block);
        ControlFlow::Continue(())
    };
    let mut last = (0, 0);
    let summary = stream(&survey, &conditioning, &mut |done, total| last = (done, total), &mut sink).unwrap();
    let blocks = recording.blocks(&conditioning).unwrap();
    assert_eq!(last.0, last.1);
    assert_eq!(summary.outputs, streamed.iter().map(|block| block.outputs.len()).sum::<usize>());
    assert_eq!(streamed.len(), blocks.len());
    for (a, b) in streamed.iter().zip(&blocks) {
        assert_eq!((&a.t, &a.q, &a.qdd, &a.tau, a.warm_up), (&b.t, &b.q, &b.qdd, &b.tau, b.warm_up));
    }
    assert_same(&outputs(&streamed), &outputs(&blocks));
    let back =
        Recording::from_csv(file.path(), &recording.joints, phiw_telemetry::TorqueColumns::Required).unwrap();
    assert_eq!(back.len(), recording.len());
    assert_same(&outputs(&back.blocks(&conditioning).unwrap()), &outputs(&blocks));

    // The sink can break off.
    let summary = stream(&survey, &conditioning, &mut |_, _| {}, &mut |_| ControlFlow::Break(())).unwrap();
    assert!(summary.stopped && summary.blocks == 1);
}

#[test]
fn warm_up_comes_before_the_outputs() {
    let recording = recording(2000, &[]);
    let options = ConditioningOptions { block_samples: 300, warm_up: 0.5, ..Default::default() };
    let (conditioning, plan) = conditioning(&recording, options);
    let blocks = recording.blocks(&conditioning).unwrap();
    assert_eq!(blocks[0].warm_up, 0);
    for block in &blocks[2..] {
        assert_eq!(block.warm_up, 50);
        assert_eq!(block.outputs[0] - block.warm_up, plan.parallel.half_length());
    }
}

#[test]
fn signals_are_filtered_together() {
    let recording = recording(600, &[]);
    let (conditioning, _) = conditioning(&recording, ConditioningOptions::default());
    let mut scratch = FilterScratch::default();
    for block in recording.blocks(&conditioning).unwrap() {
        let mut rows = Vec::new();
        block.filter(7, &mut scratch, |k, row| evaluate(&block, k, row), |_, _, row| rows.push(row.to_vec()));
        block.filter_signals(&mut scratch, |output, signals| {
            let row = &rows[output];
            assert_eq!(
                (signals.q, signals.qd[0], signals.qdd[1], signals.tau),
                (&row[..2], row[2], row[3], &row[5..])
            );
            assert_eq!(signals.t, block.t[block.outputs[output]]);
        });
    }
}
