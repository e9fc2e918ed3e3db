//! Robots and motions for tests.
#![allow(dead_code, reason = "each test file uses its own part")]

use phiw_dynamics::inertia::{Inertia, InertialParameters};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Mat3, Tree, Vec3};
use phiw_zmp::standing_parameters;
use proptest::prelude::*;

/// A random robot with all that stands, in a random state; what it is made from is short to print.
#[derive(Clone, Debug)]
pub struct Robot {
    seed: u64,
    options: RandomTreeOptions,
}

/// The parts of a [`Robot`].
pub struct Built {
    pub tree: Tree,
    pub state: RandomState,
    /// Standing parameters: those of the tree, after a random base link's on a fixed base.
    pub parameters: Vec<f64>,
}

impl Robot {
    pub fn build(&self) -> Built {
        let tree = random_tree(self.seed, &self.options).unwrap();
        let mut random = RandomNumbers::new(!self.seed);
        let state = random_state(&tree, &mut random);
        let bodies = tree.inertial_parameters();
        let base = base_link(&mut random);
        let parameters = if tree.is_floating() { bodies } else { standing_parameters(&base, &bodies) };
        Built { tree, state, parameters }
    }
}

fn base_link(random: &mut RandomNumbers) -> InertialParameters {
    let center = Vec3([0, 1, 2].map(|_| random.uniform(-0.3, 0.3)));
    let mut tensor = Mat3::constant([[0.0; 3]; 3]);
    (0..3).for_each(|axis| tensor.0[axis][axis] = random.uniform(0.5, 0.9));
    Inertia::from_center_of_mass(random.uniform(5.0, 40.0), center, tensor).parameters()
}

pub fn robot() -> impl Strategy<Value = Robot> {
    (any::<u64>(), 3..=20_usize, any::<bool>(), any::<bool>()).prop_map(
        |(seed, joints, floating_base, mimic)| {
            let options = RandomTreeOptions { joints, floating_base, mimic, ..RandomTreeOptions::default() };
            Robot { seed, options }
        },
    )
}

/// A model of this workspace.
pub fn model(name: &str, floating_base: bool) -> Tree {
    let path = format!("{}/../../models/{name}.urdf", env!("CARGO_MANIFEST_DIR"));
    let xml = std::fs::read_to_string(&path).expect(&path);
    read_urdf(&xml, &UrdfOptions { floating_base, ..UrdfOptions::default() }).expect(&path).tree
}

/// The 18-joint upper body on a fixed base, and the parameters of all that stands.
pub fn upper_body() -> (Tree, Vec<f64>) {
    let (tree, floating) = (model("upper_body18", false), model("upper_body18", true));
    let parameters = standing_parameters(&floating.bodies()[0].inertial, &tree.inertial_parameters());
    (tree, parameters)
}

/// `found` and `expected` differ by no more than `tolerance` of the largest number, or of one.
pub fn assert_close(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len());
    let scale = expected.iter().fold(1.0_f64, |scale, x| scale.max(x.abs()));
    for (found_x, expected_x) in found.iter().zip(expected) {
        assert!(
            (found_x - expected_x).abs() <= tolerance * scale,
            "found {found:?}, expected {expected:?}, tolerance {tolerance} of {scale}"
        );
    }
}
