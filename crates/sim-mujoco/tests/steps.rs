//! Steps in time.

use crate::setup;

use phiw_dynamics::random_tree::RandomState;
use phiw_dynamics::{AnalyticBackend, BackendError, DynamicsBackend, SimulationBackend, World};
use phiw_sim_mujoco::Integrator;
use setup::{assert_close, energy, mujoco, robot, robots, state_of};

/// One step from a moving state under torques, and the wrench at its start, are the analytic backend's.
#[test]
fn a_runge_kutta_step_is_the_analytic_one() {
    for (tree, RandomState { q, v, .. }) in robots() {
        let Some(mut backend) = mujoco(&tree, &World::default()) else { return };
        let mut analytic = AnalyticBackend::new(tree.clone());
        let torque: Vec<f64> = (0..tree.joint_count()).map(|joint| 0.5 - 0.1 * joint as f64).collect();
        // MuJoCo's method is of lower order for a base that turns.
        let dt = if tree.is_floating() { 1e-4 } else { 1e-3 };
        for backend in [&mut backend as &mut dyn SimulationBackend, &mut analytic] {
            backend.set_state(&q, &v).unwrap();
            backend.step(&torque, dt).unwrap();
        }
        let (found, expected) = (state_of(&backend), state_of(&analytic));
        assert_close(&found.0, &expected.0, 1e-9);
        assert_close(&found.1, &expected.1, 1e-9);
        if tree.is_floating() {
            assert_eq!(backend.base_wrench(), [0.0; 6]);
        } else {
            assert_close(&backend.base_wrench(), &analytic.base_wrench(), 1e-9);
        }
    }
}

#[test]
fn a_free_swing_keeps_its_energy() {
    for (tree, RandomState { q, v, .. }) in robots() {
        let rotor_inertia = vec![0.05; tree.joint_count()];
        let world = World { rotor_inertia, ..World::default() };
        let Some(mut backend) = mujoco(&tree, &world) else { return };
        backend.set_state(&q, &v).unwrap();
        let before = energy(&mut backend, &tree, &q, &v);
        let torque = vec![0.0; tree.joint_count()];
        (0..1000).for_each(|_| backend.step(&torque, 2e-4).unwrap());
        let (q, v) = state_of(&backend);
        let after = energy(&mut backend, &tree, &q, &v);
        assert!((after - before).abs() < 1e-6 * before.abs().max(10.0), "{before} J, then {after} J");
    }
}

/// The implicit method is of order one: half the step, half the error, and the limit is the other method's.
#[test]
fn the_implicit_method_is_of_first_order() {
    for (tree, RandomState { q, v, .. }) in robots() {
        let torque = vec![0.0; tree.joint_count()];
        let swing = |integrator, steps: usize| {
            let mut backend = mujoco(&tree, &World::default())?.with_integrator(integrator);
            assert_eq!(backend.integrator(), integrator);
            backend.set_state(&q, &v).unwrap();
            (0..steps).for_each(|_| backend.step(&torque, 0.05 / steps as f64).unwrap());
            Some(state_of(&backend).0)
        };
        let Some(truth) = swing(Integrator::RungeKutta4, 2000) else { return };
        let error = |steps| {
            let found = swing(Integrator::Implicit, steps).unwrap();
            found.iter().zip(&truth).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt()
        };
        let order = (error(250) / error(500)).log2();
        assert!((0.9..1.1).contains(&order), "order {order}");
    }
}

#[test]
fn joints_stop_at_their_limits() {
    for (tree, RandomState { q, v, .. }) in robots() {
        let limits = |joint: usize| tree.joint(joint).limits;
        if (0..tree.joint_count()).all(|joint| limits(joint).upper.is_infinite()) {
            continue;
        }
        let first_joint = tree.configuration_size() - tree.joint_count();
        // How far joints go beyond their limits while the robot falls.
        let excess = |position_limits| {
            let mut backend = mujoco(&tree, &World { position_limits, ..World::default() })?;
            backend.set_state(&q, &v).unwrap();
            let mut largest = 0.0_f64;
            for _ in 0..1000 {
                backend.step(&vec![1.0; tree.joint_count()], 1e-3).unwrap();
                for (joint, x) in state_of(&backend).0[first_joint..].iter().enumerate() {
                    largest = largest.max(x - limits(joint).upper).max(limits(joint).lower - x);
                }
            }
            Some(largest)
        };
        let (Some(held), Some(free)) = (excess(true), excess(false)) else { return };
        assert!(free > 0.1, "nothing was tested: {free}");
        assert!(held < 0.02, "{held} beyond a limit");
    }
}

#[test]
fn what_diverges_is_an_error_and_changes_nothing() {
    for integrator in [Integrator::RungeKutta4, Integrator::Implicit] {
        let (tree, start) = robot(1, 6, true);
        let Some(backend) = mujoco(&tree, &World::default()) else { return };
        let mut backend = backend.with_integrator(integrator);
        backend.set_state(&start.q, &start.v).unwrap();
        assert_eq!(backend.step(&[1e300; 6], 0.01), Err(BackendError::Singular));
        assert_eq!(state_of(&backend), (start.q.clone(), start.v.clone()));
        assert_eq!(backend.base_wrench(), [0.0; 6]);
        // And the next step is as if nothing had been.
        backend.step(&[0.0; 6], 0.01).unwrap();
        let Some(fresh) = mujoco(&tree, &World::default()) else { return };
        let mut fresh = fresh.with_integrator(integrator);
        fresh.set_state(&start.q, &start.v).unwrap();
        fresh.step(&[0.0; 6], 0.01).unwrap();
        assert_eq!(state_of(&backend), state_of(&fresh));
    }
}
