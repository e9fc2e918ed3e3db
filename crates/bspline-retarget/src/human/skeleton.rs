//! Segments, joints and lengths of the human upper body.
//!
//! Frames of all segments are alike when all angles are zero: x forward, y left, z up, arms hanging. A
//! segment's frame is at the joint before it; its end is where the next one begins. Lengths are round numbers
//! for an adult 1.75 m tall: starting values with a spread, which the recording corrects.

/// A rigid part of the body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Segment {
    /// The root; its frame is between the hips.
    Pelvis,
    /// Thorax; its frame is at the waist, its end at the root of the neck.
    Chest,
    /// Its end is the joint between neck and head.
    Neck,
    /// Its end is the point between the eyes.
    Head,
    /// Shoulder girdle, from the sternum to the shoulder.
    Clavicle(Side),
    /// From the shoulder to the elbow.
    UpperArm(Side),
    /// From the elbow to the wrist.
    Forearm(Side),
    /// From the wrist to the knuckles.
    Hand(Side),
}

/// Left or right.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Side {
    /// y > 0.
    Left,
    /// y < 0.
    Right,
}

impl Side {
    /// Both.
    pub const BOTH: [Side; 2] = [Side::Left, Side::Right];

    /// 1 for left, −1 for right.
    pub fn sign(self) -> f64 {
        match self {
            Side::Left => 1.0,
            Side::Right => -1.0,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Side::Left => "left",
            Side::Right => "right",
        }
    }
}

impl Segment {
    /// All segments, each after the one it hangs on.
    pub const ALL: [Segment; 12] = [
        Segment::Pelvis,
        Segment::Chest,
        Segment::Neck,
        Segment::Head,
        Segment::Clavicle(Side::Left),
        Segment::UpperArm(Side::Left),
        Segment::Forearm(Side::Left),
        Segment::Hand(Side::Left),
        Segment::Clavicle(Side::Right),
        Segment::UpperArm(Side::Right),
        Segment::Forearm(Side::Right),
        Segment::Hand(Side::Right),
    ];

    /// Its place in [`Segment::ALL`].
    pub fn index(self) -> usize {
        let arm = |side| if side == Side::Left { 0 } else { 4 };
        match self {
            Segment::Pelvis => 0,
            Segment::Chest => 1,
            Segment::Neck => 2,
            Segment::Head => 3,
            Segment::Clavicle(side) => 4 + arm(side),
            Segment::UpperArm(side) => 5 + arm(side),
            Segment::Forearm(side) => 6 + arm(side),
            Segment::Hand(side) => 7 + arm(side),
        }
    }

    /// Name in a marker map: `chest`, `left_upper_arm`, …
    pub fn name(self) -> String {
        match self {
            Segment::Pelvis => "pelvis".to_owned(),
            Segment::Chest => "chest".to_owned(),
            Segment::Neck => "neck".to_owned(),
            Segment::Head => "head".to_owned(),
            Segment::Clavicle(side) => format!("{}_clavicle", side.name()),
            Segment::UpperArm(side) => format!("{}_upper_arm", side.name()),
            Segment::Forearm(side) => format!("{}_forearm", side.name()),
            Segment::Hand(side) => format!("{}_hand", side.name()),
        }
    }

    /// The segment of this name.
    pub fn from_name(name: &str) -> Option<Segment> {
        Segment::ALL.into_iter().find(|segment| segment.name() == name)
    }

    pub(crate) fn parent(self) -> Option<Segment> {
        match self {
            Segment::Pelvis => None,
            Segment::Chest => Some(Segment::Pelvis),
            Segment::Neck | Segment::Clavicle(_) => Some(Segment::Chest),
            Segment::Head => Some(Segment::Neck),
            Segment::UpperArm(side) => Some(Segment::Clavicle(side)),
            Segment::Forearm(side) => Some(Segment::UpperArm(side)),
            Segment::Hand(side) => Some(Segment::Forearm(side)),
        }
    }
}

/// A length of ξ^h, the same on both sides of the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentParameter {
    /// Its name.
    pub name: &'static str,
    /// Of an adult 1.75 m tall \[m\].
    pub typical_m: f64,
    /// Standard deviation over adults \[m\].
    pub spread_m: f64,
}

const fn length(name: &'static str, typical_m: f64, spread_m: f64) -> SegmentParameter {
    SegmentParameter { name, typical_m, spread_m }
}

/// The lengths of ξ^h.
pub const SEGMENT_PARAMETERS: [SegmentParameter; 11] = [
    length("waist_height", 0.15, 0.02),
    length("chest", 0.36, 0.03),
    length("neck", 0.09, 0.015),
    length("head_height", 0.07, 0.015),
    length("head_depth", 0.09, 0.015),
    length("clavicle_root_height", 0.28, 0.03),
    length("clavicle_root_depth", 0.04, 0.02),
    length("clavicle", 0.17, 0.02),
    length("upper_arm", 0.30, 0.025),
    length("forearm", 0.26, 0.02),
    length("hand", 0.09, 0.01),
];

/// A length of ξ^h, and what it goes along: x (0), y (1) or z (2), in the sense of the sign.
pub(crate) type Along = (usize, usize, f64);

