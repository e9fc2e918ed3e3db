//! Throughput of both passes over a log of 18 joints, in bytes of CSV.

#![allow(missing_docs)]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use phiw_telemetry::filter::FilterScratch;
use phiw_telemetry::{Conditioning, ConditioningOptions, Recording, TorqueColumns, stream, survey};
use std::hint::black_box;
use std::ops::ControlFlow;

const JOINTS: usize = 18;
const ROWS: usize = 20_000;

fn recording() -> Recording {
    let t: Vec<f64> = (0..ROWS).map(|k| (k as f64).round() / 1000.0).collect();
    // Seven digits, as loggers write them.
    let digits = |x: f64| (x * 1e7).round() / 1e7;
    let signal = |scale: f64| {
        let value = move |t: f64, joint: usize| digits(scale * ((1.0 + 0.1 * joint as f64) * t).sin());
        t.iter().flat_map(move |&t| (0..JOINTS).map(move |joint| value(t, joint))).collect::<Vec<_>>()
    };
    let (q, tau) = (signal(1.0), signal(30.0));
    Recording { joints: (0..JOINTS).map(|i| format!("j{i}")).collect(), t, q, tau, ..Default::default() }
}

fn passes(criterion: &mut Criterion) {
    let recording = recording();
    let file = std::env::temp_dir().join(format!("phiw-telemetry-bench-{}.csv", std::process::id()));
    if recording.write_csv(&file).is_err() {
        return;
    }
    let first = || survey(&file, &recording.joints, TorqueColumns::Required, &mut |_, _| {});
    let mut group = criterion.benchmark_group("18 joints");
    group
        .throughput(Throughput::Bytes(std::fs::metadata(&file).map_or(0, |data| data.len())))
        .sample_size(10);
    group.bench_function("survey", |b| b.iter(|| black_box(first()).is_ok()));
    if let Ok(survey) = first()
        && let options = (ConditioningOptions { cutoff_hz: Some(30.0), ..Default::default() })
        && let Ok(conditioning) = Conditioning::choose(std::slice::from_ref(&survey), &options)
    {
        let pass = |sink: &mut dyn FnMut(phiw_telemetry::Block)| {
            stream(&survey, &conditioning, &mut |_, _| {}, &mut |block| {
                sink(block);
                ControlFlow::Continue(())
            })
        };
        group.bench_function("stream", |b| b.iter(|| pass(&mut |block| drop(black_box(block))).is_ok()));
        let mut scratch = FilterScratch::default();
        group.bench_function("stream and filter 200 columns", |b| {
            b.iter(|| {
                pass(&mut |block| {
                    block.filter(
                        200,
                        &mut scratch,
                        |k, row| row.fill(block.t[k]),
                        |_, _, row| {
                            black_box(row[0]);
                        },
                    );
                })
                .is_ok()
            });
        });
    }
    group.finish();
    let _ = std::fs::remove_file(file);
}

criterion_group!(benches, passes);
criterion_main!(benches);
