//! What surrounds a simulated robot: a floor under its feet, rotors behind its joints.

use crate::check::check_size;
use crate::{DimensionError, Tree};

/// The world of a simulated robot, the same for every physics engine.
///
/// The robot itself is a [`Tree`]. A fixed base stays where it is; a floating base without feet falls; a
/// floating base with feet stands on the floor `z = 0` and topples when its ZMP leaves the feet.
#[derive(Clone, Debug, PartialEq)]
pub struct World {
    /// What touches the floor; empty: there is no floor.
    pub feet: Vec<Foot>,
    /// Coefficient of Coulomb friction between feet and floor.
    pub floor_friction: f64,
    /// Inertia of each joint's rotor, seen at the joint \[kg·m², kg\]; empty: none.
    pub rotor_inertia: Vec<f64>,
    /// Whether the joints stop at the position limits of the tree.
    pub position_limits: bool,
}

/// A flat sole: a convex polygon fixed to a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Foot {
    /// Index of the body in [`Tree::bodies`].
    pub body: usize,
    /// Corners in the body's joint frame \[m\], coplanar. Each touches the floor as a point.
    pub sole: Vec<[f64; 3]>,
}

impl Default for World {
    /// Empty space: no floor, no rotors, no limits.
    fn default() -> Self {
        World { feet: Vec::new(), floor_friction: 1.0, rotor_inertia: Vec::new(), position_limits: false }
    }
}

impl World {
    /// Whether this world can hold the robot.
    ///
    /// # Errors
    /// The rotor inertias are not one for each joint or not finite and ≥ 0; the floor friction is not finite
    /// and ≥ 0; a foot names a body that the tree has not, or has fewer than three corners; feet under a
    /// fixed base.
    pub fn check(&self, tree: &Tree) -> Result<(), WorldError> {
        if !self.rotor_inertia.is_empty() {
            check_size("the world's rotor inertias", self.rotor_inertia.len(), tree.joint_count())?;
        }
        if let Some(joint) =
            self.rotor_inertia.iter().position(|inertia| !(inertia.is_finite() && *inertia >= 0.0))
        {
            return Err(WorldError::RotorInertia {
                joint: tree.joint(joint).joint.clone(),
                value: self.rotor_inertia[joint],
            });
        }
        if !(self.floor_friction.is_finite() && self.floor_friction >= 0.0) {
            return Err(WorldError::FloorFriction(self.floor_friction));
        }
        if !self.feet.is_empty() && !tree.is_floating() {
            return Err(WorldError::FeetOfFixedBase);
        }
        for foot in &self.feet {
            if foot.body >= tree.bodies().len() {
                return Err(WorldError::NoSuchBody { body: foot.body, bodies: tree.bodies().len() });
            }
            if foot.sole.len() < 3 {
                return Err(WorldError::Sole {
                    link: tree.bodies()[foot.body].link.clone(),
                    corners: foot.sole.len(),
                });
            }
        }
        Ok(())
    }
}

/// Why a world can not hold a robot.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WorldError {
    /// A list does not fit the robot.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// A rotor's inertia is negative or not a number.
    #[error("the rotor inertia of {joint} is {value}: it must be a number ≥ 0")]
    RotorInertia {
        /// The joint.
        joint: String,
        /// Its value.
        value: f64,
    },
    /// The floor's friction is negative or not a number.
    #[error("the floor's friction is {0}: it must be a number ≥ 0")]
    FloorFriction(f64),
    /// A fixed base can not stand on feet.
    #[error("a fixed base has no use for feet: read the robot with a floating base to let it stand")]
    FeetOfFixedBase,
    /// A foot names a body that is not there.
    #[error("a foot is fixed to body {body}, but the robot has {bodies} bodies")]
    NoSuchBody {
        /// The index.
        body: usize,
        /// Bodies of the tree.
        bodies: usize,
    },
    /// A sole without an area.
    #[error("the sole under {link} has {corners} corners: a polygon needs at least 3")]
    Sole {
        /// The link.
        link: String,
        /// Its corners.
        corners: usize,
    },
}
