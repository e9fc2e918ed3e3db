//! The robot's own equation, against phiw's algorithms.

use crate::setup;

use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
use phiw_dynamics::{AnalyticBackend, BackendError, DynamicsBackend, JointType, Tree, World};
use phiw_sim_mujoco::MujocoBackend;
use proptest::prelude::*;
use setup::{assert_close, mujoco, robot, robots};

/// Inverse dynamics and the wrench at the base are the analytic ones, and forward dynamics undoes them.
fn check_against_analytic(backend: &mut MujocoBackend, tree: &Tree, RandomState { q, v, a }: &RandomState) {
    let mut analytic = AnalyticBackend::new(tree.clone());
    let (mut force, mut expected, mut found) = (a.clone(), a.clone(), a.clone());
    analytic.inverse_dynamics(q, v, a, &mut expected).unwrap();
    backend.inverse_dynamics(q, v, a, &mut force).unwrap();
    assert_close(&force, &expected, 1e-10);
    // Forward dynamics in between must not lose the wrench.
    backend.forward_dynamics(q, v, &force, &mut found).unwrap();
    assert_close(&found, a, 1e-8);
    assert_close(&backend.base_wrench(), &analytic.base_wrench(), 1e-10);
    analytic.forward_dynamics(q, v, &expected, &mut found).unwrap();
    assert_close(&found, a, 1e-8);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn dynamics_of_random_robots_are_the_analytic(seed: u64, joints in 1..20_usize, floating_base: bool) {
        let (tree, _) = robot(seed, joints, floating_base);
        let Some(mut backend) = mujoco(&tree, &World::default()) else { return Ok(()) };
        let mut random = RandomNumbers::new(seed);
        for _ in 0..5 {
            check_against_analytic(&mut backend, &tree, &random_state(&tree, &mut random));
        }
    }
}

#[test]
fn random_robots_have_all_joint_types() {
    let kinds = [JointType::Floating, JointType::Revolute, JointType::Continuous, JointType::Prismatic];
    let trees: Vec<Tree> = robots().map(|(tree, _)| tree).collect();
    for kind in kinds {
        assert!(trees.iter().flat_map(Tree::bodies).any(|body| body.joint_type == kind), "no {kind:?} joint");
    }
}

/// An identified model need not be that of a real body: nothing may round it, balance it or refuse it.
#[test]
fn parameters_of_no_real_body_are_simulated_as_they_are() {
    for (mut tree, state) in robots() {
        let mut parameters = tree.inertial_parameters();
        let first = if tree.is_floating() { 10 } else { 0 };
        parameters[first + 4] = 0.0; // Ixx: no triangle inequality
        parameters[first + 9] += 3.0;
        parameters[first..first + 10].iter_mut().for_each(|x| *x *= 1.0 / 3.0);
        tree.set_inertial_parameters(&parameters).unwrap();
        let Some(mut backend) = mujoco(&tree, &World::default()) else { return };
        check_against_analytic(&mut backend, &tree, &state);
    }
}

#[test]
fn a_mass_matrix_that_is_not_positive_definite_names_the_link() {
    let (mut tree, RandomState { q, v, a }) = robot(5, 4, false);
    let parameters: Vec<f64> = tree.inertial_parameters().iter().map(|x| -x).collect();
    tree.set_inertial_parameters(&parameters).unwrap();
    let Some(mut backend) = mujoco(&tree, &World::default()) else { return };
    let (mut force, mut expected) = (a.clone(), a.clone());
    backend.inverse_dynamics(&q, &v, &a, &mut force).unwrap();
    AnalyticBackend::new(tree.clone()).inverse_dynamics(&q, &v, &a, &mut expected).unwrap();
    assert_close(&force, &expected, 1e-10);
    let error = backend.forward_dynamics(&q, &v, &force, &mut expected).unwrap_err().to_string();
    assert!(error.contains(&tree.bodies()[0].link) && error.contains("positive definite"), "{error}");
}

#[test]
fn a_last_link_without_mass_is_singular() {
    let (mut tree, RandomState { q, v, a }) = robot(6, 3, false);
    let mut parameters = tree.inertial_parameters();
    let last = parameters.len() - 10;
    parameters[last..].fill(0.0);
    tree.set_inertial_parameters(&parameters).unwrap();
    let Some(mut backend) = mujoco(&tree, &World::default()) else { return };
    let (mut force, mut found) = (a.clone(), a.clone());
    backend.inverse_dynamics(&q, &v, &a, &mut force).unwrap();
    assert_eq!(backend.forward_dynamics(&q, &v, &force, &mut found), Err(BackendError::Singular));
    // A rotor makes up for it.
    let world = World { rotor_inertia: vec![0.1; 3], ..World::default() };
    let Some(mut backend) = mujoco(&tree, &world) else { return };
    backend.inverse_dynamics(&q, &v, &a, &mut force).unwrap();
    backend.forward_dynamics(&q, &v, &force, &mut found).unwrap();
    assert_close(&found, &a, 1e-8);
}

#[test]
fn rotor_inertia_is_on_the_diagonal_of_the_mass_matrix() {
    for (tree, RandomState { q, v, a }) in robots() {
        let rotor_inertia: Vec<f64> = (1..=tree.joint_count()).map(|joint| 0.3 * joint as f64).collect();
        let world = World { rotor_inertia: rotor_inertia.clone(), ..World::default() };
        let Some(mut backend) = mujoco(&tree, &world) else { return };
        let (mut found, mut expected) = (a.clone(), a.clone());
        backend.inverse_dynamics(&q, &v, &a, &mut found).unwrap();
        AnalyticBackend::new(tree.clone()).inverse_dynamics(&q, &v, &a, &mut expected).unwrap();
        let first_joint = tree.velocity_size() - tree.joint_count();
        for (joint, inertia) in rotor_inertia.iter().enumerate() {
            expected[first_joint + joint] += inertia * a[first_joint + joint];
        }
        assert_close(&found, &expected, 1e-10);
        backend.forward_dynamics(&q, &v, &expected, &mut found).unwrap();
        assert_close(&found, &a, 1e-8);
    }
}
