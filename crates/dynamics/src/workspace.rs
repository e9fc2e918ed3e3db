//! Preallocated scratch of the dynamics algorithms.

use crate::articulated_body::ArticulatedBody;
use crate::check::check_size;
use crate::inertia::Inertia;
use crate::motion::BodyMotion;
use crate::scalar::Scalar;
use crate::{DimensionError, Placement, Spatial, Tree};

/// Scratch memory for the algorithms of a [`Tree`]: make it once per thread, reuse it for every sample.
///
/// What is in it between calls is nobody's business; any call may overwrite any of it.
#[derive(Clone, Debug)]
pub struct Workspace<T> {
    pub(crate) motions: Vec<BodyMotion<T>>,
    pub(crate) forces: Vec<Spatial<T>>,
    pub(crate) placements: Vec<Placement<T>>,
    pub(crate) composites: Vec<Inertia<T>>,
    pub(crate) articulated: Vec<ArticulatedBody<T>>,
    /// `velocity_size`² elements: the mass matrix where forward dynamics has to solve it.
    pub(crate) matrix: Vec<T>,
    /// `velocity_size` elements.
    pub(crate) vector: Vec<T>,
}

impl<T: Scalar> Workspace<T> {
    /// Scratch for `tree`.
    pub fn new(tree: &Tree) -> Self {
        let (bodies, coordinates) = (tree.bodies.len(), tree.velocity_size);
        Workspace {
            motions: vec![BodyMotion::rest(); bodies],
            forces: vec![Spatial::zero(); bodies],
            placements: vec![Placement::identity(); bodies],
            composites: vec![Inertia::zero(); bodies],
            articulated: vec![ArticulatedBody::default(); bodies],
            matrix: vec![T::zero(); coordinates * coordinates],
            vector: vec![T::zero(); coordinates],
        }
    }

    /// An error if this is the scratch of a robot of another size.
    #[inline(always)]
    pub(crate) fn check(&self, tree: &Tree) -> Result<(), DimensionError> {
        check_size("the workspace", self.motions.len(), tree.bodies.len())?;
        check_size("the workspace's vector", self.vector.len(), tree.velocity_size)
    }
}

impl Tree {
    #[inline(always)]
    pub(crate) fn check_state<T>(&self, q: &[T], v: &[T]) -> Result<(), DimensionError> {
        check_size("the configuration q", q.len(), self.configuration_size())?;
        check_size("the velocity v", v.len(), self.velocity_size)
    }
}
