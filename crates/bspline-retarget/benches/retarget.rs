//! Time of retargeting against the length of the recording, and of its parts.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use phiw_bspline_retarget::c3d::read_c3d;
use phiw_bspline_retarget::embedded::{EmbeddedMotion, embedded_motions};
use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::MarkerRecording;
use phiw_bspline_retarget::{RetargetOptions, Retargeter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::hint::black_box;

fn retargeter() -> Retargeter {
    let robot = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/upper_body18.urdf");
    let tree = read_urdf_file(robot, &UrdfOptions::default()).expect("the project's own robot").tree;
    Retargeter::new(tree, MarkerMap::embedded().expect("it is part of the crate"), RetargetOptions::default())
        .expect("it has two arms")
}

/// The motion there and back again, until it has `frames`.
fn of_length(motion: &EmbeddedMotion, frames: usize) -> MarkerRecording {
    let mut recording = motion.recording.clone();
    let (markers, period) = (recording.labels.len(), recording.frames() - 1);
    recording.positions_m = (0..frames)
        .flat_map(|frame| {
            let phase = frame % (2 * period);
            let source = if phase < period { phase } else { 2 * period - phase };
            motion.recording.positions_m[source * markers..][..markers].to_vec()
        })
        .collect();
    recording
}

fn retarget(criterion: &mut Criterion) {
    let retargeter = retargeter();
    let motion = embedded_motions(1)
        .expect("it is part of the crate")
        .find(|motion| motion.task == "Mix")
        .expect("Table 1 has it");
    let mut group = criterion.benchmark_group("retarget");
    group.sample_size(10);
    for frames in [200, 740, 2_000, 6_000, 20_000] {
        let recording = of_length(&motion, frames);
        group.throughput(Throughput::Elements(frames as u64));
        group.bench_with_input(BenchmarkId::from_parameter(frames), &recording, |bencher, recording| {
            bencher.iter(|| retargeter.retarget(black_box(recording), None));
        });
    }
    group.finish();
}

fn read(criterion: &mut Criterion) {
    let bytes = embedded_motions(1).expect("it is part of the crate").next().expect("110 of them").to_c3d();
    let mut group = criterion.benchmark_group("read_c3d");
    group.throughput(Throughput::Bytes(bytes.len() as u64));
    group.bench_function("embedded", |bencher| bencher.iter(|| read_c3d(black_box(&bytes))));
    group.finish();
}

criterion_group!(benches, retarget, read);
criterion_main!(benches);
