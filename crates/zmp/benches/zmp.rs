//! Balance of one sample of the 18-joint upper body: both ZMPs, the linear map, and its gradient.

use criterion::{Criterion, criterion_group, criterion_main};
use phiw_dynamics::random_tree::{RandomNumbers, random_state};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_zmp::{BalanceRows, ZmpModel, ZmpWorkspace, standing_parameters};
use std::hint::black_box;

fn all(criterion: &mut Criterion) {
    let read = |floating_base| {
        let options = UrdfOptions { floating_base, ..UrdfOptions::default() };
        read_urdf(include_str!("../../../models/upper_body18.urdf"), &options).expect("a URDF").tree
    };
    let (tree, floating) = (read(false), read(true));
    let parameters = standing_parameters(&floating.bodies()[0].inertial, &tree.inertial_parameters());
    let state = random_state(&tree, &mut RandomNumbers::new(1));
    let (q, v, a) = (&state.q[..], &state.v[..], &state.a[..]);
    let mut workspace = ZmpWorkspace::new(&tree);
    criterion.bench_function("both ZMPs", |bencher| {
        bencher.iter(|| {
            let balance = workspace.evaluate(&tree, &parameters, black_box(q), v, a).expect("sizes fit");
            [ZmpModel::PointMass, ZmpModel::MultiBody].map(|model| balance.zmp(model, 0.0))
        });
    });
    let mut rows = BalanceRows::new(&tree);
    criterion.bench_function("rows", |bencher| {
        bencher.iter(|| rows.compute(&tree, black_box(q), v, a, &mut workspace));
    });
    criterion.bench_function("balance from rows", |bencher| {
        bencher.iter(|| rows.balance(black_box(&parameters)));
    });
    let balance = rows.balance(&parameters).expect("sizes fit");
    let mut gradient = vec![0.0; 2 * rows.parameter_count()];
    criterion.bench_function("gradient from rows", |bencher| {
        bencher.iter(|| rows.zmp_gradient(ZmpModel::MultiBody, black_box(&balance), 0.0, &mut gradient));
    });
}

criterion_group!(zmp, all);
criterion_main!(zmp);
