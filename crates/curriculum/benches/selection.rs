//! The next motion among 98 of the 18-joint upper body, four of them measured: 132 parameters, motions of 7
//! s. And among many more, each three of the 98 one after another: 10 000, or as many as the environment
//! variable `PHIW_BENCH_MOTIONS` says (a motion takes 70 kB).

use criterion::{Criterion, criterion_group, criterion_main};
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::selection::{
    MotionCandidates, Question, Selection, SmallestCondition, TorqueOptimal, Triangle,
};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_effects::Catalogue;
use phiw_estimation::Robot;
use phiw_plant::{MultiSine, Reference};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::hint::black_box;

const MOTIONS: usize = 98;
const SAMPLES: usize = 701;

fn all(criterion: &mut Criterion) {
    let urdf = include_str!("../../../models/upper_body18.urdf");
    let tree = read_urdf(urdf, &UrdfOptions::default()).expect("a URDF").tree;
    let joints = tree.joint_count();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let motions = (0..MOTIONS)
        .map(|index| {
            let sine = MultiSine::random(&tree, 7.0, 0.6, [0.4, 0.4], &mut rng);
            let mut signals = [0; 3].map(|_| vec![0.0; SAMPLES * joints]);
            let [q, v, a] = &mut signals;
            for k in 0..SAMPLES {
                let own = k * joints..(k + 1) * joints;
                sine.at(0.01 * k as f64, &mut q[own.clone()], &mut v[own.clone()], &mut a[own]);
            }
            Motion::new(&index.to_string(), "sine", joints, 0.01, signals).expect("a motion")
        })
        .collect();
    let dataset = MotionDataset::new(joints, motions).expect("a dataset");
    let robot = Robot::with_viscous_friction(tree, [0.0; 10], Catalogue::default()).expect("a robot");
    let weights = vec![1.0; joints];
    let candidates =
        MotionCandidates::new(&robot, robot.declared(), &dataset, &weights).expect("motions of this robot");
    let mut measured = Triangle::empty(candidates.everything().size());
    for candidate in &candidates.all()[..4] {
        measured.absorb(&mut candidate.triangle.clone());
    }
    let allowed: Vec<usize> = (0..MOTIONS).collect();
    let question = Question {
        dataset: &dataset,
        candidates: &candidates,
        allowed: &allowed,
        measured: Some(&measured),
        history: &[],
    };
    let many = many();
    let longer = longer(&candidates, many);
    let allowed: Vec<usize> = (0..many).collect();
    let among_many = Question { candidates: &longer, allowed: &allowed, ..question };
    criterion.bench_function("smallest condition, 98 candidates", |bencher| {
        bencher.iter(|| SmallestCondition.choose(black_box(&question), &mut rng));
    });
    criterion.bench_function("torque-optimal, 98 candidates", |bencher| {
        bencher.iter(|| TorqueOptimal.choose(black_box(&question), &mut rng));
    });
    let mut group = criterion.benchmark_group("many");
    group.sample_size(10);
    group.bench_function(format!("smallest condition, {many} candidates"), |bencher| {
        bencher.iter(|| SmallestCondition.choose(black_box(&among_many), &mut rng));
    });
    group.finish();
}

fn many() -> usize {
    std::env::var("PHIW_BENCH_MOTIONS").ok().and_then(|count| count.parse().ok()).unwrap_or(10_000)
}

/// `count` motions, each three of `candidates` one after another.
fn longer(candidates: &MotionCandidates, count: usize) -> MotionCandidates {
    let all = candidates.all();
    let triples = (0..all.len()).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| [a, b, c])));
    let triples: Vec<[usize; 3]> = triples.take(count).collect();
    assert_eq!(triples.len(), count, "more motions than there are triples");
    let joined = |[a, b, c]: &[usize; 3]| {
        let mut triangle = all[*a].triangle.clone();
        triangle.absorb(&mut all[*b].triangle.clone());
        triangle.absorb(&mut all[*c].triangle.clone());
        triangle
    };
    let triangles = triples.par_iter().map(joined).collect();
    MotionCandidates::of_triangles(triangles, candidates.weights(), 100.0).expect("motions of one robot")
}

criterion_group!(selection, all);
criterion_main!(selection);
