//! What a robot has beside its rigid bodies.

use crate::error::check_value;
use crate::numbers::Numbers;
use crate::{Friction, Mechanism, PlantError, Presliding};
use phiw_dynamics::Tree;

/// One effect in the plant's physics or sensors. Torques in N·m or N, angles in rad or m.
///
/// Whether it is declared or secret is not the plant's business: a log never mentions it. Joints are indices
/// in the robot's order, bodies indices in [`Tree::bodies`]. The torque is what the joint must deliver on top
/// of the rigid body's.
#[derive(Clone, Debug, PartialEq)]
pub enum PlantEffect {
    /// A friction of the joint's speed.
    Friction {
        /// The joint.
        joint: usize,
        /// Its law.
        law: Friction,
    },
    /// A friction with a memory (`hysteresis`).
    Presliding {
        /// The joint.
        joint: usize,
        /// Its law.
        law: Presliding,
    },
    /// A torque of the joint's angle.
    Mechanism {
        /// The joint.
        joint: usize,
        /// Its law.
        law: Mechanism,
    },
    /// Inertia of a rotor that turns with the joint, on top of the world's \[kg·m², kg\].
    RotorInertia {
        /// The joint.
        joint: usize,
        /// Ia.
        inertia: f64,
    },
    /// A constant torque.
    TorqueOffset {
        /// The joint.
        joint: usize,
        /// The torque.
        torque: f64,
    },
    /// The actuator delivers 1/(1 + share) of the command; the log has the command.
    TorqueGain {
        /// The joint.
        joint: usize,
        /// ε, above −1.
        share: f64,
    },
    /// The actuator delivers no more than this; the log has the command.
    Saturation {
        /// The joint.
        joint: usize,
        /// Largest torque delivered.
        torque: f64,
    },
    /// Two joints feel each other through the transmission.
    Coupling(Coupling),
    /// A spring between motor and link; with `backlash`, one with play. The encoder and all other effects of
    /// the joint are on the motor's side, and so is the rotor, whose inertia must be > 0.
    Flexibility {
        /// The joint.
        joint: usize,
        /// Stiffness \[N·m/rad, N/m\].
        stiffness: f64,
        /// Damping of the spring \[N·m·s/rad, N·s/m\].
        damping: f64,
        /// Play between the tooth flanks; 0: none.
        backlash: f64,
    },
    /// A body held at a link.
    Payload {
        /// The body that holds it.
        body: usize,
        /// Mass \[kg\].
        mass: f64,
        /// Its centre of mass in the body's joint frame \[m\].
        center: [f64; 3],
        /// Radii of gyration about the joint frame's axes through that centre \[m\].
        radii: [f64; 3],
    },
    /// Gravity turned about a level axis: the base is not level.
    GravityTilt {
        /// Direction of the axis from the world's x \[rad\].
        heading: f64,
        /// The turn \[rad\].
        angle: f64,
    },
    /// A constant force on a link, along the world's axes, such as a hose's.
    ExternalForce {
        /// The body.
        body: usize,
        /// Where it pulls, in the body's joint frame \[m\].
        point: [f64; 3],
        /// The force \[N\].
        force: [f64; 3],
    },
    /// The true angle is what the encoder says plus this. The controller believes the encoder.
    EncoderOffset {
        /// The joint.
        joint: usize,
        /// δ.
        angle: f64,
    },
    /// The logged torque is this old.
    TimeDelay {
        /// The joints.
        joints: Vec<usize>,
        /// Delay \[s\].
        delay_s: f64,
    },
}

/// How two joints feel each other.
#[derive(Clone, Debug, PartialEq)]
pub enum Coupling {
    /// Friction of what turns with the sum of both speeds, felt by both (a differential).
    SharedFriction {
        /// The joints.
        joints: [usize; 2],
        /// Viscous part \[N·m·s/rad\].
        coefficient: f64,
        /// Coulomb part \[N·m\].
        torque: f64,
        /// Speed over which its sign turns \[rad/s\].
        width: f64,
    },
    /// Each feels the other's acceleration (a rotor geared to both) \[kg·m²\].
    SharedInertia {
        /// The joints.
        joints: [usize; 2],
        /// What couples them; its size must stay below the geometric mean of the inertias that the joints
        /// feel.
        inertia: f64,
    },
    /// One feels the other's speed.
    Driven {
        /// The one.
        driven: usize,
        /// The other.
        driver: usize,
        /// Viscous part \[N·m·s/rad\].
        coefficient: f64,
        /// Coulomb part \[N·m\].
        torque: f64,
        /// Speed over which its sign turns \[rad/s\].
        width: f64,
    },
}

impl Coupling {
    /// The two joints, ascending.
    pub fn joints(&self) -> [usize; 2] {
        let mut joints = match *self {
            Coupling::SharedFriction { joints, .. } | Coupling::SharedInertia { joints, .. } => joints,
            Coupling::Driven { driven, driver, .. } => [driven, driver],
        };
        joints.sort_unstable();
        joints
    }
}

