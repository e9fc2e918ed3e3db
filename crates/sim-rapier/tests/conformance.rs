//! The conformance suite on Rapier.

use phiw_conformance as suite;
use phiw_conformance::{Builder, Failure, Measured};
use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
use phiw_dynamics::{BackendError, SimulationBackend, Tree, World};
use phiw_sim_rapier::RapierBackend;

fn rapier(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(RapierBackend::new(tree, world)?))
}

/// The backend as the type that it is, which has the motion of bodies too.
fn own_type(tree: &Tree, world: &World) -> Result<Box<RapierBackend>, BackendError> {
    Ok(Box::new(RapierBackend::new(tree, world)?))
}

fn with_iterations(
    iterations: usize,
) -> impl Fn(&Tree, &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    move |tree, world| Ok(Box::new(RapierBackend::new(tree, world)?.with_solver_iterations(iterations)?))
}

fn robots() -> Vec<suite::Robot> {
    suite::robots().unwrap()
}

fn robot(name: &str) -> Tree {
    robots().into_iter().find(|robot| robot.name == name).unwrap().tree
}

#[track_caller]
fn check(what: &str, result: Result<Measured, Failure>) {
    match result {
        Ok(measured) => println!("{what}: {measured}"),
        Err(failure) => panic!("{what}: {failure}"),
    }
}

#[test]
fn equation_of_motion_of_all_robots() {
    for robot in robots() {
        println!("{}", robot.name);
        for group in [
            suite::equation_of_motion(&own_type, &robot.tree, 1000),
            suite::state_of_a_simulation(&rapier, &robot.tree, 100),
        ] {
            match group {
                Ok(all) => all.iter().for_each(|measured| println!("  {measured}")),
                Err(failure) => panic!("{}: {failure}", robot.name),
            }
        }
        check("  rotors", suite::dynamics::rotor_inertia_is_part_of_the_mass(&rapier, &robot.tree, 50));
        check("  step", suite::step::base_wrench_of_a_step(&rapier, &robot.tree));
    }
}

/// The regressor and the ZMP over Rapier's own kinematics, and not ours, are those of its dynamics.
#[test]
fn regressor_and_zmp_over_the_engines_kinematics() {
    for robot in robots() {
        println!("{}", robot.name);
        match suite::kinematics_of_bodies(&own_type, &robot.tree, 200) {
            Ok(all) => all.iter().for_each(|measured| println!("  {measured}")),
            Err(failure) => panic!("{}: {failure}", robot.name),
        }
    }
}

#[test]
fn random_robots() {
    check("random robots", suite::regressor_predicts_random_robots(&own_type, true));
}

#[test]
fn closed_loop_tracking() {
    let build = with_iterations(16);
    for name in ["puma560, fixed base", "arm7, fixed base", "scara4, fixed base", "upper_body18, fixed base"]
    {
        let tree = robot(name);
        check(
            name,
            suite::step::tracking_difference(&build as &Builder, &suite::analytic, &tree, 1e-3, 1e-3),
        );
    }
}

#[test]
fn free_motion() {
    let tree = robot("upper_body18, fixed base");
    for iterations in [1, 4, 8, 16] {
        let build = with_iterations(iterations);
        check(&format!("{iterations} iterations"), suite::step::energy_drift(&build, &tree, 1e-3, 1.0, 0.2));
    }
    for robot in robots().iter().filter(|robot| robot.tree.is_floating()) {
        check(&robot.name, suite::step::falls_freely(&rapier, &robot.tree, 1e-3, 1e-2));
    }
}

#[test]
fn position_limits() {
    for name in ["puma560, fixed base", "arm7, fixed base", "scara4, fixed base", "upper_body18, fixed base"]
    {
        check(name, suite::step::position_limits_hold(&rapier, &robot(name)));
    }
}

#[test]
fn standing_on_the_floor() {
    let (tree, world) = suite::standing_robot().unwrap();
    check("rest", suite::standing::rests_on_its_feet(&rapier, &tree, &world));
    check("ZMP", suite::standing::measured_zmp_is_the_momentums(&rapier, &tree, &world));
    check("fast", suite::standing::fast_motion_topples(&rapier, &tree, &world));
    check("slow", suite::standing::slow_motion_stands(&rapier, &tree, &world));
}

/// The engine solves the couplings iteratively: with fewer iterations a leader with many followers strays.
#[test]
fn closed_loop_tracking_with_mimic_joints() {
    let build = with_iterations(16);
    for seed in 0..4 {
        let options = RandomTreeOptions { joints: 7, mimic: true, ..Default::default() };
        let tree = random_tree(seed, &options).unwrap();
        let result = suite::step::tracking_difference(&build, &suite::analytic, &tree, 1e-3, 1e-3);
        check(&format!("{} of {} joints lead", tree.joint_count(), tree.bodies().len()), result);
    }
}
