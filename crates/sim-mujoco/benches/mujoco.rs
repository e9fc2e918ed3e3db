//! The price of the trait: each call through it, beside MuJoCo's own call on the same robot of 18 joints.

use criterion::{BenchmarkGroup, Criterion, criterion_group, criterion_main, measurement::WallTime};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{DynamicsBackend, SimulationBackend, World};
use phiw_sim_mujoco::{Integrator, MujocoBackend};
use std::hint::black_box;

/// Steps of one sample: the robot swings for 20 ms, and starts again.
const STEPS: usize = 20;

fn all(criterion: &mut Criterion) {
    for (base, floating_base) in [("fixed base", false), ("floating base", true)] {
        let options = RandomTreeOptions { joints: 18, floating_base, ..RandomTreeOptions::default() };
        let tree = random_tree(1, &options).expect("a robot with joints");
        let state = random_state(&tree, &mut RandomNumbers::new(1));
        let mut group = criterion.benchmark_group(base);
        for integrator in [Integrator::RungeKutta4, Integrator::Implicit] {
            match MujocoBackend::new(&tree, &World::default()) {
                Ok(backend) => steps(&mut group, &mut backend.with_integrator(integrator), &state),
                Err(error) => return println!("skipped: {error}"),
            }
        }
        if let Ok(mut backend) = MujocoBackend::new(&tree, &World::default()) {
            inverse_dynamics(&mut group, &mut backend, &state);
        }
        group.finish();
    }
}

fn inverse_dynamics(
    group: &mut BenchmarkGroup<'_, WallTime>,
    backend: &mut MujocoBackend,
    state: &RandomState,
) {
    let RandomState { q, v, a } = state;
    let mut force = vec![0.0; v.len()];
    group.bench_function("inverse dynamics", |bencher| {
        bencher.iter(|| backend.inverse_dynamics(black_box(q), v, a, &mut force));
    });
    group.bench_function("inverse dynamics, mj_inverse alone", |bencher| {
        bencher.iter(|| backend.call_inverse_alone());
    });
}

fn steps(group: &mut BenchmarkGroup<'_, WallTime>, backend: &mut MujocoBackend, state: &RandomState) {
    let integrator = backend.integrator();
    let torque = vec![0.0; backend.joint_names().len()];
    group.bench_function(format!("{STEPS} steps, {integrator:?}"), |bencher| {
        bencher.iter(|| {
            backend.set_state(&state.q, &state.v)?;
            (0..STEPS).try_for_each(|_| backend.step(black_box(&torque), 1e-3))
        });
    });
    group.bench_function(format!("{STEPS} steps, {integrator:?}, mj_step alone"), |bencher| {
        bencher.iter(|| {
            backend.set_state(&state.q, &state.v)?;
            (0..STEPS).for_each(|_| backend.call_step_alone());
            Ok::<_, phiw_dynamics::BackendError>(())
        });
    });
}

criterion_group!(mujoco, all);
criterion_main!(mujoco);
