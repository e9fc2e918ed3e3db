//! The robot's own equation M(q)·a + h(q, v) = force against the analytic one.

use crate::measured::{relative_difference, worse};
use crate::{Builder, Failure, Measured};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
use phiw_dynamics::{AnalyticBackend, DimensionError, DynamicsBackend, Tree, World};
use phiw_regressor::JointTorqueRegressor;

/// Largest difference between two ways to compute the same force or acceleration, relative to its largest
/// element.
const AGREEMENT: f64 = 1e-8;

/// Inverse dynamics at random states inside the joint limits is that of [`AnalyticBackend`].
///
/// # Errors
/// The largest difference, over the largest force of its state, is above 1e-8.
pub fn inverse_dynamics_is_the_analytic<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let mut analytic = AnalyticBackend::new(tree.clone());
    let largest = over_states(tree, states, 4, |RandomState { q, v, a }| {
        let (mut found, mut expected) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        backend.inverse_dynamics(q, v, a, &mut found)?;
        analytic.inverse_dynamics(q, v, a, &mut expected)?;
        Ok(relative_difference(&found, &expected))
    })?;
    Measured::check("inverse dynamics against the analytic", largest, AGREEMENT, "")
}

/// The base wrench after `inverse_dynamics` is that of [`AnalyticBackend`].
///
/// # Errors
/// The largest difference, over the largest component, is above 1e-8.
pub fn base_wrench_of_inverse_dynamics<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let mut analytic = AnalyticBackend::new(tree.clone());
    let largest = over_states(tree, states, 5, |RandomState { q, v, a }| {
        let mut force = vec![0.0; v.len()];
        backend.inverse_dynamics(q, v, a, &mut force)?;
        analytic.inverse_dynamics(q, v, a, &mut force)?;
        Ok(relative_difference(&backend.base_wrench(), &analytic.base_wrench()))
    })?;
    Measured::check("base wrench of inverse dynamics", largest, AGREEMENT, "")
}

/// Forward dynamics under the force that inverse dynamics names gives back the acceleration.
///
/// # Errors
/// The largest difference, over the largest acceleration of its state, is above 1e-8.
pub fn forward_dynamics_undoes_inverse_dynamics<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let largest = over_states(tree, states, 6, |RandomState { q, v, a }| {
        let (mut force, mut found) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        backend.inverse_dynamics(q, v, a, &mut force)?;
        backend.forward_dynamics(q, v, &force, &mut found)?;
        Ok(relative_difference(&found, a))
    })?;
    Measured::check("acceleration after inverse and forward dynamics", largest, AGREEMENT, "")
}

/// The mass matrix times an acceleration is what inverse dynamics asks for beside gravity, with rotors.
///
/// # Errors
/// The largest difference, over the largest force of its state, is above 1e-8.
pub fn mass_matrix_is_of_inverse_dynamics<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure> {
    let world = World { rotor_inertia: vec![0.7; tree.joint_count()], ..World::default() };
    let mut backend = build(tree, &world)?;
    let size = tree.velocity_size();
    let still = vec![0.0; size];
    let (mut matrix, mut bias) = (vec![0.0; size * size], still.clone());
    let largest = over_states(tree, states, 8, |RandomState { q, a, .. }| {
        let mut force = vec![0.0; size];
        backend.inverse_dynamics(q, &still, &still, &mut bias)?;
        backend.inverse_dynamics(q, &still, a, &mut force)?;
        backend.mass_matrix(q, &mut matrix)?;
        let times = |row: &[f64]| row.iter().zip(a).map(|(mass, a)| mass * a).sum::<f64>();
        let told: Vec<f64> =
            matrix.chunks_exact(size).zip(&bias).map(|(row, bias)| times(row) + bias).collect();
        Ok(relative_difference(&told, &force))
    })?;
    Measured::check("mass matrix against inverse dynamics", largest, AGREEMENT, "")
}

/// Φw = τ: the joint torque regressor times the tree's parameters is the backend's own inverse dynamics.
///
/// # Errors
/// The largest difference, over the largest force of its state, is above 1e-8.
pub fn regressor_predicts_inverse_dynamics<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    seed: u64,
    states: usize,
) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let regressor = JointTorqueRegressor::new(tree);
    let (mut scratch, mut pairs) = (regressor.scratch::<f64>(), vec![0.0; regressor.buffer_size()]);
    let parameters = tree.inertial_parameters();
    let largest = over_states(tree, states, seed, |RandomState { q, v, a }| {
        let mut force = vec![0.0; v.len()];
        backend.inverse_dynamics(q, v, a, &mut force)?;
        regressor.compute(tree, q, v, a, &mut scratch, &mut pairs)?;
        Ok(relative_difference(&predicted_force(&regressor, &pairs, &parameters)?, &force))
    })?;
    Measured::check("Φw against inverse dynamics", largest, AGREEMENT, "")
}

/// Φw of a regressor's pairs.
pub(crate) fn predicted_force(
    regressor: &JointTorqueRegressor,
    pairs: &[f64],
    parameters: &[f64],
) -> Result<Vec<f64>, DimensionError> {
    let mut dense = vec![0.0; regressor.rows() * regressor.columns()];
    regressor.scatter(pairs, &mut dense)?;
    let rows = dense.chunks_exact(parameters.len());
    Ok(rows.map(|row| row.iter().zip(parameters).map(|(x, w)| x * w).sum()).collect())
}

/// A rotor's inertia stands on the diagonal of the mass matrix, in inverse and in forward dynamics, and gives
/// the base no wrench.
///
/// # Errors
/// The largest difference, over the largest force or acceleration of its state, is above 1e-8.
pub fn rotor_inertia_is_part_of_the_mass<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
    states: usize,
) -> Result<Measured, Failure> {
    let rotor_inertia: Vec<f64> = (0..tree.joint_count()).map(|joint| 0.1 + 0.05 * joint as f64).collect();
    let world = World { rotor_inertia: rotor_inertia.clone(), ..World::default() };
    let mut backend = build(tree, &world)?;
    let mut analytic = AnalyticBackend::new(tree.clone());
    let first_joint = tree.velocity_size() - tree.joint_count();
    let largest = over_states(tree, states, 7, |RandomState { q, v, a }| {
        let (mut found, mut expected) = (vec![0.0; v.len()], vec![0.0; v.len()]);
        backend.inverse_dynamics(q, v, a, &mut found)?;
        analytic.inverse_dynamics(q, v, a, &mut expected)?;
        for (joint, inertia) in rotor_inertia.iter().enumerate() {
            expected[first_joint + joint] += inertia * a[first_joint + joint];
        }
        let mut acceleration = vec![0.0; v.len()];
        backend.forward_dynamics(q, v, &expected, &mut acceleration)?;
        let wrench = relative_difference(&backend.base_wrench(), &analytic.base_wrench());
        Ok(worse(
            worse(relative_difference(&found, &expected), relative_difference(&acceleration, a)),
            wrench,
        ))
    })?;
    Measured::check("dynamics with rotors", largest, AGREEMENT, "")
}

/// The worst of what `measure` says of `states` random states.
pub(crate) fn over_states(
    tree: &Tree,
    states: usize,
    seed: u64,
    mut measure: impl FnMut(&RandomState) -> Result<f64, Failure>,
) -> Result<f64, Failure> {
    let random = &mut RandomNumbers::new(seed);
    (0..states).try_fold(0.0, |largest, _| Ok(worse(largest, measure(&random_state(tree, random))?)))
}
