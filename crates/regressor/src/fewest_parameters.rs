//! How many base parameters a robot has at the least, from its joints alone.

use phiw_dynamics::{JointType, Placement, Tree, Vec3};

/// Sine of the angle between two axes below which they count as parallel. Where in doubt they are, since
/// parallel axes tell less.
const PARALLEL: f64 = 1e-3;

/// For each body so many base parameters as it has at the least, by the rules of regrouping (Mayeda, Yoshida
/// and Osuka 1990): seven behind a joint that turns about another direction than one before it, three where
/// all axes so far are parallel, one for the first joint that turns and for a slide.
///
/// It takes no time, where [`BaseParameters::of_tree`](crate::BaseParameters::of_tree) takes the cube of the
/// number of bodies.
pub fn fewest_base_parameters(tree: &Tree) -> Vec<usize> {
    // Where each body's frame lies with all joints at zero, and what turns before it.
    let mut frames: Vec<Placement<f64>> = Vec::with_capacity(tree.bodies().len());
    let mut turns: Vec<Turns> = Vec::with_capacity(tree.bodies().len());
    let mut led = std::collections::BTreeSet::new();
    let mut fewest = Vec::with_capacity(tree.bodies().len());
    for body in tree.bodies() {
        let (frame, before) = match body.parent {
            Some(parent) => (frames[parent].compose(body.origin), turns[parent]),
            None => (body.origin, Turns::Nowhere),
        };
        let after = match body.joint_type {
            JointType::Revolute | JointType::Continuous => before.and(frame.rotation * body.axis),
            JointType::Prismatic | JointType::Floating => before,
        };
        // What follows another joint (mimic) may be identifiable only together with it.
        let by_itself = led.insert(body.velocity_index);
        fewest.push(match (body.joint_type, before, after) {
            _ if !by_itself => 0,
            (JointType::Revolute | JointType::Continuous, Turns::About(_), Turns::About(_)) => 3,
            (JointType::Revolute | JointType::Continuous, _, Turns::Anywhere) => 7,
            _ => 1,
        });
        frames.push(frame);
        turns.push(after);
    }
    fewest
}

/// The directions about which a body turns.
#[derive(Clone, Copy)]
enum Turns {
    Nowhere,
    About(Vec3<f64>),
    Anywhere,
}

impl Turns {
    fn and(self, axis: Vec3<f64>) -> Self {
        match self {
            Turns::Nowhere => Turns::About(axis),
            Turns::About(other) => {
                let across = other.cross(axis);
                if across.dot(across).sqrt() < PARALLEL { self } else { Turns::Anywhere }
            }
            Turns::Anywhere => self,
        }
    }
}
