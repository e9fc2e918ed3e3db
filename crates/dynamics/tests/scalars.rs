//! One kernel, three kinds of number: lanes equal separate runs, duals equal difference quotients.

use crate::arbitrary;

use arbitrary::{assert_close, inverse_dynamics, robot};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
use phiw_dynamics::scalar::{Dual, Lanes, Scalar};
use phiw_dynamics::{Tree, Workspace};
use proptest::prelude::*;

/// What inverse dynamics asks of a kind of number, and the division that it does not need. (One algorithm:
/// each is compiled anew for each kind of number.)
fn force_and_quotients<T: Scalar>(tree: &Tree, q: &[T], v: &[T], a: &[T]) -> Vec<T> {
    let mut force = vec![T::zero(); tree.velocity_size()];
    tree.inverse_dynamics(q, v, a, &mut Workspace::new(tree), &mut force).unwrap();
    force.extend(v.iter().zip(a).map(|(&v, &a)| v / (T::constant(10.0) + a)));
    force
}

fn pack(samples: &[Vec<f64>; 4]) -> Vec<Lanes<4>> {
    (0..samples[0].len()).map(|i| Lanes([0, 1, 2, 3].map(|lane| samples[lane][i]))).collect()
}

/// All three algorithms, one after the other: force, mass matrix, acceleration.
fn run<T: Scalar>(tree: &Tree, q: &[T], v: &[T], a: &[T]) -> Vec<T> {
    let (size, mut workspace) = (tree.velocity_size(), Workspace::new(tree));
    let mut force = vec![T::zero(); size];
    tree.inverse_dynamics(q, v, a, &mut workspace, &mut force).unwrap();
    let mut matrix = vec![T::zero(); size * size];
    tree.mass_matrix(q, &mut workspace, &mut matrix).unwrap();
    let mut acceleration = vec![T::zero(); size];
    tree.forward_dynamics(q, v, &force, &mut workspace, &mut acceleration).unwrap();
    [force, matrix, acceleration].concat()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn lanes_equal_separate_runs(robot in robot(), seed in any::<u64>()) {
        let (tree, _) = robot.build();
        let random = &mut RandomNumbers::new(seed);
        let states: [RandomState; 4] = [0; 4].map(|_| random_state(&tree, random));
        let pick = |part: fn(&RandomState) -> &Vec<f64>| pack(&[0, 1, 2, 3].map(|lane| part(&states[lane]).clone()));
        let together = run(&tree, &pick(|s| &s.q), &pick(|s| &s.v), &pick(|s| &s.a));
        for (lane, state) in states.iter().enumerate() {
            let alone = run(&tree, &state.q, &state.v, &state.a);
            let found: Vec<f64> = together.iter().map(|value| value.0[lane]).collect();
            assert_close(&found, &alone, 1e-12);
        }
    }

    #[test]
    fn duals_equal_difference_quotients(robot in robot(), seed in any::<u64>()) {
        let (tree, RandomState { q, v, a }) = robot.build();
        let first = if tree.is_floating() { 7 } else { 0 };
        let random = &mut RandomNumbers::new(seed);
        // A direction in (joints' q, v, a) space.
        let mut direction = |count: usize| -> Vec<f64> { (0..count).map(|_| random.uniform(-1.0, 1.0)).collect() };
        let mut dq = vec![0.0; first];
        dq.extend(direction(q.len() - first));
        let (dv, da) = (direction(v.len()), direction(a.len()));
        let dual = |x: &[f64], dx: &[f64]| -> Vec<Dual> {
            x.iter().zip(dx).map(|(&value, &derivative)| Dual { value, derivative }).collect()
        };
        let mut force = vec![Dual::zero(); v.len()];
        tree.inverse_dynamics(&dual(&q, &dq), &dual(&v, &dv), &dual(&a, &da), &mut Workspace::new(&tree), &mut force)
            .unwrap();
        let along = |x: &[f64], dx: &[f64], step: f64| -> Vec<f64> {
            x.iter().zip(dx).map(|(x, dx)| x + step * dx).collect()
        };
        let shifted = |step| inverse_dynamics(&tree, &along(&q, &dq, step), &along(&v, &dv, step), &along(&a, &da, step));
        let step = 1e-6;
        let quotient: Vec<f64> =
            shifted(step).iter().zip(shifted(-step)).map(|(f, g)| (f - g) / (2.0 * step)).collect();
        let derivative: Vec<f64> = force.iter().map(|f| f.derivative).collect();
        assert_close(&derivative, &quotient, 1e-6);
    }

    #[test]
    fn derivatives_side_by_side_equal_single_ones(robot in robot(), seed in any::<u64>()) {
        let (tree, RandomState { q, v, a }) = robot.build();
        let random = &mut RandomNumbers::new(seed);
        let mut directions = |values: &[f64]| -> Vec<(f64, [f64; 3])> {
            values.iter().map(|&value| (value, [0; 3].map(|_| random.uniform(-1.0, 1.0)))).collect()
        };
        let state = [directions(&q), directions(&v), directions(&a)];
        let [q, v, a] = state.each_ref().map(|part| -> Vec<Dual<Lanes<3>>> {
            part.iter().map(|&(value, along)| Dual { value, derivative: Lanes(along) }).collect()
        });
        let together = force_and_quotients(&tree, &q, &v, &a);
        for lane in 0..3 {
            let [q, v, a] = state.each_ref().map(|part| -> Vec<Dual> {
                part.iter().map(|&(value, along)| Dual { value, derivative: along[lane] }).collect()
            });
            let alone = force_and_quotients(&tree, &q, &v, &a);
            let alone: Vec<f64> = alone.iter().map(|value| value.derivative).collect();
            let found: Vec<f64> = together.iter().map(|value| value.derivative.0[lane]).collect();
            assert_close(&found, &alone, 1e-12);
        }
    }
}
