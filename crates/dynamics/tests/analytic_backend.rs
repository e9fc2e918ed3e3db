//! The analytic backend moves robots as mechanics says.

use crate::arbitrary;

use arbitrary::{assert_close, dot, mass_matrix, times};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree};
use phiw_dynamics::{
    AnalyticBackend, BackendError, DynamicsBackend, Foot, Placement, SimulationBackend, Tree, World,
    WorldError,
};

fn robot(seed: u64, options: RandomTreeOptions) -> (Tree, RandomState) {
    let tree = random_tree(seed, &options).unwrap();
    let mut state = random_state(&tree, &mut RandomNumbers::new(seed));
    state.v.iter_mut().for_each(|v| *v *= 0.5);
    (tree, state)
}

fn energy(tree: &Tree, q: &[f64], v: &[f64]) -> f64 {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements).unwrap();
    let height = tree.center_of_mass(&placements).unwrap().0[2];
    0.5 * dot(v, &times(&mass_matrix(tree, q), v)) - tree.mass() * tree.gravity[2] * height
}

/// The state after `duration` of free swing in `steps` steps.
fn swing(tree: &Tree, start: &RandomState, duration: f64, steps: usize) -> (Vec<f64>, Vec<f64>) {
    let mut backend = AnalyticBackend::new(tree.clone());
    backend.set_state(&start.q, &start.v).unwrap();
    let torque = vec![0.0; tree.joint_count()];
    for _ in 0..steps {
        backend.step(&torque, duration / steps as f64).unwrap();
    }
    let (mut q, mut v) = (start.q.clone(), start.v.clone());
    backend.state(&mut q, &mut v).unwrap();
    (q, v)
}

fn kinds() -> impl Iterator<Item = RandomTreeOptions> {
    [(false, false), (true, false), (false, true), (true, true)].into_iter().map(|(floating_base, mimic)| {
        RandomTreeOptions { joints: 5, floating_base, mimic, fixed_links: true }
    })
}

#[test]
fn free_swing_keeps_energy() {
    for (seed, options) in kinds().enumerate() {
        let (tree, start) = robot(seed as u64, options);
        let before = energy(&tree, &start.q, &start.v);
        let (q, v) = swing(&tree, &start, 0.5, 2000);
        let kinetic = 0.5 * dot(&v, &times(&mass_matrix(&tree, &q), &v));
        let after = energy(&tree, &q, &v);
        assert!((after - before).abs() < 1e-7 * kinetic.max(1.0), "{options:?}: {before} J, then {after} J");
    }
}

#[test]
fn steps_are_of_fourth_order() {
    for (seed, options) in kinds().enumerate() {
        let (tree, start) = robot(seed as u64, options);
        let (truth, _) = swing(&tree, &start, 0.1, 1600);
        let error = |steps| {
            let (q, _) = swing(&tree, &start, 0.1, steps);
            q.iter().zip(&truth).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt()
        };
        let order = (error(50) / error(100)).log2();
        assert!((3.6..4.5).contains(&order), "{options:?}: order {order}");
    }
}

#[test]
fn floating_robot_falls_like_a_stone() {
    let (tree, start) = robot(3, RandomTreeOptions { joints: 8, floating_base: true, ..Default::default() });
    let center = |q: &[f64]| {
        let mut placements = vec![Placement::identity(); tree.bodies().len()];
        tree.forward_kinematics(q, &mut placements).unwrap();
        let mut jacobian = vec![0.0; 3 * tree.velocity_size()];
        tree.center_of_mass_jacobian(&placements, &mut jacobian).unwrap();
        (tree.center_of_mass(&placements).unwrap().0, jacobian)
    };
    let ([x, y, z], jacobian) = center(&start.q);
    let velocity = times(&jacobian, &start.v);
    let time = 0.4;
    let (q, _) = swing(&tree, &start, time, 400);
    let expected =
        [x + velocity[0] * time, y + velocity[1] * time, z + velocity[2] * time - 0.5 * 9.81 * time * time];
    assert_close(&center(&q).0, &expected, 1e-7);
    let norm: f64 = q[3..7].iter().map(|x| x * x).sum();
    assert!((norm - 1.0).abs() < 1e-14);
}

