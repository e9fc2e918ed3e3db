//! Jacobians are the derivatives of the kinematics; merging links changes nothing that can be felt.

use crate::arbitrary;

use arbitrary::{assert_close, inverse_dynamics, largest, options, robot, times};
use phiw_dynamics::random_tree::{
    RandomNumbers, RandomState, RandomTreeOptions, random_state, random_tree, random_urdf,
};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Placement, Tree, Vec3};
use proptest::prelude::*;

const STEP: f64 = 1e-6;

fn placements(tree: &Tree, q: &[f64]) -> Vec<Placement<f64>> {
    let mut placements = vec![Placement::identity(); tree.bodies().len()];
    tree.forward_kinematics(q, &mut placements).unwrap();
    placements
}

/// Central difference of a function of the configuration along the velocity.
fn rate<const N: usize>(tree: &Tree, q: &[f64], v: &[f64], value: impl Fn(&[f64]) -> [f64; N]) -> [f64; N] {
    let at = |time: f64| {
        let mut moved = q.to_vec();
        tree.integrate(q, v, time, &mut moved).unwrap();
        value(&moved)
    };
    let (after, before) = (at(STEP), at(-STEP));
    std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * STEP))
}

/// Rates in m/s or rad/s against central differences, which round to 1e-10 however slow the motion is.
fn assert_rate(found: &[f64], difference: &[f64]) {
    assert_eq!(found.len(), difference.len());
    let tolerance = 1e-7 * largest(difference).max(1.0);
    for (index, (x, y)) in found.iter().zip(difference).enumerate() {
        assert!((x - y).abs() <= tolerance, "element {index}: {x} instead of {y}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn point_jacobian_is_the_rate_of_the_placement(
        robot in robot(),
        which in any::<prop::sample::Index>(),
        point in prop::array::uniform3(-1.0..1.0),
    ) {
        let (tree, RandomState { q, v, .. }) = robot.build();
        let body = which.index(tree.bodies().len());
        let mut jacobian = vec![f64::NAN; 6 * tree.velocity_size()];
        let now = placements(&tree, &q);
        tree.point_jacobian(&now, body, Vec3(point), &mut jacobian).unwrap();
        let found = times(&jacobian, &v);
        let linear = rate(&tree, &q, &v, |q| placements(&tree, q)[body].point(Vec3(point)).0);
        assert_rate(&found[..3], &linear);
        // Ṙ = [ω]× R, so ω is in Ṙ Rᵀ.
        let turning = rate(&tree, &q, &v, |q| {
            let spin = (placements(&tree, q)[body].rotation * now[body].rotation.transpose()).0;
            [spin[2][1], spin[0][2], spin[1][0]]
        });
        assert_rate(&found[3..], &turning);
    }

    #[test]
    fn center_of_mass_jacobian_is_its_rate(robot in robot()) {
        let (tree, RandomState { q, v, .. }) = robot.build();
        let mut jacobian = vec![f64::NAN; 3 * tree.velocity_size()];
        tree.center_of_mass_jacobian(&placements(&tree, &q), &mut jacobian).unwrap();
        let expected = rate(&tree, &q, &v, |q| tree.center_of_mass(&placements(&tree, q)).unwrap().0);
        assert_rate(&times(&jacobian, &v), &expected);
    }

    /// A held joint feels like the same joint standing still there.
    #[test]
    fn held_joints_equal_joints_at_rest(seed in any::<u64>(), options in options(), held in any::<prop::sample::Index>()) {
        let whole = random_tree(seed, &options).unwrap();
        prop_assume!(!whole.has_mimic());
        let RandomState { mut q, mut v, mut a } = random_state(&whole, &mut RandomNumbers::new(seed));
        let joint = held.index(whole.joint_count());
        let (at_q, at_v) = if options.floating_base { (7 + joint, 6 + joint) } else { (joint, joint) };
        (v[at_v], a[at_v]) = (0.0, 0.0);
        let mut expected = inverse_dynamics(&whole, &q, &v, &a);
        let reading = UrdfOptions {
            floating_base: options.floating_base,
            held: vec![(whole.joint(joint).joint.clone(), q[at_q])],
            ..UrdfOptions::default()
        };
        let merged = read_urdf(&random_urdf(seed, &options), &reading).unwrap().tree;
        prop_assert_eq!(merged.joint_count(), whole.joint_count() - 1);
        expected.remove(at_v);
        q.remove(at_q);
        v.remove(at_v);
        a.remove(at_v);
        assert_close(&inverse_dynamics(&merged, &q, &v, &a), &expected, 1e-11);
    }
}

/// The body was reported as a slice: "the body index has 9 elements, but this robot needs 8".
#[test]
fn the_jacobian_of_a_body_that_is_not_there_names_its_index() {
    let tree = random_tree(3, &RandomTreeOptions::default()).unwrap();
    let (bodies, size) = (tree.bodies().len(), tree.velocity_size());
    let now = placements(&tree, &tree.neutral_configuration());
    let error = tree.point_jacobian(&now, bodies, Vec3::zero(), &mut vec![0.0; 6 * size]).unwrap_err();
    assert_eq!(
        error.to_string(),
        format!("body {bodies} does not exist: there are {bodies}, counted from 0")
    );
}
