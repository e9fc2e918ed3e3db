//! A robot as a file describes it.

use super::inertial::BodyInertia;
use phiw_dynamics::{Placement, Vec3};

/// How a joint moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    Fixed,
    Hinge,
    Slide,
    Free,
}

/// A joint; one for each link but the world.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    pub name: String,
    pub motion: Motion,
    /// Parent and child, places in [`Robot::links`].
    pub links: [usize; 2],
    /// The joint's frame in the parent link's, at position zero.
    pub origin: Placement<f64>,
    pub axis: Vec3<f64>,
    /// Lower and upper \[rad, m\].
    pub range: Option<[f64; 2]>,
    /// Largest torque of its motors \[N·m, N\].
    pub effort: Option<f64>,
    pub armature: f64,
    pub damping: f64,
    pub friction: f64,
    /// Position in the file's pose, which MuJoCo calls `ref` \[rad, m\].
    pub reference: f64,
    /// The joint that it follows, with ratio and offset.
    pub follows: Option<(String, f64, f64)>,
}

/// A link: a body, or nothing between two joints of one body.
#[derive(Clone, Debug)]
pub(super) struct Link {
    pub name: String,
    pub inertia: BodyInertia,
    /// Its geometry, as a URDF has it, in the link's frame.
    pub shapes: Vec<(Placement<f64>, String)>,
}

/// What a file says of a robot.
#[derive(Clone, Debug, Default)]
pub(super) struct Robot {
    pub name: String,
    /// The world first.
    pub links: Vec<Link>,
    pub joints: Vec<Joint>,
    pub left_out: Vec<String>,
}
