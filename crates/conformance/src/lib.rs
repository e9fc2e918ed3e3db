#![doc = include_str!("../README.md")]

mod contract;
mod dynamics;
mod measured;
mod motion;
mod random_robots;
mod robots;
mod standing;
mod step;

pub use contract::{
    inverse_dynamics_keeps_state, joints_are_the_trees, state_round_trip, wrong_input_is_refused,
};
pub use dynamics::{
    base_wrench_of_inverse_dynamics, forward_dynamics_undoes_inverse_dynamics,
    inverse_dynamics_is_the_analytic, regressor_predicts_inverse_dynamics, rotor_inertia_is_part_of_the_mass,
};
pub use measured::{Failure, Measured};
pub use random_robots::regressor_predicts_random_robots;
pub use robots::{Robot, robots, robots_in, standing_robot};
pub use standing::{
    fast_motion_topples, measured_zmp_is_the_momentums, rests_on_its_feet, slow_motion_stands,
};
pub use step::{
    base_wrench_of_a_step, energy_drift, falls_freely, position_limits_hold, tracking_difference,
};

use phiw_dynamics::{AnalyticBackend, BackendError, DynamicsBackend, Tree, World};

/// What makes the backend under test: a robot in a world.
pub type Builder<'a> = dyn Fn(&Tree, &World) -> Result<Box<dyn DynamicsBackend>, BackendError> + 'a;

/// The builder of [`AnalyticBackend`], which knows no world with contacts.
///
/// # Errors
/// The world does not fit the robot, or has feet or position limits.
pub fn analytic(tree: &Tree, world: &World) -> Result<Box<dyn DynamicsBackend>, BackendError> {
    Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))
}

/// Everything about the robot's own equation that holds for any backend: the contract, then inverse and forward dynamics at
/// `states` random states. Steps and floors, whose accuracy is the backend's own, have checks of their own.
///
/// # Errors
/// The first check that fails.
pub fn equation_of_motion(build: &Builder, tree: &Tree, states: usize) -> Result<Vec<Measured>, Failure> {
    Ok(vec![
        joints_are_the_trees(build, tree)?,
        state_round_trip(build, tree, states.min(100))?,
        wrong_input_is_refused(build, tree)?,
        inverse_dynamics_keeps_state(build, tree)?,
        inverse_dynamics_is_the_analytic(build, tree, states)?,
        base_wrench_of_inverse_dynamics(build, tree, states.min(100))?,
        forward_dynamics_undoes_inverse_dynamics(build, tree, states)?,
        regressor_predicts_inverse_dynamics(build, tree, 0, states.min(100))?,
    ])
}
