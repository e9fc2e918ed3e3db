//! The suite on the analytic backend: what the suite asks for can be done, and the suite can tell when it is
//! not.

use phiw_conformance::dynamics::inverse_dynamics_is_the_analytic;
use phiw_conformance::step::{base_wrench_of_a_step, energy_drift, falls_freely, tracking_difference};
use phiw_conformance::{
    Failure, analytic, equation_of_motion, kinematics_of_bodies, regressor_predicts_random_robots, robots,
    state_of_a_simulation,
};
use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
use phiw_dynamics::{AnalyticBackend, BackendError, DynamicsBackend, Tree, World};

/// The builder of the backend as the type that it is, which has the motion of bodies too.
fn own_type(tree: &Tree, world: &World) -> Result<Box<AnalyticBackend>, BackendError> {
    Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))
}

#[test]
fn equation_of_motion_of_all_robots() {
    for robot in robots().unwrap() {
        println!("{}", robot.name);
        let groups = [
            equation_of_motion(&analytic, &robot.tree, 200),
            state_of_a_simulation(&analytic, &robot.tree, 100),
            kinematics_of_bodies(&own_type, &robot.tree, 100),
        ];
        for measured in groups.into_iter().flat_map(Result::unwrap) {
            println!("  {measured}");
        }
    }
}

#[test]
fn random_robots() {
    println!("{}", regressor_predicts_random_robots(&own_type, true).unwrap());
}

#[test]
fn steps() {
    let fixed = random_tree(2, &RandomTreeOptions { joints: 6, ..Default::default() }).unwrap();
    println!("{}", tracking_difference(&analytic, &analytic, &fixed, 1e-3, 0.0).unwrap());
    println!("{}", energy_drift(&analytic, &fixed, 5e-4, 0.5, 1e-6).unwrap());
    println!("{}", base_wrench_of_a_step(&analytic, &fixed).unwrap());
    let floating =
        random_tree(3, &RandomTreeOptions { joints: 6, floating_base: true, ..Default::default() }).unwrap();
    println!("{}", falls_freely(&analytic, &floating, 1e-3, 1e-6).unwrap());
    println!("{}", base_wrench_of_a_step(&analytic, &floating).unwrap());
}

/// A robot that is a thousandth of a percent too heavy.
#[test]
fn wrong_mass_is_noticed() {
    let heavier = |tree: &Tree, _: &World| -> Result<Box<dyn DynamicsBackend>, BackendError> {
        let mut tree = tree.clone();
        let parameters: Vec<f64> = tree.inertial_parameters().iter().map(|x| x * 1.00001).collect();
        tree.set_inertial_parameters(&parameters)?;
        Ok(Box::new(AnalyticBackend::new(tree)))
    };
    let tree = random_tree(1, &RandomTreeOptions::default()).unwrap();
    let failure = inverse_dynamics_is_the_analytic(&heavier, &tree, 10).unwrap_err();
    assert!(
        matches!(&failure, Failure::TooLarge(measured) if (measured.value - 1e-5).abs() < 1e-9),
        "{failure}"
    );
}
