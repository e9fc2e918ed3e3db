//! The contract of the traits apart from numbers: names, sizes, errors, and which calls change the state.

use crate::measured::{largest_difference, worse};
use crate::{Builder, Failure, Measured};
use phiw_dynamics::random_tree::{RandomNumbers, RandomState, random_state};
use phiw_dynamics::{BackendError, DynamicsBackend, SimulationBackend, Tree, World};

/// Joint names, their order, and the sizes of states are the tree's.
///
/// # Errors
/// What differs.
pub fn joints_are_the_trees<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
) -> Result<Measured, Failure> {
    let backend = build(tree, &World::default())?;
    let (found, expected) = (backend.joint_names(), tree.joint_names());
    if found.len() != expected.len() {
        return Err(Failure::Wrong(format!("{} joints, but the tree has {}", found.len(), expected.len())));
    }
    let misplaced = found.iter().zip(expected).filter(|(found, expected)| found != expected).count();
    let found = (backend.configuration_size(), backend.velocity_size());
    let sizes = (tree.configuration_size(), tree.velocity_size());
    if found != sizes {
        return Err(Failure::Wrong(format!(
            "configuration and velocity have {found:?} elements, the tree's have {sizes:?}"
        )));
    }
    Measured::check("joints with another name", misplaced as f64, 0.0, "")
}

/// What goes in with `set_state` comes out of `state`, up to rounding.
///
/// # Errors
/// The largest difference is above 1e-12.
pub fn state_round_trip(build: &Builder, tree: &Tree, states: usize) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let random = &mut RandomNumbers::new(1);
    let mut largest = 0.0;
    for _ in 0..states {
        let RandomState { q, v, .. } = random_state(tree, random);
        backend.set_state(&q, &v)?;
        let (found_q, found_v) = state_of(backend.as_ref())?;
        largest = worse(largest, configuration_difference(tree, &found_q, &q));
        largest = worse(largest, largest_difference(&found_v, &v));
    }
    Measured::check("state after set_state", largest, 1e-12, "")
}

/// `inverse_dynamics` and `forward_dynamics` leave the state as it is, to the bit.
///
/// # Errors
/// The state has changed.
pub fn inverse_dynamics_keeps_state(build: &Builder, tree: &Tree) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let random = &mut RandomNumbers::new(2);
    let (kept, other) = (random_state(tree, random), random_state(tree, random));
    backend.set_state(&kept.q, &kept.v)?;
    let before = state_of(backend.as_ref())?;
    let (mut force, mut acceleration) = (other.a.clone(), other.a.clone());
    backend.inverse_dynamics(&other.q, &other.v, &other.a, &mut force)?;
    backend.forward_dynamics(&other.q, &other.v, &force, &mut acceleration)?;
    let after = state_of(backend.as_ref())?;
    let change = worse(largest_difference(&after.0, &before.0), largest_difference(&after.1, &before.1));
    Measured::check("change of the state by inverse and forward dynamics", change, 0.0, "")
}

/// Motions and forces of the wrong length are the errors that [`DynamicsBackend`] names, and do not disturb
/// what comes after.
///
/// # Errors
/// What was accepted, or refused with another error.
pub fn wrong_motion_is_refused<B: DynamicsBackend + ?Sized>(
    build: &Builder<B>,
    tree: &Tree,
) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let RandomState { q, v, a } = random_state(tree, &mut RandomNumbers::new(3));
    let (longer, shorter) = (vec![0.0; v.len() + 1], &v[1..]);
    let (mut before, mut after) = (a.clone(), a.clone());
    backend.inverse_dynamics(&q, &v, &a, &mut before)?;
    let size = |error: &BackendError| matches!(error, BackendError::Dimension(_));
    let mut force = a.clone();
    expect("a configuration too short", backend.inverse_dynamics(&q[1..], &v, &a, &mut force), size)?;
    expect("an acceleration too short", backend.inverse_dynamics(&q, &v, shorter, &mut force), size)?;
    expect("room for too few forces", backend.inverse_dynamics(&q, &v, &a, &mut shorter.to_vec()), size)?;
    expect("a force too long", backend.forward_dynamics(&q, &v, &longer, &mut force), size)?;
    backend.inverse_dynamics(&q, &v, &a, &mut after)?;
    let change = largest_difference(&after, &before);
    Measured::check("change of inverse dynamics by what is refused", change, 0.0, "")
}

