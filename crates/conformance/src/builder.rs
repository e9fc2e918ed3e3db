//! How a check gets the backend under test.

use phiw_dynamics::{AnalyticBackend, BackendError, SimulationBackend, Tree, World};

/// What makes the backend under test: a robot in a world. `B` is the backend, or the trait of it that is
/// tested.
pub type Builder<'a, B = dyn SimulationBackend> = dyn Fn(&Tree, &World) -> Result<Box<B>, BackendError> + 'a;

/// The builder of [`AnalyticBackend`], which knows no world with contacts.
///
/// # Errors
/// The world does not fit the robot, or has feet or position limits.
pub fn analytic(tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))
}
