//! How a step goes on in time.

/// How a step goes on in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// The classical Runge-Kutta method of order four.
    #[default]
    RungeKutta4,
    /// Implicit in the velocity, of order one: no cheaper for a robot, but steady where velocities make it
    /// stiff.
    Implicit,
}