impl PlantEffect {
    /// The name of its kind in `report.json` and `--declare`.
    pub fn kind(&self) -> &'static str {
        match self {
            PlantEffect::Friction { law, .. } => law.kind(),
            PlantEffect::Presliding { .. } => "hysteresis",
            PlantEffect::Mechanism { law, .. } => law.kind(),
            PlantEffect::RotorInertia { .. } => "rotor_inertia",
            PlantEffect::TorqueOffset { .. } => "torque_offset",
            PlantEffect::TorqueGain { .. } => "torque_gain",
            PlantEffect::Saturation { .. } => "actuator_saturation",
            PlantEffect::Coupling(_) => "transmission_coupling",
            PlantEffect::Flexibility { backlash, .. } if *backlash > 0.0 => "hysteresis",
            PlantEffect::Flexibility { .. } => "joint_elasticity",
            PlantEffect::Payload { .. } => "payload",
            PlantEffect::GravityTilt { .. } => "gravity_tilt",
            PlantEffect::ExternalForce { .. } => "external_force",
            PlantEffect::EncoderOffset { .. } => "encoder_offset",
            PlantEffect::TimeDelay { .. } => "time_delay",
        }
    }

    /// The joints that it is named after; none for a tilt of the base. A body stands for the joint that moves
    /// it.
    pub fn joints(&self, tree: &Tree) -> Vec<usize> {
        let of_body = |body: usize| {
            let joint = tree.bodies().get(body).map(|body| body.joint.as_str());
            joint.and_then(|name| tree.joint_index(name)).into_iter().collect()
        };
        match self {
            PlantEffect::Friction { joint, .. }
            | PlantEffect::Presliding { joint, .. }
            | PlantEffect::Mechanism { joint, .. }
            | PlantEffect::RotorInertia { joint, .. }
            | PlantEffect::TorqueOffset { joint, .. }
            | PlantEffect::TorqueGain { joint, .. }
            | PlantEffect::Saturation { joint, .. }
            | PlantEffect::Flexibility { joint, .. }
            | PlantEffect::EncoderOffset { joint, .. } => vec![*joint],
            PlantEffect::Coupling(coupling) => coupling.joints().to_vec(),
            PlantEffect::TimeDelay { joints, .. } => joints.clone(),
            PlantEffect::Payload { body, .. } | PlantEffect::ExternalForce { body, .. } => of_body(*body),
            PlantEffect::GravityTilt { .. } => Vec::new(),
        }
    }

    /// Whether this robot can have it.
    pub(crate) fn check(&self, tree: &Tree) -> Result<(), PlantError> {
        let kind = self.kind();
        let place = |what, index, count| {
            if index < count { Ok(()) } else { Err(PlantError::NoSuchPlace { kind, what, index, count }) }
        };
        if let PlantEffect::Payload { body, .. } | PlantEffect::ExternalForce { body, .. } = self {
            place("body", *body, tree.bodies().len())?;
        }
        for joint in self.joints(tree) {
            place("joint", joint, tree.joint_count())?;
        }
        self.numbers().check(kind)?;
        if let PlantEffect::Coupling(coupling) = self {
            let [one, other] = coupling.joints();
            check_value(
                || format!("the second joint of {kind}"),
                other as f64,
                "not the first",
                |_| one != other,
            )?;
        }
        match self {
            PlantEffect::ExternalForce { .. } if tree.is_floating() => Err(PlantError::ForceOnFloatingBase),
            _ => Ok(()),
        }
    }

    fn numbers(&self) -> Numbers {
        let mut numbers = Numbers::default();
        match self {
            PlantEffect::Friction { law, .. } => numbers = law.numbers(),
            PlantEffect::Mechanism { law, .. } => numbers = law.numbers(),
            PlantEffect::Presliding { law: Presliding::MaxwellSlip { elements }, .. } => {
                numbers.positive = elements
                    .iter()
                    .flat_map(|&[way, torque]| [("yield way", way), ("slip torque", torque)])
                    .collect();
            }
            PlantEffect::Presliding { law: Presliding::LuGre { torque, way }, .. } => {
                numbers.positive = vec![("torque", *torque), ("way", *way)];
            }
            PlantEffect::RotorInertia { inertia, .. } => numbers.not_negative = vec![("inertia", *inertia)],
            PlantEffect::TorqueOffset { torque, .. } => numbers.free = vec![("torque", *torque)],
            PlantEffect::TorqueGain { share, .. } => numbers.positive = vec![("1 + share", 1.0 + share)],
            PlantEffect::Saturation { torque, .. } => numbers.positive = vec![("torque", *torque)],
            PlantEffect::Coupling(
                Coupling::SharedFriction { coefficient, torque, width, .. }
                | Coupling::Driven { coefficient, torque, width, .. },
            ) => {
                // A driven joint may feel the driver either way round; friction takes energy.
                let sizes = vec![("coefficient", *coefficient), ("torque", *torque)];
                match self {
                    PlantEffect::Coupling(Coupling::Driven { .. }) => numbers.free = sizes,
                    _ => numbers.not_negative = sizes,
                }
                numbers.positive = vec![("width", *width)];
            }
            PlantEffect::Coupling(Coupling::SharedInertia { inertia, .. }) => {
                numbers.free = vec![("inertia", *inertia)]
            }
            PlantEffect::Flexibility { stiffness, damping, backlash, .. } => {
                numbers.not_negative = vec![("damping", *damping), ("backlash", *backlash)];
                numbers.positive = vec![("stiffness", *stiffness)];
            }
            PlantEffect::Payload { mass, center, radii, .. } => {
                numbers.free = center.map(|x| ("centre", x)).to_vec();
                numbers.not_negative = radii.map(|x| ("radius of gyration", x)).to_vec();
                numbers.positive = vec![("mass", *mass)];
            }
            PlantEffect::GravityTilt { heading, angle } => {
                numbers.free = vec![("heading", *heading), ("angle", *angle)]
            }
            PlantEffect::ExternalForce { point, force, .. } => {
                numbers.free =
                    point.map(|x| ("point", x)).into_iter().chain(force.map(|x| ("force", x))).collect();
            }
            PlantEffect::EncoderOffset { angle, .. } => numbers.free = vec![("angle", *angle)],
            PlantEffect::TimeDelay { delay_s, .. } => numbers.free = vec![("delay", *delay_s)],
        }
        numbers
    }
}
