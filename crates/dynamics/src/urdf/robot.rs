//! What a URDF says of a robot's dynamics, as it stands there: links and joints in the order of the file.

/// A `<robot>`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Robot {
    /// Empty where the file gives none.
    pub(super) name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
}

/// A `<link>`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Link {
    pub(super) name: String,
    /// Where it starts in the file.
    pub(super) line: u32,
    /// `None` where the file gives none.
    pub(super) inertial: Option<Inertial>,
}

/// An `<inertial>`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Inertial {
    /// The frame of the centre of mass, in which the tensor is given.
    pub(super) origin: Pose,
    /// \[kg\]
    pub(super) mass: f64,
    /// In the order of [`TENSOR`] \[kg·m²\].
    pub(super) inertia: [f64; 6],
    /// What the file leaves out; it is zero.
    pub(super) missing: Vec<&'static str>,
}

/// The attributes of an `<inertia>`.
pub(super) const TENSOR: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];

/// An `<origin>`; all zero where the file gives none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Pose {
    /// \[m\]
    pub(super) xyz: [f64; 3],
    /// Roll, pitch, yaw about the fixed axes x, y, z \[rad\].
    pub(super) rpy: [f64; 3],
}

/// A `<joint>`.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Joint {
    pub(super) name: String,
    /// Where it starts in the file.
    pub(super) line: u32,
    pub(super) kind: JointKind,
    pub(super) origin: Pose,
    /// Name of the link that it starts at.
    pub(super) parent: String,
    /// Name of the link that it carries.
    pub(super) child: String,
    /// As declared, of any length; x where the file gives none.
    pub(super) axis: [f64; 3],
    pub(super) limit: Limit,
    /// Viscous friction \[N·m·s/rad, N·s/m\].
    pub(super) damping: f64,
    /// Coulomb friction \[N·m, N\].
    pub(super) friction: f64,
    pub(super) mimic: Option<Mimic>,
}

/// The `type` of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum JointKind {
    Revolute,
    Continuous,
    Prismatic,
    Fixed,
    Floating,
    Planar,
    Spherical,
}

impl JointKind {
    const ALL: [JointKind; 7] = [
        JointKind::Revolute,
        JointKind::Continuous,
        JointKind::Prismatic,
        JointKind::Fixed,
        JointKind::Floating,
        JointKind::Planar,
        JointKind::Spherical,
    ];

    /// The name in a URDF.
    pub(super) fn name(self) -> &'static str {
        match self {
            JointKind::Revolute => "revolute",
            JointKind::Continuous => "continuous",
            JointKind::Prismatic => "prismatic",
            JointKind::Fixed => "fixed",
            JointKind::Floating => "floating",
            JointKind::Planar => "planar",
            JointKind::Spherical => "spherical",
        }
    }

    pub(super) fn from_name(name: &str) -> Option<Self> {
        JointKind::ALL.into_iter().find(|kind| kind.name() == name)
    }
}

/// A `<limit>`; nothing where the file gives none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Limit {
    /// Lower and upper \[rad, m\]; `None` if both are left out.
    pub(super) range: Option<[f64; 2]>,
    /// \[rad/s, m/s\]
    pub(super) velocity: Option<f64>,
    /// \[N·m, N\]
    pub(super) effort: Option<f64>,
}

/// A `<mimic>`: position = multiplier · position of `joint` + offset.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Mimic {
    pub(super) joint: String,
    pub(super) multiplier: f64,
    /// \[rad, m\]
    pub(super) offset: f64,
}
