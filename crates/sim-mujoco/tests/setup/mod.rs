//! What the tests share: robots, the two backends, differences.
#![allow(dead_code)] // each test binary uses its part

use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{DynamicsBackend, Foot, Placement, SimulationBackend, Tree, World};
use phiw_sim_mujoco::{MujocoBackend, MujocoError};

/// The robot in MuJoCo; says so and gives `None` where MuJoCo is not there.
pub fn mujoco(tree: &Tree, world: &World) -> Option<MujocoBackend> {
    match MujocoBackend::new(tree, world) {
        Err(MujocoError::NotFound { .. }) => {
            println!("skipped: MuJoCo not found, run cargo xtask mujoco");
            None
        }
        built => Some(built.unwrap()),
    }
}

/// A random robot without mimic joints, and a state of it.
pub fn robot(seed: u64, joints: usize, floating_base: bool) -> (Tree, RandomState) {
    let options = RandomTreeOptions { joints, floating_base, ..RandomTreeOptions::default() };
    let tree = random_tree(seed, &options).unwrap();
    let state = random_state(&tree, &mut RandomNumbers::new(seed));
    (tree, state)
}

/// The four combinations of few and many joints, fixed and floating base.
pub fn robots() -> impl Iterator<Item = (Tree, RandomState)> {
    [(1, 1, false), (2, 12, false), (3, 1, true), (4, 12, true)]
        .into_iter()
        .map(|(seed, joints, floating_base)| robot(seed, joints, floating_base))
}

/// Largest difference, over the largest element of what is expected.
pub fn relative_difference(found: &[f64], expected: &[f64]) -> f64 {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(1e-3_f64, |largest, x| largest.max(x.abs()));
    let largest = found.iter().zip(expected).map(|(x, y)| (x - y).abs() / scale);
    largest.fold(0.0, |largest, x| if x <= largest { largest } else { x }) // a NaN stays
}

#[track_caller]
pub fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    let difference = relative_difference(found, expected);
    assert!(difference <= tolerance, "{difference:e} > {tolerance:e}:\n{found:?}\n{expected:?}");
}

/// The state of a backend.
pub fn state_of(backend: &dyn SimulationBackend) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut v) = (vec![0.0; backend.configuration_size()], vec![0.0; backend.velocity_size()]);
    backend.state(&mut q, &mut v).unwrap();
    (q, v)
}

/// Kinetic and potential energy \[J\], the rotors' included.
pub fn energy(backend: &mut MujocoBackend, tree: &Tree, q: &[f64], v: &[f64]) -> f64 {
    // ½·vᵀ·M·v, with M·v from inverse dynamics at rest, less gravity's share.
    let (still, mut with, mut without) = (vec![0.0; v.len()], vec![0.0; v.len()], vec![0.0; v.len()]);
    backend.inverse_dynamics(q, &still, v, &mut with).unwrap();
    backend.inverse_dynamics(q, &still, &still, &mut without).unwrap();
    let kinetic: f64 = (0..v.len()).map(|i| 0.5 * v[i] * (with[i] - without[i])).sum();
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements).unwrap();
    kinetic - tree.mass() * tree.gravity[2] * tree.center_of_mass(&placements).unwrap().0[2]
}

/// Four corners around a point below the base.
pub fn square_foot(half_side: f64, [x, y, z]: [f64; 3]) -> Foot {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    Foot { body: 0, sole: corners.map(|(i, j)| [x + half_side * i, y + half_side * j, z]).to_vec() }
}
