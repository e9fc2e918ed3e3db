#![doc = include_str!("../README.md")]

pub mod body_kinematics;
pub mod contract;
pub mod dynamics;
pub mod standing;
pub mod step;

mod builder;
mod measured;
mod motion;
mod random_robots;
mod robots;

pub use builder::{Builder, analytic};
pub use measured::{Failure, Measured};
pub use random_robots::regressor_predicts_random_robots;
pub use robots::{Robot, robots, robots_in, standing_robot};

use body_kinematics::{
    body_joints_are_the_trees, body_motions_are_the_trees, floor_wrench_over_kinematics_is_the_base_wrench,
    regressor_over_kinematics_predicts_inverse_dynamics,
};
use contract::{
    inverse_dynamics_keeps_state, joints_are_the_trees, state_round_trip, wrong_motion_is_refused,
    wrong_step_is_refused,
};
use dynamics::{
    base_wrench_of_inverse_dynamics, forward_dynamics_undoes_inverse_dynamics,
    inverse_dynamics_is_the_analytic, mass_matrix_is_of_inverse_dynamics,
    regressor_predicts_inverse_dynamics,
};
use phiw_dynamics::{BodyKinematics, DynamicsBackend, Tree};

/// Everything about the robot's own equation that holds for any [`DynamicsBackend`]: the contract, then
/// inverse and forward dynamics at `states` random states.
///
/// # Errors
/// The first check that fails.
pub fn equation_of_motion<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Vec<Measured>, Failure> {
    Ok(vec![
        joints_are_the_trees(build, tree)?,
        wrong_motion_is_refused(build, tree)?,
        inverse_dynamics_is_the_analytic(build, tree, states)?,
        base_wrench_of_inverse_dynamics(build, tree, states.min(100))?,
        forward_dynamics_undoes_inverse_dynamics(build, tree, states)?,
        mass_matrix_is_of_inverse_dynamics(build, tree, states.min(100))?,
        regressor_predicts_inverse_dynamics(build, tree, 0, states.min(100))?,
    ])
}

/// What any [`SimulationBackend`](phiw_dynamics::SimulationBackend) promises about its state. Steps and
/// floors, whose accuracy is the backend's own, have checks of their own.
///
/// # Errors
/// The first check that fails.
pub fn state_of_a_simulation(build: &Builder, tree: &Tree, states: usize) -> Result<Vec<Measured>, Failure> {
    Ok(vec![
        state_round_trip(build, tree, states)?,
        wrong_step_is_refused(build, tree)?,
        inverse_dynamics_keeps_state(build, tree)?,
    ])
}

/// The regressor and the ZMP over a backend's own [`BodyKinematics`]: bodies and their motions are the
/// tree's, Φw = τ, and the floor's wrench is the base wrench, at `states` random states.
///
/// # Errors
/// The first check that fails.
pub fn kinematics_of_bodies<B>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Vec<Measured>, Failure>
where
    B: DynamicsBackend + BodyKinematics + ?Sized,
    Failure: From<B::Error>,
{
    Ok(vec![
        body_joints_are_the_trees(build, tree)?,
        body_motions_are_the_trees(build, tree, states)?,
        regressor_over_kinematics_predicts_inverse_dynamics(build, tree, 0, states)?,
        floor_wrench_over_kinematics_is_the_base_wrench(build, tree, states)?,
    ])
}
