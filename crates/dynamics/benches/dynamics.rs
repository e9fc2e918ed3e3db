//! The dynamics algorithms on a random robot of 18 joints, one sample and four lanes at a time.

use criterion::{Criterion, criterion_group, criterion_main};
use phiw_dynamics::random_tree::{RandomNumbers, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::scalar::{Lanes, Scalar};
use phiw_dynamics::{DerivativesWorkspace, ForceDerivatives, Workspace};
use std::hint::black_box;

fn algorithms<T: Scalar>(criterion: &mut Criterion, scalar: &str, convert: fn(f64) -> T) {
    let options = RandomTreeOptions { joints: 18, ..RandomTreeOptions::default() };
    let tree = random_tree(1, &options).expect("a robot with joints");
    let state = random_state(&tree, &mut RandomNumbers::new(1));
    let [q, v, a] = [state.q, state.v, state.a].map(|x| x.into_iter().map(convert).collect::<Vec<T>>());
    let mut workspace = Workspace::new(&tree);
    let mut vector = vec![T::zero(); tree.velocity_size()];
    let mut matrix = vec![T::zero(); tree.velocity_size().pow(2)];
    let mut group = criterion.benchmark_group(scalar);
    group.bench_function("inverse_dynamics", |bencher| {
        bencher.iter(|| tree.inverse_dynamics(black_box(&q), &v, &a, &mut workspace, &mut vector));
    });
    let (mut scratch, mut derivatives) = (DerivativesWorkspace::new(&tree), ForceDerivatives::new(&tree));
    group.bench_function("inverse_dynamics_derivatives", |bencher| {
        bencher.iter(|| {
            tree.inverse_dynamics_derivatives(black_box(&q), &v, &a, &mut scratch, &mut derivatives)
        });
    });
    group.bench_function("mass_matrix", |bencher| {
        bencher.iter(|| tree.mass_matrix(black_box(&q), &mut workspace, &mut matrix));
    });
    group.bench_function("forward_dynamics", |bencher| {
        bencher.iter(|| tree.forward_dynamics(black_box(&q), &v, &a, &mut workspace, &mut vector));
    });
    group.finish();
}

fn all(criterion: &mut Criterion) {
    algorithms(criterion, "f64", |x| x);
    algorithms(criterion, "four lanes", |x| Lanes([x; 4]));
}

criterion_group!(dynamics, all);
criterion_main!(dynamics);