/// Lengths of ξ^h from the frame of a segment's parent to the segment's, along the parent's axes.
pub(crate) fn length_to(segment: Segment) -> Vec<Along> {
    match segment {
        Segment::Pelvis => vec![],
        Segment::Chest => vec![(0, 2, 1.0)],
        Segment::Clavicle(_) => vec![(5, 2, 1.0), (6, 0, 1.0)],
        Segment::Neck => length_to_end(Segment::Chest),
        Segment::Head => length_to_end(Segment::Neck),
        Segment::UpperArm(side) => length_to_end(Segment::Clavicle(side)),
        Segment::Forearm(side) => length_to_end(Segment::UpperArm(side)),
        Segment::Hand(side) => length_to_end(Segment::Forearm(side)),
    }
}

/// Lengths of ξ^h from a segment's frame to its end, along its axes.
pub(crate) fn length_to_end(segment: Segment) -> Vec<Along> {
    match segment {
        Segment::Pelvis => length_to(Segment::Chest),
        Segment::Chest => vec![(1, 2, 1.0)],
        Segment::Neck => vec![(2, 2, 1.0)],
        Segment::Head => vec![(3, 2, 1.0), (4, 0, 1.0)],
        Segment::Clavicle(side) => vec![(7, 1, side.sign())],
        Segment::UpperArm(_) => vec![(8, 2, -1.0)],
        Segment::Forearm(_) => vec![(9, 2, -1.0)],
        Segment::Hand(_) => vec![(10, 2, -1.0)],
    }
}

/// How a coordinate of θ^h moves a segment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motion {
    /// Along x (0), y (1) or z (2).
    Slide(usize),
    /// About x (0), y (1) or z (2), in the sense of the sign.
    Turn(usize, f64),
}

/// A coordinate of θ^h.
pub(crate) struct Joint {
    pub name: &'static str,
    pub motion: Motion,
    /// Where it is at rest \[rad, m\].
    pub rest: f64,
    /// How far it is usually from there \[rad, m\]; infinite if it may be anywhere.
    pub spread: f64,
    /// What is anatomically possible, generously \[rad, m\]; infinite where it is not needed to tell a pose
    /// from its double.
    pub range: (f64, f64),
}

const fn joint(name: &'static str, motion: Motion, rest: f64, spread: f64) -> Joint {
    Joint { name, motion, rest, spread, range: (f64::NEG_INFINITY, f64::INFINITY) }
}

impl Joint {
    const fn within(self, lower: f64, upper: f64) -> Joint {
        Joint { range: (lower, upper), ..self }
    }
}

/// The coordinates between a segment and its parent, in order. Rest is a seated person with bent elbows.
pub(crate) fn joints(segment: Segment) -> Vec<Joint> {
    use Motion::{Slide, Turn};
    match segment {
        Segment::Pelvis => vec![
            joint("x", Slide(0), 0.0, f64::INFINITY),
            joint("y", Slide(1), 0.0, f64::INFINITY),
            joint("z", Slide(2), 0.0, f64::INFINITY),
            joint("yaw", Turn(2, 1.0), 0.0, f64::INFINITY),
            joint("pitch", Turn(1, 1.0), 0.0, 0.15),
            joint("roll", Turn(0, 1.0), 0.0, 0.1),
        ],
        Segment::Chest => vec![
            joint("pitch", Turn(1, 1.0), 0.0, 0.2),
            joint("roll", Turn(0, 1.0), 0.0, 0.15),
            joint("yaw", Turn(2, 1.0), 0.0, 0.2),
        ],
        Segment::Neck => vec![
            joint("yaw", Turn(2, 1.0), 0.0, 0.4),
            joint("pitch", Turn(1, 1.0), 0.0, 0.3),
            joint("roll", Turn(0, 1.0), 0.0, 0.2),
        ],
        Segment::Head => vec![joint("nod", Turn(1, 1.0), 0.0, 0.2)],
        Segment::Clavicle(side) => vec![
            joint("protraction", Turn(2, -side.sign()), 0.0, 0.25).within(-0.7, 0.9),
            joint("elevation", Turn(0, side.sign()), 0.0, 0.25).within(-0.5, 1.0),
            joint("rotation", Turn(1, -1.0), 0.0, 0.2).within(-0.7, 0.7),
        ],
        Segment::UpperArm(side) => vec![
            joint("flexion", Turn(1, -1.0), 0.2, 0.8),
            joint("abduction", Turn(0, side.sign()), 0.15, 0.8),
            joint("rotation", Turn(2, -side.sign()), 0.0, 0.8),
        ],
        Segment::Forearm(side) => vec![
            joint("flexion", Turn(1, -1.0), 1.2, 0.8).within(-0.2, 2.8),
            joint("pronation", Turn(2, -side.sign()), 0.0, 0.8).within(-2.0, 2.0),
        ],
        Segment::Hand(side) => vec![
            joint("flexion", Turn(0, -side.sign()), 0.0, 0.5).within(-1.7, 1.7),
            joint("deviation", Turn(1, -1.0), 0.0, 0.3).within(-1.0, 1.0),
            joint("twist", Turn(2, -side.sign()), 0.0, 0.3).within(-0.8, 0.8),
        ],
    }
}
