//! Whatever the data say, bodies are possible and the optimum is certified.

use crate::random;

use phiw_consistency::{PARAMETERS_PER_BODY, Problem, PseudoInertia, Settings};
use proptest::prelude::*;
use random::{Random, data, problem, robot};

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    #[test]
    fn bodies_are_possible_and_the_gap_is_certified(
        seed in 0_u64..1_000_000,
        bodies in 0_usize..5,
        extras in 0_usize..5,
        // None, too few, more than enough.
        rows_share in prop_oneof![Just(0.0), Just(0.3), Just(1.0), Just(3.0)],
        scale in -3.0_f64..3.0,
        weight in -4.0_f64..6.0,
        // Data of bodies with these signs and sizes are no possible bodies' data.
        wrong in prop_oneof![Just(1.0), Just(-1.0), Just(0.0), Just(100.0)],
        dead_columns in any::<bool>(),
    ) {
        let mut random = Random::new(seed);
        let (priors, mut truth) = robot(&mut random, bodies, extras);
        truth.iter_mut().for_each(|value| *value *= wrong);
        let rows = (rows_share * truth.len() as f64) as usize;
        let (mut matrix, target) = data(&mut random, &truth, rows, 10.0_f64.powf(scale));
        if dead_columns && !truth.is_empty() {
            matrix.iter_mut().enumerate().filter(|(place, _)| place % truth.len() % 3 == 0).for_each(|(_, v)| *v = 0.0);
        }
        let problem = problem(&priors, extras, &(matrix, target));
        let solution = problem.solve(10.0_f64.powf(weight), &Settings::default()).unwrap();
        prop_assert!(solution.certified, "gap {} of {} after {}", solution.gap, solution.objective, solution.iterations);
        for body in solution.standard.as_chunks::<PARAMETERS_PER_BODY>().0 {
            prop_assert!(PseudoInertia::of_parameters(body).is_possible(), "{body:?}");
        }
        prop_assert!(solution.extras.iter().all(|value| *value >= 0.0), "{:?}", solution.extras);
    }
}

#[test]
fn without_bodies_or_data_there_is_nothing_to_do() {
    let solution = Problem::new(&[], 0).unwrap().solve(1.0, &Settings::default()).unwrap();
    assert!(solution.standard.is_empty() && solution.extras.is_empty() && solution.certified);
}
