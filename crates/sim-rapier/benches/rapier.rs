//! A step and inverse dynamics of the 18-joint upper body, beside what the engine itself takes for them.

use criterion::{Criterion, criterion_group, criterion_main};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_dynamics::{DynamicsBackend, SimulationBackend, Tree, World};
use phiw_sim_rapier::RapierBackend;
use std::hint::black_box;

/// Without weight, so that it stays near where it starts however often it is stepped.
fn upper_body() -> Tree {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../models/upper_body18.urdf");
    let mut tree = read_urdf_file(path, &UrdfOptions::default()).expect("models/upper_body18.urdf").tree;
    tree.gravity = [0.0; 3];
    tree
}

fn backend(tree: &Tree, iterations: usize) -> RapierBackend {
    let backend = RapierBackend::new(tree, &World::default()).expect("a robot for Rapier");
    backend.with_solver_iterations(iterations).expect("more than zero")
}

fn steps(criterion: &mut Criterion) {
    let tree = upper_body();
    let RandomState { q, .. } = random_state(&tree, &mut RandomNumbers::new(1));
    let (rest, torque) = (vec![0.0; 18], vec![1e-9; 18]);
    let mut group = criterion.benchmark_group("step of 1 ms, 18 joints");
    for iterations in [1, 4, 8, 16] {
        let mut ours = backend(&tree, iterations);
        ours.set_state(&q, &rest).expect("a state");
        group.bench_function(format!("{iterations} iterations"), |bencher| {
            bencher.iter(|| ours.step(black_box(&torque), 1e-3).expect("a step"));
        });
        let mut ours = backend(&tree, iterations);
        ours.set_state(&q, &rest).expect("a state");
        ours.step(&torque, 1e-3).expect("a step");
        let mut raw = ours.into_physics_world();
        group.bench_function(format!("{iterations} iterations, engine alone"), |bencher| {
            bencher.iter(|| raw.step());
        });
    }
}

fn dynamics(criterion: &mut Criterion) {
    let tree = upper_body();
    let RandomState { q, v, a } = random_state(&tree, &mut RandomNumbers::new(1));
    let mut ours = backend(&tree, 1);
    let mut force = vec![0.0; 18];
    let mut group = criterion.benchmark_group("dynamics, 18 joints");
    group.bench_function("inverse", |bencher| {
        bencher.iter(|| ours.inverse_dynamics(black_box(&q), &v, &a, &mut force).expect("a force"));
    });
    group.bench_function("forward", |bencher| {
        bencher.iter(|| ours.forward_dynamics(black_box(&q), &v, &a, &mut force).expect("an acceleration"));
    });
    ours.set_state(&q, &v).expect("a state");
    let mut raw = ours.into_physics_world();
    raw.integration_parameters.dt = 1e-15;
    group.bench_function("engine's step of an instant", |bencher| bencher.iter(|| raw.step()));
}

criterion_group!(benches, steps, dynamics);
criterion_main!(benches);
