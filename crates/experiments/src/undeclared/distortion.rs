//! Sensors and drives whose torque is another by a share that is no constant.

use super::plant::States;

/// What a logged torque has too much, for a unit scale.
#[derive(Clone, Debug)]
pub enum Distortion {
    /// τ·(τ/τ₀)²: the current that a torque needs where the iron saturates.
    OfTorque {
        /// τ₀ \[N·m\].
        large: f64,
    },
    /// τ·(q̇/q̇₀)².
    OfSpeed {
        /// q̇₀ \[rad/s\].
        fast: f64,
    },
    /// τ·sin(Nq + φ).
    Ripple {
        /// N \[1/rad\].
        cycles: f64,
        /// φ \[rad\].
        phase: f64,
    },
    /// The torque of another joint.
    Crosstalk {
        /// Which.
        other: usize,
    },
}

impl Distortion {
    /// What is added to the torque of a joint at a sample, of which all `torques` are given.
    pub fn added(&self, states: &States, sample: usize, joint: usize, torques: &[f64]) -> f64 {
        let torque = torques[joint];
        match self {
            Distortion::OfTorque { large } => torque * (torque / large).powi(2),
            Distortion::OfSpeed { fast } => torque * (states.v(sample, joint) / fast).powi(2),
            Distortion::Ripple { cycles, phase } => torque * (cycles * states.q(sample, joint) + phase).sin(),
            Distortion::Crosstalk { other } => torques[*other],
        }
    }
}
