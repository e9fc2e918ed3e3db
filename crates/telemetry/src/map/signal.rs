//! The signals that a joint has in a log.

/// A signal of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Signal {
    Position,
    Velocity,
    Acceleration,
    Torque,
    Temperature,
    Reference,
    Command,
}

impl Signal {
    /// Its name in a log, before the joint's.
    pub fn name(self) -> &'static str {
        match self {
            Signal::Position => "q",
            Signal::Velocity => "qd",
            Signal::Acceleration => "qdd",
            Signal::Torque => "tau",
            Signal::Temperature => "temp",
            Signal::Reference => "qref",
            Signal::Command => "tau_cmd",
        }
    }
}
