//! What a URDF says that should not be trusted, and what follows from it.

use std::fmt;

/// Something in a URDF that was read, but that the user should know of.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Finding {
    /// No link that moves has an `<inertial>` with mass.
    NoInertials,
    /// A link's `<inertial>` lacks parts; they are taken as zero.
    IncompleteInertial {
        /// The link.
        link: String,
        /// What it lacks.
        missing: Vec<&'static str>,
    },
    /// A link's `<inertial>` declares a mass of zero.
    ZeroMass {
        /// The link.
        link: String,
    },
    /// A link declares a negative mass.
    NegativeMass {
        /// The link.
        link: String,
        /// Its mass \[kg\].
        mass: f64,
    },
    /// A link with mass declares no rotational inertia.
    ZeroInertia {
        /// The link.
        link: String,
        /// Its mass \[kg\].
        mass: f64,
    },
    /// A principal moment of inertia is negative.
    IndefiniteInertia {
        /// The link.
        link: String,
        /// The smallest principal moment \[kg·m²\].
        smallest: f64,
    },
    /// One principal moment of inertia exceeds the sum of the other two.
    TriangleInequality {
        /// The link.
        link: String,
        /// The principal moments, ascending \[kg·m²\].
        principal: [f64; 3],
    },
    /// A joint moves a link that has no mass, nor have the links fixed to it.
    MasslessBody {
        /// The joint.
        joint: String,
        /// The link that it moves.
        link: String,
        /// Whether nothing behind the joint has mass either.
        whole_branch: bool,
    },
    /// A revolute or prismatic joint lacks limits; they are taken as infinite.
    MissingLimits {
        /// The joint.
        joint: String,
        /// Which.
        missing: Vec<&'static str>,
    },
    /// The lower limit is above the upper; they are swapped.
    ReversedLimits {
        /// The joint.
        joint: String,
        /// As declared \[rad, m\].
        lower: f64,
        /// As declared \[rad, m\].
        upper: f64,
    },
    /// The lower limit equals the upper.
    NoRange {
        /// The joint.
        joint: String,
        /// The one position left \[rad, m\].
        position: f64,
    },
    /// The axis is not a unit vector; it is normalised.
    AxisNotUnit {
        /// The joint.
        joint: String,
        /// Its length.
        length: f64,
    },
    /// A joint follows another.
    Mimic {
        /// The follower.
        joint: String,
        /// The joint that leads, at the end of the chain.
        leader: String,
        /// Position = ratio · leader + offset.
        ratio: f64,
        /// See `ratio` \[rad, m\].
        offset: f64,
    },
    /// A joint would follow one that does not move, so it does not either.
    MimicStill {
        /// The follower.
        joint: String,
        /// The position at which it is taken as fixed \[rad, m\].
        position: f64,
    },
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Finding::NoInertials => write!(
                f,
                "no moving link has an <inertial> with mass: until parameters are identified every torque is zero"
            ),
            Finding::IncompleteInertial { link, missing } => {
                write!(f, "link `{link}`: <inertial> lacks {}: taken as zero", missing.join(", "))
            }
            Finding::ZeroMass { link } => {
                write!(f, "link `{link}`: its mass is zero, so it adds no weight to any torque")
            }
            Finding::NegativeMass { link, mass } => write!(
                f,
                "link `{link}`: its mass is negative ({mass} kg): no real body has these parameters, and forward dynamics may fail"
            ),
            Finding::ZeroInertia { link, mass } => write!(
                f,
                "link `{link}`: {mass} kg but no rotational inertia: it is a point mass, and torques of fast rotations are too small"
            ),
            Finding::IndefiniteInertia { link, smallest } => write!(
                f,
                "link `{link}`: its inertia has the negative principal moment {smallest:.3e} kg·m²: no \
                 real body has it, and forward dynamics may fail"
            ),
            Finding::TriangleInequality { link, principal: [a, b, c] } => write!(
                f,
                "link `{link}`: its principal moment {c:.3e} kg·m² exceeds the sum of the other two \
                 ({a:.3e}, {b:.3e}): no real body has it; do not hold identified parameters against it"
            ),
            Finding::MasslessBody { joint, link, whole_branch: false } => {
                write!(
                    f,
                    "joint `{joint}` moves link `{link}`, which has no mass of its own: it only passes on what comes after it"
                )
            }
            Finding::MasslessBody { joint, link, whole_branch: true } => write!(
                f,
                "joint `{joint}` moves link `{link}`, and nothing behind it has mass: its torque is zero \
                 and forward dynamics is singular; hold the joint or give the link an <inertial>"
            ),
            Finding::MissingLimits { joint, missing } => {
                write!(f, "joint `{joint}`: no limit for {}: taken as infinite", missing.join(", "))
            }
            Finding::ReversedLimits { joint, lower, upper } => {
                write!(
                    f,
                    "joint `{joint}`: its lower limit {lower} is above its upper limit {upper}: swapped"
                )
            }
            Finding::NoRange { joint, position } => write!(
                f,
                "joint `{joint}`: both limits are {position}, so it cannot move: mend the limits or hold it"
            ),
            Finding::AxisNotUnit { joint, length } => {
                write!(f, "joint `{joint}`: its axis has length {length}: normalised")
            }
            Finding::Mimic { joint, leader, ratio, offset } => write!(
                f,
                "joint `{joint}` follows `{leader}` (ratio {ratio}, offset {offset}): it has no \
                 coordinate of its own, its torque is added to the leader's"
            ),
            Finding::MimicStill { joint, position } => {
                write!(f, "joint `{joint}` follows a joint that does not move: taken as fixed at {position}")
            }
        }
    }
}
