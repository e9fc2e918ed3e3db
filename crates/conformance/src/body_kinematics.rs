//! The regressor and the ZMP over a backend's own kinematics: what they say must be what the backend's own
//! dynamics says.

use crate::dynamics::{over_states, predicted_force};
use crate::measured::{relative_difference, worse};
use crate::{Builder, Failure, Measured};
use phiw_dynamics::body_kinematics::{BodyMotion, MotionSubspace};
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::random_tree::RandomState;
use phiw_dynamics::{BodyKinematics, DynamicsBackend, Tree, World};
use phiw_regressor::JointTorqueRegressor;
use phiw_zmp::{BalanceRows, ZmpWorkspace, standing_parameters};

/// Largest relative difference between what comes from a backend's kinematics and what it should be.
const AGREEMENT: f64 = 1e-9;

/// Parents, coordinates and axes of all bodies are the tree's.
///
/// # Errors
/// What differs; or an axis is off by more than 1e-9.
pub fn body_joints_are_the_trees<B>(build: &Builder<B>, tree: &Tree) -> Result<Measured, Failure>
where
    B: BodyKinematics + ?Sized,
{
    let backend = build(tree, &World::default())?;
    let (found, expected) = (backend.body_count(), tree.bodies().len());
    if found != expected {
        return Err(Failure::Wrong(format!("{found} bodies, but the tree has {expected}")));
    }
    let mut largest = 0.0;
    for (index, body) in tree.bodies().iter().enumerate() {
        let found = backend.body_joint(index);
        let expected = BodyKinematics::<f64>::body_joint(&tree, index);
        let difference = match (found.motion_subspace, expected.motion_subspace) {
            (MotionSubspace::Axis(found), MotionSubspace::Axis(expected)) => {
                let (linear, angular) = (found.linear - expected.linear, found.angular - expected.angular);
                linear.dot(linear).max(angular.dot(angular)).sqrt()
            }
            (found, expected) if found == expected => 0.0,
            _ => f64::NAN,
        };
        let right = found.parent == expected.parent
            && found.velocity_index == expected.velocity_index
            && difference.is_finite();
        if !right {
            return Err(Failure::Wrong(format!(
                "the joint before {} is {found:?}, not {expected:?}",
                body.link
            )));
        }
        largest = worse(largest, difference);
    }
    Measured::check("axes of joints against the tree's", largest, AGREEMENT, "")
}

/// The motion of every body at random states is that of [`Tree`]: its placement in its parent, velocity and
/// acceleration.
///
/// # Errors
/// The largest difference, over the largest number of its kind over all bodies, is above 1e-9.
pub fn body_motions_are_the_trees<B>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure>
where
    B: BodyKinematics + ?Sized,
    Failure: From<B::Error>,
{
    let mut backend = build(tree, &World::default())?;
    let bodies = tree.bodies().len();
    let (mut found, mut expected) = (vec![BodyMotion::rest(); bodies], vec![BodyMotion::rest(); bodies]);
    let largest = over_states(tree, states, 11, |RandomState { q, v, a }| {
        backend.body_motions(q, v, a, &mut found)?;
        tree.body_motions(q, v, a, &mut expected);
        let (found, expected) = (numbers_by_kind(&found), numbers_by_kind(&expected));
        Ok(found
            .iter()
            .zip(&expected)
            .fold(0.0, |largest, (found, expected)| worse(largest, relative_difference(found, expected))))
    })?;
    Measured::check("motions of bodies against the tree's", largest, AGREEMENT, "")
}

/// The numbers of all motions: rotations, translations, angular velocities, angular and linear accelerations.
fn numbers_by_kind(motions: &[BodyMotion<f64>]) -> [Vec<f64>; 5] {
    let mut kinds: [Vec<f64>; 5] = Default::default();
    for motion in motions {
        kinds[0].extend(motion.placement.rotation.0.as_flattened());
        kinds[1].extend(motion.placement.translation.0);
        kinds[2].extend(motion.angular_velocity.0);
        kinds[3].extend(motion.angular_acceleration.0);
        kinds[4].extend(motion.proper_acceleration.0);
    }
    kinds
}

/// Φw = τ over the backend's own kinematics: the joint torque regressor of the motion that the backend
/// computes, times the tree's parameters, is the backend's own inverse dynamics.
///
/// # Errors
/// The largest difference, over the largest force of its state, is above 1e-9.
pub fn regressor_over_kinematics_predicts_inverse_dynamics<B>(
    build: &Builder<B>,
    tree: &Tree,
    seed: u64,
    states: usize,
) -> Result<Measured, Failure>
where
    B: DynamicsBackend + BodyKinematics + ?Sized,
    Failure: From<B::Error>,
{
    let mut backend = build(tree, &World::default())?;
    let regressor = JointTorqueRegressor::new(&mut *backend);
    let (mut scratch, mut pairs) = (regressor.scratch(), vec![0.0; regressor.buffer_size()]);
    let parameters = tree.inertial_parameters();
    let largest = over_states(tree, states, seed, |RandomState { q, v, a }| {
        let mut force = vec![0.0; v.len()];
        backend.inverse_dynamics(q, v, a, &mut force)?;
        regressor.compute(&mut *backend, q, v, a, &mut scratch, &mut pairs)?;
        Ok(relative_difference(&predicted_force(&regressor, &pairs, &parameters)?, &force))
    })?;
    Measured::check("Φw over the backend's kinematics against inverse dynamics", largest, AGREEMENT, "")
}

/// The wrench that the ZMP comes from, over the backend's own kinematics: summed over the bodies, and as the
/// linear map of the parameters, it is the backend's own base wrench.
///
/// # Errors
/// The largest difference, over the largest component of its state, is above 1e-9.
pub fn floor_wrench_over_kinematics_is_the_base_wrench<B>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure>
where
    B: DynamicsBackend + BodyKinematics + ?Sized,
    Failure: From<B::Error>,
{
    let mut backend = build(tree, &World::default())?;
    let mut workspace = ZmpWorkspace::new(&mut *backend);
    let mut rows = BalanceRows::new(&mut *backend);
    let bodies = tree.inertial_parameters();
    // The root link of a fixed base is not part of the robot's dynamics.
    let parameters =
        if tree.is_floating() { bodies } else { standing_parameters(&[0.0; PARAMETERS_PER_BODY], &bodies) };
    let largest = over_states(tree, states, 12, |RandomState { q, v, a }| {
        let mut force = vec![0.0; v.len()];
        backend.inverse_dynamics(q, v, a, &mut force)?;
        let expected = backend.base_wrench();
        let summed = workspace.evaluate(&mut *backend, &parameters, q, v, a)?;
        rows.compute(&mut *backend, q, v, a, &mut workspace)?;
        let mapped = rows.balance(&parameters)?;
        Ok(worse(
            relative_difference(&summed.wrench, &expected),
            relative_difference(&mapped.wrench, &expected),
        ))
    })?;
    Measured::check("the floor's wrench over the backend's kinematics", largest, AGREEMENT, "")
}
