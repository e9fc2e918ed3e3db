//! The joint torque regressor of a random robot of 18 joints, one sample and four lanes at a time.

use criterion::{Criterion, criterion_group, criterion_main};
use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::scalar::Lanes;
use phiw_regressor::JointTorqueRegressor;
use std::hint::black_box;

fn all(criterion: &mut Criterion) {
    for floating_base in [false, true] {
        let options = RandomTreeOptions { joints: 18, floating_base, ..RandomTreeOptions::default() };
        let tree = random_tree(1, &options).expect("a robot with joints");
        let state = random_state(&tree, &mut RandomNumbers::new(1));
        let regressor = JointTorqueRegressor::new(&tree);
        let mut group = criterion.benchmark_group(if floating_base { "floating base" } else { "fixed base" });

        let (mut scratch, mut pairs) = (regressor.scratch::<f64>(), vec![0.0; regressor.buffer_size()]);
        group.bench_function("one sample", |bencher| {
            bencher.iter(|| {
                regressor.compute(&tree, black_box(&state.q), &state.v, &state.a, &mut scratch, &mut pairs)
            });
        });

        let [q, v, a] =
            [&state.q, &state.v, &state.a].map(|x| x.iter().map(|&x| Lanes([x; 4])).collect::<Vec<_>>());
        let (mut scratch, mut pairs) =
            (regressor.scratch::<Lanes<4>>(), vec![Lanes([0.0; 4]); regressor.buffer_size()]);
        group.bench_function("four lanes", |bencher| {
            bencher.iter(|| regressor.compute_lanes(&tree, black_box(&q), &v, &a, &mut scratch, &mut pairs));
        });
        group.finish();
    }
}

criterion_group!(regressor, all);
criterion_main!(regressor);
