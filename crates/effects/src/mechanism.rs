//! How effects are expressed in the model of a simulator.

use phiw_identification::effect::JointProperty;

/// A part of a simulator's model that does what an effect does. Joints are named.
#[derive(Clone, Debug, PartialEq)]
pub enum Mechanism {
    /// A property of a joint.
    Joint {
        /// The joint.
        joint: String,
        /// Which property.
        property: JointProperty,
        /// Its value, in the property's unit.
        value: f64,
        /// Speed within which a friction turns as tanh(q̇/width) does \[rad/s, m/s\]; zero where it turns at
        /// once, and for what is no friction.
        width: f64,
    },
    /// A spring between a joint and what it stands on.
    Spring {
        /// The joint.
        joint: String,
        /// \[N·m/rad, N/m\].
        stiffness: f64,
        /// Where it is slack \[rad, m\].
        reference: f64,
    },
    /// A motor that does not deliver its command: the joint gets `gain`·command + `bias`.
    Motor {
        /// The joint.
        joint: String,
        /// Torque for each unit of its command.
        gain: f64,
        /// Torque under no command \[N·m, N\].
        bias: f64,
    },
    /// A motor whose torque comes after its command.
    MotorDelay {
        /// The joint.
        joint: String,
        /// Time from a command to its torque \[s\].
        delay: f64,
    },
    /// A transmission that turns with a sum of two joints' positions.
    Transmission {
        /// The joints.
        joints: [String; 2],
        /// The factors of their positions.
        factors: [f64; 2],
        /// What the transmission has.
        property: JointProperty,
        /// Its value, of the sum.
        value: f64,
        /// Whether the effect is only what crosses from one joint to the other: the share that each joint
        /// feels of its own motion has to be taken off the joint's own property.
        crossing_only: bool,
        /// As of a joint's property: speed of the sum within which a friction turns \[rad/s, m/s\].
        width: f64,
    },
}

/// Friction of a servo that depends on more than its direction and in proportion to its speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ServoFriction {
    /// torque·exp(−(|q̇|/speed)^exponent)·sign(q̇).
    Stribeck {
        /// At rest, on top of Coulomb friction \[N·m, N\].
        torque: f64,
        /// Where it has fallen to 1/e \[rad/s, m/s\].
        speed: f64,
        /// How sharply it falls.
        exponent: f64,
    },
    /// share·|load|·sign(q̇).
    Load {
        /// Share of the torque that goes through the gear.
        share: f64,
    },
}

/// What in a simulator's model does what an effect does.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mechanisms {
    /// The parts; none if it can not be expressed at all.
    pub parts: Vec<Mechanism>,
    /// Names of the parameters that can not be expressed though others can.
    pub left_out: Vec<String>,
}

impl Mechanisms {
    /// One part that expresses all.
    pub fn of(part: Mechanism) -> Self {
        Mechanisms { parts: vec![part], left_out: Vec::new() }
    }
}
