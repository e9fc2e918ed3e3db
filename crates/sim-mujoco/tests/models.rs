//! Which robots become models, and which do not.

use crate::setup;

use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{Tree, World, WorldError};
use phiw_sim_mujoco::{MujocoBackend, MujocoError};
use setup::{mujoco, robot, square_foot};

/// One joint with this name and these limits.
fn one_joint(name: &str, lower: f64, upper: f64) -> Tree {
    let urdf = format!(
        r#"<robot name="one"><link name="world"/><link name="rod"><inertial><mass value="1"/>
        <inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>
        <joint name="{name}" type="revolute"><parent link="world"/><child link="rod"/><axis xyz="0 1 0"/>
        <limit lower="{lower}" upper="{upper}" effort="1" velocity="1"/></joint></robot>"#
    );
    read_urdf(&urdf, &UrdfOptions::default()).unwrap().tree
}

fn check_refused(tree: &Tree, world: &World, expected: &str) {
    match MujocoBackend::new(tree, world) {
        Err(MujocoError::NotFound { .. }) => println!("skipped: MuJoCo not found, run cargo xtask mujoco"),
        Err(error) => {
            println!("{error}");
            assert!(error.to_string().contains(expected), "{error}");
        }
        Ok(_) => panic!("accepted, but should be refused: {expected}"),
    }
}

#[test]
fn a_joint_may_have_any_name() {
    for name in ["torso/joint_1", "&lt;a&gt; &amp; &quot;b&quot;", "関節", "world", "' '"] {
        let tree = one_joint(name, -1.0, 1.0);
        let world = World { position_limits: true, ..World::default() };
        if mujoco(&tree, &world).is_none() {
            return;
        }
    }
}

#[test]
fn followers_are_refused() {
    let options = RandomTreeOptions { mimic: true, ..RandomTreeOptions::default() };
    let tree = random_tree(3, &options).unwrap();
    let follower = tree.bodies().iter().find(|body| body.mimic).unwrap();
    check_refused(&tree, &World::default(), &follower.joint);
}

#[test]
fn a_joint_without_room_between_its_limits_is_refused_where_limits_count() {
    let tree = one_joint("stuck", 0.5, 0.5);
    mujoco(&tree, &World::default());
    check_refused(&tree, &World { position_limits: true, ..World::default() }, "stuck");
}

#[test]
fn a_first_moment_without_mass_is_refused() {
    let (mut tree, _) = robot(1, 2, false);
    let mut parameters = tree.inertial_parameters();
    parameters[10] = 0.0;
    tree.set_inertial_parameters(&parameters).unwrap();
    check_refused(&tree, &World::default(), &tree.bodies()[1].link);
}

#[test]
fn a_world_that_does_not_fit_is_refused() {
    let (tree, _) = robot(1, 2, false);
    let world = World { feet: vec![square_foot(0.1, [0.0; 3])], ..World::default() };
    let error = MujocoBackend::new(&tree, &world).unwrap_err();
    assert_eq!(error, MujocoError::World(WorldError::FeetOfFixedBase));
}

/// Robots are simulated on many threads, each on one.
#[test]
fn a_backend_can_move_to_another_thread() {
    let (tree, _) = robot(1, 2, true);
    let Some(backend) = mujoco(&tree, &World::default()) else { return };
    std::thread::spawn(move || drop(backend)).join().unwrap();
}
