//! Random robots in random states, for proptest.
#![allow(dead_code)] // each test file uses a part

use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{Tree, Workspace};
use proptest::prelude::*;

/// Options of all kinds of robot with 5 to 30 joints.
pub fn options() -> impl Strategy<Value = RandomTreeOptions> {
    (5..=30_usize, any::<bool>(), any::<bool>(), any::<bool>()).prop_map(
        |(joints, floating_base, mimic, fixed_links)| RandomTreeOptions {
            joints,
            floating_base,
            mimic,
            fixed_links,
        },
    )
}

/// A robot in a state, by what it is made from: a failing case prints two lines, not a tree.
#[derive(Clone, Debug)]
pub struct Robot {
    seed: u64,
    options: RandomTreeOptions,
}

impl Robot {
    /// The robot and its state.
    pub fn build(&self) -> (Tree, RandomState) {
        let tree = random_tree(self.seed, &self.options).unwrap();
        let state = random_state(&tree, &mut RandomNumbers::new(!self.seed));
        (tree, state)
    }
}

/// A robot in a state.
pub fn robot() -> impl Strategy<Value = Robot> {
    (any::<u64>(), options()).prop_map(|(seed, options)| Robot { seed, options })
}

/// Inverse dynamics into a new vector.
pub fn inverse_dynamics(tree: &Tree, q: &[f64], v: &[f64], a: &[f64]) -> Vec<f64> {
    let mut force = vec![f64::NAN; tree.velocity_size()];
    tree.inverse_dynamics(q, v, a, &mut Workspace::new(tree), &mut force).unwrap();
    force
}

/// The mass matrix as a new vector.
pub fn mass_matrix(tree: &Tree, q: &[f64]) -> Vec<f64> {
    let mut matrix = vec![f64::NAN; tree.velocity_size().pow(2)];
    tree.mass_matrix(q, &mut Workspace::new(tree), &mut matrix).unwrap();
    matrix
}

/// Matrix, row by row, times vector.
pub fn times(matrix: &[f64], vector: &[f64]) -> Vec<f64> {
    matrix.chunks_exact(vector.len()).map(|row| dot(row, vector)).collect()
}

/// The scalar product.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Largest element by magnitude.
pub fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest: f64, x| largest.max(x.abs()))
}

/// Fails unless the vectors agree to `tolerance` of their largest element.
#[track_caller]
pub fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let scale = largest(expected).max(1e-3);
    for (index, (x, y)) in found.iter().zip(expected).enumerate() {
        assert!((x - y).abs() <= tolerance * scale, "element {index}: {x} instead of {y} (scale {scale})");
    }
}