#[test]
fn forward_dynamics_undoes_inverse_dynamics() {
    for (seed, options) in kinds().enumerate() {
        let (tree, RandomState { q, v, a }) = robot(seed as u64, options);
        let mut backend = AnalyticBackend::new(tree);
        let (mut force, mut found) = (a.clone(), a.clone());
        backend.inverse_dynamics(&q, &v, &a, &mut force).unwrap();
        backend.forward_dynamics(&q, &v, &force, &mut found).unwrap();
        assert_close(&found, &a, 1e-8);
    }
}

/// Force = rate of the momentum less weight; moment about the origin = rate of the angular momentum less the
/// weight's.
#[test]
fn base_wrench_is_newtons() {
    for (seed, options) in kinds().enumerate() {
        let (tree, RandomState { q, v, a }) = robot(seed as u64, options);
        let momentum = |time: f64| -> Vec<f64> {
            let mut moved = q.clone();
            let halfway: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + 0.5 * time * a).collect();
            tree.integrate(&q, &halfway, time, &mut moved).unwrap();
            let velocity: Vec<f64> = v.iter().zip(&a).map(|(v, a)| v + time * a).collect();
            momentum_about_origin(&tree, &moved, &velocity)
        };
        let step = 1e-5;
        let mut expected: Vec<f64> =
            momentum(step).iter().zip(momentum(-step)).map(|(x, y)| (x - y) / (2.0 * step)).collect();
        let mut placements = vec![Placement::identity(); tree.bodies().len()];
        tree.forward_kinematics(&q, &mut placements).unwrap();
        let [x, y, _] = tree.center_of_mass(&placements).unwrap().0;
        let weight = tree.mass() * 9.81;
        expected[2] += weight;
        expected[3] += y * weight;
        expected[4] -= x * weight;

        let mut backend = AnalyticBackend::new(tree.clone());
        let mut force = vec![0.0; v.len()];
        backend.inverse_dynamics(&q, &v, &a, &mut force).unwrap();
        assert_close(&backend.base_wrench(), &expected, 1e-6);

        // A step reports the wrench of the motion at its start.
        backend.set_state(&q, &v).unwrap();
        let torque = vec![0.3; tree.joint_count()];
        backend.step(&torque, 1e-3).unwrap();
        let after_step = backend.base_wrench();
        let mut push = vec![0.0; v.len() - torque.len()];
        push.extend(&torque);
        let mut acceleration = vec![0.0; v.len()];
        backend.forward_dynamics(&q, &v, &push, &mut acceleration).unwrap();
        backend.inverse_dynamics(&q, &v, &acceleration, &mut force).unwrap();
        assert_eq!(after_step, backend.base_wrench());
        if tree.is_floating() {
            assert!(arbitrary::largest(&after_step) < 1e-8 * weight, "nothing holds it: {after_step:?}");
        }
    }
}

/// Linear momentum, and angular momentum about the world's origin.
fn momentum_about_origin(tree: &Tree, q: &[f64], v: &[f64]) -> Vec<f64> {
    use phiw_dynamics::inertia::Inertia;
    use phiw_dynamics::{Spatial, Vec3};
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements).unwrap();
    let mut jacobian = vec![0.0; 6 * tree.velocity_size()];
    let mut total = Spatial::zero();
    for (index, body) in tree.bodies().iter().enumerate() {
        // The point of the body that passes the world's origin.
        let origin = placements[index].inverse().point(Vec3::zero());
        tree.point_jacobian(&placements, index, origin, &mut jacobian).unwrap();
        let [x, y, z, rx, ry, rz] = times(&jacobian, v)[..].try_into().unwrap();
        let velocity = Spatial { linear: Vec3([x, y, z]), angular: Vec3([rx, ry, rz]) };
        total = total + Inertia::from_parameters(&body.inertial).moved(placements[index]).times(velocity);
    }
    [total.linear.0, total.angular.0].concat()
}

