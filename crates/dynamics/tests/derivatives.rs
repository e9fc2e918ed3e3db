//! Derivatives of inverse dynamics: those of dual numbers.

use crate::arbitrary;

use arbitrary::{assert_close, mass_matrix};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::scalar::{Dual, Lanes};
use phiw_dynamics::{DerivativesWorkspace, DimensionError, ForceDerivatives, Tree, Workspace};
use proptest::prelude::*;

/// ∂τ/∂x, row by row: of the position (0) or the velocity (1), one direction after the other.
fn by_dual_numbers(tree: &Tree, state: &RandomState, part: usize) -> Vec<f64> {
    let size = tree.velocity_size();
    let constant = |values: &[f64]| -> Vec<Dual> {
        values.iter().map(|&value| Dual { value, derivative: 0.0 }).collect()
    };
    let mut matrix = vec![f64::NAN; size * size];
    for column in 0..size {
        let mut parts = [&state.q, &state.v, &state.a].map(|values| constant(values));
        parts[part][column].derivative = 1.0;
        let [q, v, a] = parts;
        let mut force = constant(&vec![0.0; size]);
        tree.inverse_dynamics(&q, &v, &a, &mut Workspace::new(tree), &mut force).unwrap();
        force.iter().enumerate().for_each(|(row, force)| matrix[row * size + column] = force.derivative);
    }
    matrix
}

fn analytic(tree: &Tree, state: &RandomState) -> ForceDerivatives<f64> {
    let RandomState { q, v, a } = state;
    let mut found = ForceDerivatives::new(tree);
    tree.inverse_dynamics_derivatives(q, v, a, &mut DerivativesWorkspace::new(tree), &mut found).unwrap();
    found
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn analytic_derivatives_are_those_of_dual_numbers(
        seed in any::<u64>(),
        joints in 1..=20_usize,
        mimic in any::<bool>(),
    ) {
        let options = RandomTreeOptions { joints, mimic, ..RandomTreeOptions::default() };
        let tree = random_tree(seed, &options).unwrap();
        let state = random_state(&tree, &mut RandomNumbers::new(!seed));
        let found = analytic(&tree, &state);
        assert_close(&found.by_position, &by_dual_numbers(&tree, &state, 0), 1e-11);
        assert_close(&found.by_velocity, &by_dual_numbers(&tree, &state, 1), 1e-11);
        assert_close(&found.by_acceleration, &mass_matrix(&tree, &state.q), 1e-11);
    }

    #[test]
    fn derivatives_in_lanes_equal_those_of_separate_runs(seed in any::<u64>(), joints in 1..=12_usize) {
        let options = RandomTreeOptions { joints, ..RandomTreeOptions::default() };
        let tree = random_tree(seed, &options).unwrap();
        let random = &mut RandomNumbers::new(!seed);
        let states: [RandomState; 4] = [0; 4].map(|_| random_state(&tree, random));
        let pack = |part: fn(&RandomState) -> &Vec<f64>| -> Vec<Lanes<4>> {
            (0..joints).map(|joint| Lanes([0, 1, 2, 3].map(|lane| part(&states[lane])[joint]))).collect()
        };
        let [q, v, a] = [pack(|state| &state.q), pack(|state| &state.v), pack(|state| &state.a)];
        let mut together = ForceDerivatives::new(&tree);
        let workspace = &mut DerivativesWorkspace::new(&tree);
        tree.inverse_dynamics_derivatives(&q, &v, &a, workspace, &mut together).unwrap();
        for (lane, state) in states.iter().enumerate() {
            let alone = analytic(&tree, state);
            for (found, expected) in [
                (&together.by_position, &alone.by_position),
                (&together.by_velocity, &alone.by_velocity),
                (&together.by_acceleration, &alone.by_acceleration),
            ] {
                let found: Vec<f64> = found.iter().map(|value| value.0[lane]).collect();
                assert_close(&found, expected, 1e-12);
            }
        }
    }
}

#[test]
fn derivatives_of_a_floating_base_are_refused() {
    let options = RandomTreeOptions { joints: 3, floating_base: true, ..RandomTreeOptions::default() };
    let tree = random_tree(1, &options).unwrap();
    let RandomState { q, v, a } = random_state(&tree, &mut RandomNumbers::new(2));
    let (workspace, found) = (&mut DerivativesWorkspace::new(&tree), &mut ForceDerivatives::new(&tree));
    let refused = tree.inverse_dynamics_derivatives(&q, &v, &a, workspace, found);
    assert!(matches!(refused, Err(DimensionError::FloatingBase { .. })));
}
