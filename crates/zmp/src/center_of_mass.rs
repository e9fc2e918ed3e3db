//! The centre of mass.

/// A robot's centre of mass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CenterOfMass {
    /// Mass of the whole robot \[kg\].
    pub mass: f64,
    /// Where it is, in the world \[m\]; not finite for a robot without mass.
    pub position: [f64; 3],
    /// Its acceleration along the world's axes \[m/s²\].
    pub acceleration: [f64; 3],
}
