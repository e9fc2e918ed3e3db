//! The conformance suite on MuJoCo.

use crate::setup;

use phiw_conformance as suite;
use phiw_conformance::{Failure, Measured};
use phiw_dynamics::{BackendError, SimulationBackend, Tree, World};
use phiw_sim_mujoco::{Integrator, MujocoBackend};

fn runge_kutta(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(MujocoBackend::new(tree, world)?))
}

fn implicit(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(MujocoBackend::new(tree, world)?.with_integrator(Integrator::Implicit)))
}

/// The backend as the type that it is, which has the motion of bodies too.
fn own_type(tree: &Tree, world: &World) -> Result<Box<MujocoBackend>, BackendError> {
    Ok(Box::new(MujocoBackend::new(tree, world)?))
}

/// Whether MuJoCo is there; says so where it is not.
fn is_there() -> bool {
    let (tree, _) = setup::robot(1, 1, false);
    setup::mujoco(&tree, &World::default()).is_some()
}

fn robots() -> impl Iterator<Item = suite::Robot> {
    suite::robots().unwrap().into_iter().filter(|robot| !robot.tree.has_mimic())
}

fn robot(name: &str) -> Tree {
    robots().find(|robot| robot.name == name).unwrap().tree
}

const ARMS: [&str; 4] =
    ["puma560, fixed base", "arm7, fixed base", "scara4, fixed base", "upper_body18, fixed base"];

#[track_caller]
fn check(what: &str, result: Result<Measured, Failure>) {
    match result {
        Ok(measured) => println!("{what}: {measured}"),
        Err(failure) => panic!("{what}: {failure}"),
    }
}

#[test]
fn equation_of_motion_of_all_robots() {
    if !is_there() {
        return;
    }
    for robot in robots() {
        println!("{}", robot.name);
        for group in [
            suite::equation_of_motion(&own_type, &robot.tree, 1000),
            suite::state_of_a_simulation(&runge_kutta, &robot.tree, 100),
        ] {
            match group {
                Ok(all) => all.iter().for_each(|measured| println!("  {measured}")),
                Err(failure) => panic!("{}: {failure}", robot.name),
            }
        }
        check("  rotors", suite::dynamics::rotor_inertia_is_part_of_the_mass(&runge_kutta, &robot.tree, 50));
        check("  step", suite::step::base_wrench_of_a_step(&runge_kutta, &robot.tree));
    }
}

/// The regressor and the ZMP over MuJoCo's own kinematics, and not ours, are those of its dynamics.
#[test]
fn regressor_and_zmp_over_the_engines_kinematics() {
    if !is_there() {
        return;
    }
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
    if is_there() {
        check("random robots", suite::regressor_predicts_random_robots(&own_type, false));
    }
}

#[test]
fn closed_loop_tracking() {
    if !is_there() {
        return;
    }
    for name in ARMS {
        let tree = robot(name);
        check(name, suite::step::tracking_difference(&runge_kutta, &suite::analytic, &tree, 1e-3, 1e-9));
        // This integrator is of order one.
        check(name, suite::step::tracking_difference(&implicit, &suite::analytic, &tree, 1e-3, 3e-3));
    }
}

#[test]
fn free_motion() {
    if !is_there() {
        return;
    }
    let tree = robot("upper_body18, fixed base");
    check("energy", suite::step::energy_drift(&runge_kutta, &tree, 1e-3, 1.0, 1e-5));
    check("energy, implicit", suite::step::energy_drift(&implicit, &tree, 1e-3, 1.0, 0.1));
    for robot in robots().filter(|robot| robot.tree.is_floating()) {
        check(&robot.name, suite::step::falls_freely(&runge_kutta, &robot.tree, 1e-3, 1e-6));
    }
}

#[test]
fn position_limits() {
    if !is_there() {
        return;
    }
    for name in ARMS {
        check(name, suite::step::position_limits_hold(&runge_kutta, &robot(name)));
        check(name, suite::step::position_limits_hold(&implicit, &robot(name)));
    }
}

#[test]
fn standing_on_the_floor() {
    if !is_there() {
        return;
    }
    let (tree, world) = suite::standing_robot().unwrap();
    for build in [&runge_kutta as &suite::Builder, &implicit] {
        check("rest", suite::standing::rests_on_its_feet(build, &tree, &world));
        check("ZMP", suite::standing::measured_zmp_is_the_momentums(build, &tree, &world));
        check("fast", suite::standing::fast_motion_topples(build, &tree, &world));
        check("slow", suite::standing::slow_motion_stands(build, &tree, &world));
    }
}