/// States of the wrong length, NaN, a quaternion that is not unit and a time step that is not positive are
/// the errors that [`SimulationBackend`] names, and change nothing.
///
/// # Errors
/// What was accepted, or refused with another error.
pub fn wrong_step_is_refused(build: &Builder, tree: &Tree) -> Result<Measured, Failure> {
    let mut backend = build(tree, &World::default())?;
    let RandomState { q, v, .. } = random_state(tree, &mut RandomNumbers::new(3));
    backend.set_state(&q, &v)?;
    let before = state_of(backend.as_ref())?;
    let torque = vec![0.0; tree.joint_count()];
    let longer = vec![0.0; v.len() + 1];
    let with_nan = |slice: &[f64]| {
        let mut broken = slice.to_vec();
        if let Some(last) = broken.last_mut() {
            *last = f64::NAN;
        }
        broken
    };

    let size = |error: &BackendError| matches!(error, BackendError::Dimension(_));
    let finite = |error: &BackendError| matches!(error, BackendError::NotFinite { .. });
    let time = |error: &BackendError| matches!(error, BackendError::TimeStep { .. });
    let quaternion = |error: &BackendError| matches!(error, BackendError::NotUnitQuaternion { .. });

    expect("a configuration too short", backend.set_state(&q[1..], &v), size)?;
    expect("a velocity too long", backend.set_state(&q, &longer), size)?;
    expect("a NaN position", backend.set_state(&with_nan(&q), &v), finite)?;
    expect("a NaN velocity", backend.set_state(&q, &with_nan(&v)), finite)?;
    expect("room for too few positions", backend.state(&mut q[1..].to_vec(), &mut v.clone()), size)?;
    expect("a torque too long", backend.step(&vec![0.0; torque.len() + 1], 1e-3), size)?;
    expect("a NaN torque", backend.step(&with_nan(&torque), 1e-3), finite)?;
    for dt in [0.0, -1e-3, f64::NAN, f64::INFINITY] {
        expect("a time step that is not positive and finite", backend.step(&torque, dt), time)?;
    }
    if tree.is_floating() {
        let mut stretched = q.clone();
        stretched[3..7].iter_mut().for_each(|x| *x *= 1.5);
        expect("a stretched quaternion", backend.set_state(&stretched, &v), quaternion)?;
    }
    let after = state_of(backend.as_ref())?;
    let change = worse(largest_difference(&after.0, &before.0), largest_difference(&after.1, &before.1));
    Measured::check("change of the state by what is refused", change, 0.0, "")
}

/// An error unless `what` was refused, and with the right error.
fn expect(
    what: &str,
    result: Result<(), BackendError>,
    right: fn(&BackendError) -> bool,
) -> Result<(), Failure> {
    match result {
        Err(error) if right(&error) => Ok(()),
        Err(error) => Err(Failure::Wrong(format!("{what} is refused with the wrong error: {error}"))),
        Ok(()) => Err(Failure::Wrong(format!("{what} is accepted"))),
    }
}

/// The backend's state.
pub(crate) fn state_of(backend: &dyn SimulationBackend) -> Result<(Vec<f64>, Vec<f64>), BackendError> {
    let (mut q, mut v) = (vec![0.0; backend.configuration_size()], vec![0.0; backend.velocity_size()]);
    backend.state(&mut q, &mut v)?;
    Ok((q, v))
}

/// Largest difference of the coordinates; a quaternion and its negative are one rotation.
fn configuration_difference(tree: &Tree, found: &[f64], expected: &[f64]) -> f64 {
    let mut found = found.to_vec();
    if tree.is_floating() {
        let cosine: f64 = found[3..7].iter().zip(&expected[3..7]).map(|(x, y)| x * y).sum();
        found[3..7].iter_mut().for_each(|x| *x *= cosine.signum());
    }
    largest_difference(&found, expected)
}
