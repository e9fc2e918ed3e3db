//! Feet that are not on the base.

use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{DynamicsBackend, Foot, SimulationBackend, Tree, World};
use phiw_sim_rapier::RapierBackend;

/// A trunk on one leg whose foot is behind an ankle; 12 kg, the sole 0.5 m below the trunk's frame.
fn robot_with_an_ankle() -> (Tree, World) {
    let urdf = r#"
      <robot name="one_leg">
        <link name="trunk"><inertial><origin xyz="0 0 0.1"/><mass value="10"/>
          <inertia ixx="0.2" ixy="0" ixz="0" iyy="0.2" iyz="0" izz="0.1"/></inertial></link>
        <link name="foot"><inertial><origin xyz="0 0 -0.02"/><mass value="2"/>
          <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>
        <joint name="ankle" type="revolute"><parent link="trunk"/><child link="foot"/><origin xyz="0 0 -0.45"/>
          <axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="100" velocity="5"/></joint>
      </robot>"#;
    let tree = read_urdf(urdf, &UrdfOptions { floating_base: true, ..Default::default() }).unwrap().tree;
    let sole = [(-0.1, -0.05), (0.1, -0.05), (0.1, 0.05), (-0.1, 0.05)].map(|(x, y)| [x, y, -0.05]).to_vec();
    (tree, World { feet: vec![Foot { body: 1, sole }], ..World::default() })
}

fn at_height(tree: &Tree, z: f64) -> Vec<f64> {
    let mut q = tree.neutral_configuration();
    q[2] = z;
    q
}

#[test]
fn foot_behind_an_ankle_carries_the_weight() {
    let (tree, world) = robot_with_an_ankle();
    let mut backend = RapierBackend::new(&tree, &world).unwrap();
    backend.set_state(&at_height(&tree, 0.5), &[0.0; 7]).unwrap();
    for _ in 0..50 {
        backend.step(&[0.0], 1e-3).unwrap();
    }
    let [_, _, force, ..] = backend.base_wrench();
    assert!((force / (12.0 * 9.81) - 1.0).abs() < 1e-2, "{force} N");
}

/// The shapes on children of the root stayed for one step where they had been before `set_state`.
#[test]
fn set_state_moves_the_shapes_of_children() {
    let (tree, world) = robot_with_an_ankle();
    let first_step_from_the_floor = |backend: &mut RapierBackend| {
        backend.set_state(&at_height(&tree, 0.5), &[0.0; 7]).unwrap();
        backend.step(&[0.0], 1e-3).unwrap();
        backend.base_wrench()[2]
    };
    let mut fresh = RapierBackend::new(&tree, &world).unwrap();
    let mut moved = RapierBackend::new(&tree, &world).unwrap();
    moved.set_state(&at_height(&tree, 3.0), &[0.0; 7]).unwrap();
    moved.step(&[0.0], 1e-3).unwrap();
    assert_eq!(moved.base_wrench(), [0.0; 6]);
    let (expected, found) = (first_step_from_the_floor(&mut fresh), first_step_from_the_floor(&mut moved));
    assert!(expected > 50.0, "{expected} N");
    assert!((found - expected).abs() < 1e-6 * expected, "{found} N, not {expected} N");
}

#[test]
fn without_friction_a_pushed_foot_slides() {
    let (tree, world) = robot_with_an_ankle();
    let slid = |floor_friction: f64| {
        let mut backend = RapierBackend::new(&tree, &World { floor_friction, ..world.clone() }).unwrap();
        backend.set_state(&at_height(&tree, 0.5), &[0.3, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]).unwrap();
        for _ in 0..20 {
            backend.step(&[0.0], 1e-3).unwrap();
        }
        let [push, ..] = backend.base_wrench();
        let (mut q, mut v) = (at_height(&tree, 0.0), vec![0.0; 7]);
        backend.state(&mut q, &mut v).unwrap();
        (q[0], push)
    };
    let (far, nothing) = slid(0.0);
    let (near, _) = slid(1.0);
    assert!((far - 0.006).abs() < 2e-4 && nothing.abs() < 1e-9, "{far} m, {nothing} N");
    assert!(near < 0.9 * far, "{near} m, {far} m without friction");
}
