//! Inverse dynamics, mass matrix and forward dynamics agree with each other and with energy, over random
//! robots.

use crate::arbitrary;

use arbitrary::{assert_close, dot, inverse_dynamics, mass_matrix, robot, times};
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::random_tree::RandomState;
use phiw_dynamics::scalar::Dual;
use phiw_dynamics::{Placement, Spatial, Tree, Vec3, Workspace};
use proptest::prelude::*;

/// ½·Σ of each body's mass and inertia with its velocity, from Jacobians: no mass matrix involved.
fn kinetic_energy(tree: &Tree, q: &[f64], v: &[f64]) -> f64 {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements).unwrap();
    let mut jacobian = vec![0.0; 6 * tree.velocity_size()];
    let energy = |(index, body): (usize, &phiw_dynamics::Body)| {
        tree.point_jacobian(&placements, index, Vec3::zero(), &mut jacobian).unwrap();
        let [x, y, z, rx, ry, rz] = times(&jacobian, v)[..].try_into().unwrap();
        let velocity = Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) };
        let turned = Placement { translation: Vec3::zero(), ..placements[index] };
        let inertia = Inertia::from_parameters(&body.inertial).moved(turned);
        0.5 * velocity.dot(inertia.times(velocity))
    };
    tree.bodies().iter().enumerate().map(energy).sum()
}

/// Potential energy and its derivative by coordinate `joint` (floating base left out).
fn potential_energy(tree: &Tree, q: &[f64], coordinate: usize) -> Dual {
    let mut q: Vec<Dual> = q.iter().map(|&value| Dual { value, derivative: 0.0 }).collect();
    q[coordinate].derivative = 1.0;
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(&q, &mut placements).unwrap();
    let weight: Vec3<Dual> = Vec3::constant(tree.gravity.map(|g| -g * tree.mass()));
    weight.dot(tree.center_of_mass(&placements).unwrap())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(128))]

    #[test]
    fn mass_matrix_and_bias_give_inverse_dynamics(robot in robot()) {
        let (tree, RandomState { q, v, a }) = robot.build();
        let matrix = mass_matrix(&tree, &q);
        let bias = inverse_dynamics(&tree, &q, &v, &vec![0.0; v.len()]);
        let sum: Vec<f64> = times(&matrix, &a).iter().zip(&bias).map(|(x, y)| x + y).collect();
        assert_close(&sum, &inverse_dynamics(&tree, &q, &v, &a), 1e-10);
    }

    #[test]
    fn forward_dynamics_undoes_inverse_dynamics(robot in robot()) {
        let (tree, RandomState { q, v, a }) = robot.build();
        let force = inverse_dynamics(&tree, &q, &v, &a);
        let mut found = vec![f64::NAN; a.len()];
        tree.forward_dynamics(&q, &v, &force, &mut Workspace::new(&tree), &mut found).unwrap();
        // The mass matrix' condition number costs digits: compare where it does not enter.
        assert_close(&inverse_dynamics(&tree, &q, &v, &found), &force, 1e-9);
        assert_close(&found, &a, 1e-6);
    }

    #[test]
    fn gravity_is_the_gradient_of_potential_energy(robot in robot()) {
        let (tree, RandomState { q, v, .. }) = robot.build();
        let still = vec![0.0; v.len()];
        let gravity = inverse_dynamics(&tree, &q, &still, &still);
        let (first_v, first_q) = if tree.is_floating() { (6, 7) } else { (0, 0) };
        let gradient: Vec<f64> =
            (0..tree.joint_count()).map(|joint| potential_energy(&tree, &q, first_q + joint).derivative).collect();
        assert_close(&gravity[first_v..], &gradient, 1e-10);
    }

    #[test]
    fn mass_matrix_gives_the_bodies_kinetic_energy(robot in robot()) {
        let (tree, RandomState { q, v, .. }) = robot.build();
        let from_matrix = 0.5 * dot(&v, &times(&mass_matrix(&tree, &q), &v));
        assert_close(&[from_matrix], &[kinetic_energy(&tree, &q, &v)], 1e-11);
    }

    #[test]
    fn power_is_the_rate_of_energy(robot in robot()) {
        let (tree, RandomState { q, v, a }) = robot.build();
        let force = inverse_dynamics(&tree, &q, &v, &a);
        let energy = |time: f64| {
            let mut moved = q.clone();
            let halfway: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + 0.5 * time * a).collect();
            tree.integrate(&q, &halfway, time, &mut moved).unwrap();
            let velocity: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + time * a).collect();
            kinetic_energy(&tree, &moved, &velocity) + potential_energy(&tree, &moved, 0).value
        };
        let step = 1e-5;
        let rate = (energy(step) - energy(-step)) / (2.0 * step);
        let scale = force.iter().zip(&v).map(|(f, v)| (f * v).abs()).sum::<f64>();
        prop_assert!((dot(&force, &v) - rate).abs() < 1e-6 * scale.max(1.0), "{} {rate}", dot(&force, &v));
    }

    #[test]
    fn mass_matrix_is_symmetric(robot in robot()) {
        let (tree, state) = robot.build();
        let (matrix, size) = (mass_matrix(&tree, &state.q), tree.velocity_size());
        for row in 0..size {
            for column in 0..row {
                let (below, above) = (matrix[row * size + column], matrix[column * size + row]);
                prop_assert!((below - above).abs() <= 1e-13 * arbitrary::largest(&matrix), "{below} {above}");
            }
        }
    }
}

#[test]
fn sizes_that_do_not_match_are_named() {
    let tree = phiw_dynamics::random_tree::random_tree(1, &Default::default()).unwrap();
    let (nq, nv) = (tree.configuration_size(), tree.velocity_size());
    let mut workspace = Workspace::<f64>::new(&tree);
    let mut check = |q: usize, v: usize, a: usize, force: usize, expected: &str| {
        let (q, v, a, mut force) = (vec![0.0; q], vec![0.0; v], vec![0.0; a], vec![0.0; force]);
        let error = tree.inverse_dynamics(&q, &v, &a, &mut workspace, &mut force).unwrap_err();
        assert_eq!(error.to_string(), expected);
    };
    check(nq + 1, nv, nv, nv, "the configuration q has 11 elements, but this robot needs 10");
    check(nq, nv - 1, nv, nv, "the velocity v has 9 elements, but this robot needs 10");
    check(nq, nv, 0, nv, "the acceleration a has 0 elements, but this robot needs 10");
    check(nq, nv, nv, 2 * nv, "the generalised force has 20 elements, but this robot needs 10");
}