#[test]
fn wrong_input_is_refused_and_changes_nothing() {
    let (tree, start) = robot(1, RandomTreeOptions { floating_base: true, ..Default::default() });
    let joints = tree.joint_count();
    let mut backend = AnalyticBackend::new(tree);
    backend.set_state(&start.q, &start.v).unwrap();

    let mut long = start.q.clone();
    long[6] += 0.5;
    assert!(matches!(backend.set_state(&long, &start.v), Err(BackendError::NotUnitQuaternion { .. })));
    assert!(matches!(backend.set_state(&start.q[1..], &start.v), Err(BackendError::Dimension(_))));
    let mut broken = start.v.clone();
    broken[2] = f64::NAN;
    assert_eq!(backend.set_state(&start.q, &broken), Err(BackendError::NotFinite { what: "the velocity v" }));
    assert!(matches!(backend.step(&vec![0.0; joints + 1], 0.01), Err(BackendError::Dimension(_))));
    assert_eq!(backend.step(&vec![0.0; joints], 0.0), Err(BackendError::TimeStep { dt: 0.0 }));
    assert_eq!(backend.step(&vec![1e300; joints], 0.01), Err(BackendError::Singular));

    let (mut q, mut v) = (start.q.clone(), start.v.clone());
    backend.state(&mut q, &mut v).unwrap();
    assert_eq!((q, v), (start.q, start.v));
    assert_eq!(backend.base_wrench(), [0.0; 6]);
}

/// `(M + diag rotor)·a + h`, from the mass matrix and inverse dynamics without rotors.
#[test]
fn rotors_add_to_the_diagonal() {
    for (seed, options) in kinds().enumerate() {
        let (tree, RandomState { q, v, a }) = robot(seed as u64, options);
        let mut random = RandomNumbers::new(seed as u64 + 100);
        let rotor_inertia: Vec<f64> = (0..tree.joint_count()).map(|_| random.uniform(0.0, 0.3)).collect();
        let world = World { rotor_inertia: rotor_inertia.clone(), ..World::default() };
        let mut backend = AnalyticBackend::in_world(tree.clone(), &world).unwrap();
        let (mut force, mut bare, mut found) = (a.clone(), a.clone(), a.clone());
        backend.inverse_dynamics(&q, &v, &a, &mut force).unwrap();
        AnalyticBackend::new(tree.clone()).inverse_dynamics(&q, &v, &a, &mut bare).unwrap();
        let first_joint = tree.velocity_size() - tree.joint_count();
        for (joint, inertia) in rotor_inertia.iter().enumerate() {
            bare[first_joint + joint] += inertia * a[first_joint + joint];
        }
        assert_close(&force, &bare, 1e-12);
        backend.forward_dynamics(&q, &v, &force, &mut found).unwrap();
        assert_close(&found, &a, 1e-8);
    }
}

#[test]
fn rotors_store_energy_of_their_own() {
    let (tree, start) = robot(1, RandomTreeOptions { joints: 5, ..Default::default() });
    let rotor_inertia = vec![0.2; tree.joint_count()];
    let world = World { rotor_inertia: rotor_inertia.clone(), ..World::default() };
    let mut backend = AnalyticBackend::in_world(tree.clone(), &world).unwrap();
    let total = |q: &[f64], v: &[f64]| energy(&tree, q, v) + 0.1 * dot(v, v);
    backend.set_state(&start.q, &start.v).unwrap();
    for _ in 0..1000 {
        backend.step(&vec![0.0; tree.joint_count()], 5e-4).unwrap();
    }
    let (mut q, mut v) = (start.q.clone(), start.v.clone());
    backend.state(&mut q, &mut v).unwrap();
    let (before, after) = (total(&start.q, &start.v), total(&q, &v));
    assert!((after - before).abs() < 1e-6 * before.abs().max(1.0), "{before} J, then {after} J");
}

#[test]
fn a_world_with_contacts_is_refused() {
    let (tree, _) = robot(1, RandomTreeOptions { joints: 3, floating_base: true, ..Default::default() });
    let foot = Foot { body: 0, sole: vec![[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0]] };
    let check = |world: World, expected: &str| {
        let error = AnalyticBackend::in_world(tree.clone(), &world).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    };
    check(World { feet: vec![foot], ..World::default() }, "feet");
    check(World { position_limits: true, ..World::default() }, "position limits");
    check(World { rotor_inertia: vec![1.0], ..World::default() }, "rotor inertias");
    let negative = World { rotor_inertia: vec![-1.0; 3], ..World::default() };
    assert!(matches!(
        AnalyticBackend::in_world(tree.clone(), &negative),
        Err(BackendError::World(WorldError::RotorInertia { .. }))
    ));
}
