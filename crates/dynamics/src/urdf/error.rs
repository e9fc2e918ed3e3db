//! What makes a URDF unusable.

/// Why a URDF cannot be read as a robot, or written.
///
/// What can be read but should not be trusted is a [`Finding`](super::Finding) instead.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// The file cannot be read.
    #[error("cannot read `{path}`: {source}")]
    Unreadable {
        /// The file.
        path: String,
        /// What the system says.
        source: std::io::Error,
    },
    /// The text asks for more than any robot needs.
    #[error("line {line}: {what}; no robot needs that: simplify the URDF, or raise the limit")]
    TooMuch {
        /// Where the limit is reached.
        line: usize,
        /// What is too much, and the limit.
        what: String,
    },
    /// The robot has more joints than its dynamics can be identified with.
    #[error(
        "{joints} joints move, but no more than {most} can be identified at once: hold some with --hold JOINT"
    )]
    TooManyJoints {
        /// Joints that move by themselves.
        joints: usize,
        /// How many may.
        most: usize,
    },
    /// The text is not well-formed XML.
    #[error("not a URDF: it is not XML: {0}")]
    NotXml(#[from] roxmltree::Error),
    /// The XML's root is not `<robot>`.
    #[error("not a URDF: its outermost element is <{root}>, not <robot>")]
    NotRobot {
        /// The outermost element.
        root: String,
    },
    /// The file is a xacro template.
    #[error(
        "this is a xacro template, not yet a URDF: expand it first (`xacro robot.urdf.xacro > robot.urdf`)"
    )]
    Xacro,
    /// An element lacks a part without which it means nothing.
    #[error("line {line}: {element} lacks {lacks}: add it")]
    Incomplete {
        /// Where it starts.
        line: u32,
        /// The element, with its name.
        element: String,
        /// What it lacks.
        lacks: &'static str,
    },
    /// An element has a part twice that it can have once.
    #[error("line {line}: {element} has a second <{tag}>: remove one of them")]
    Repeated {
        /// Where the second one starts.
        line: u32,
        /// The link or joint, with its name.
        element: String,
        /// The part.
        tag: &'static str,
    },
    /// An `<origin>` declares its rotation in both ways.
    #[error("line {line}: an <origin> of {element} has both rpy and quat_xyzw: remove one of them")]
    TwoRotations {
        /// Where the `<origin>` starts.
        line: u32,
        /// The link or joint, with its name.
        element: String,
    },
    /// An attribute that should hold numbers does not.
    #[error("line {line}, {element}: {attribute}=\"{value}\" is not {expected}: correct it, as in {example}")]
    NotANumber {
        /// Where the attribute's element starts.
        line: u32,
        /// The link or joint, with its name.
        element: String,
        /// The attribute.
        attribute: &'static str,
        /// Its value.
        value: String,
        /// What it should be, such as `three numbers`.
        expected: &'static str,
        /// How that is written, the element around it.
        example: String,
    },
    /// Two links or two joints share a name.
    #[error("line {line}: two {kind}s are called `{name}`: rename one")]
    Duplicate {
        /// Where the second one starts.
        line: u32,
        /// `link` or `joint`.
        kind: &'static str,
        /// The shared name.
        name: String,
    },
    /// A joint names a link that the file does not define.
    #[error(
        "line {line}: joint `{joint}` names the link `{link}`, which the URDF does not define{}",
        did_you_mean(nearest)
    )]
    UnknownLink {
        /// Where the joint starts.
        line: u32,
        /// The joint.
        joint: String,
        /// The link it names.
        link: String,
        /// The nearest name that there is.
        nearest: Option<String>,
    },
    /// A link is the child of two joints.
    #[error(
        "line {line}: link `{link}` is the child of both joint `{first}` and joint `{second}`: only trees can be read, cut the loop at one of them"
    )]
    TwoParents {
        /// Where the second joint starts.
        line: u32,
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other.
        second: String,
    },
    /// More than one link has no parent.
    #[error("several links have no parent ({}): connect them by joints or remove all but one", quoted(links))]
    SeveralRoots {
        /// Those links.
        links: Vec<String>,
    },
    /// Links that follow each other in a circle.
    #[error("these links follow each other in a circle, so that no root reaches them: {}", quoted(links))]
    Cycle {
        /// Links that no root reaches.
        links: Vec<String>,
    },
    /// There is no `<link>`.
    #[error("the URDF has no link")]
    NoLinks,
    /// Nothing moves.
    #[error("no joint of the URDF moves: all are fixed or held")]
    NoMovingJoints,
    /// A joint that is to be held is not in the URDF.
    #[error("cannot hold the joint `{joint}`: the URDF has no joint of that name{}", did_you_mean(nearest))]
    UnknownHeldJoint {
        /// The name given.
        joint: String,
        /// The nearest name that there is.
        nearest: Option<String>,
    },
    /// A pattern of joints that are to be held stands for none.
    #[error(
        "cannot hold `{pattern}`: no joint that moves by itself is called so; joints are {}",
        quoted(joints)
    )]
    NothingToHold {
        /// The pattern given.
        pattern: String,
        /// The joints that move by themselves.
        joints: Vec<String>,
    },
    /// A joint that is to be held in two places.
    #[error(
        "cannot hold the joint `{joint}` at {} and at {}: name it once, or at one position",
        positions[0],
        positions[1]
    )]
    HeldTwice {
        /// The joint.
        joint: String,
        /// Where it is to be held \[rad, m\].
        positions: [f64; 2],
    },
    /// A `<mimic>` follows a joint that is not in the URDF.
    #[error(
        "line {line}: joint `{joint}` mimics `{leader}`, but the URDF has no joint of that name{}",
        did_you_mean(nearest)
    )]
    UnknownLeader {
        /// Where the joint starts.
        line: u32,
        /// The follower.
        joint: String,
        /// The joint that it names.
        leader: String,
        /// The nearest name that there is.
        nearest: Option<String>,
    },
    /// A `<mimic>` follows a joint without a single position.
    #[error(
        "line {line}: joint `{joint}` mimics `{leader}`, which is {kind} and has no single position to follow: remove the <mimic>"
    )]
    LeaderWithoutPosition {
        /// Where the joint starts.
        line: u32,
        /// The follower.
        joint: String,
        /// The leader.
        leader: String,
        /// The leader's type.
        kind: &'static str,
    },
    /// `<mimic>` joints follow each other in a circle.
    #[error("line {line}: joint `{joint}` mimics itself, directly or through others: remove one <mimic>")]
    MimicLoop {
        /// Where the joint starts.
        line: u32,
        /// A joint of the circle.
        joint: String,
    },
    /// A joint type that cannot be modelled.
    #[error(
        "line {line}: joint `{joint}` is of the type {kind}, which is not supported: hold it (`--hold {joint}`) or make it two or three simple joints"
    )]
    UnsupportedJoint {
        /// Where the joint starts.
        line: u32,
        /// The joint.
        joint: String,
        /// Its type.
        kind: String,
    },
    /// A joint type that URDF does not have.
    #[error(
        "line {line}: joint `{joint}` is of the type {kind}, which is not supported: URDF has revolute, continuous, prismatic, fixed, floating and planar"
    )]
    UnknownType {
        /// Where the joint starts.
        line: u32,
        /// The joint.
        joint: String,
        /// Its type.
        kind: String,
    },
    /// A floating joint elsewhere than alone behind the root link.
    #[error(
        "line {line}: joint `{joint}` is floating but not the only joint of the root link: only a base can float; hold it or make it fixed"
    )]
    FloatingNotAtRoot {
        /// Where the joint starts.
        line: u32,
        /// The joint.
        joint: String,
    },
    /// A moving joint whose axis is zero.
    #[error("line {line}: the axis of joint `{joint}` is zero: give it a direction")]
    ZeroAxis {
        /// Where the joint starts.
        line: u32,
        /// The joint.
        joint: String,
    },
    /// NaN, infinity, or a number beyond any robot.
    #[error("{}{kind} `{name}`: {field} is not a finite number that a robot can have", at(*line))]
    NotFinite {
        /// Where the link or joint starts, if it is the file that says so.
        line: Option<u32>,
        /// `link` or `joint`.
        kind: &'static str,
        /// Its name.
        name: String,
        /// Which of its numbers.
        field: &'static str,
    },
    /// Writing: the URDF is not the one that the tree was read from.
    #[error("the URDF to write has no {kind} `{name}`: it is not the one that the robot was read from")]
    OtherRobot {
        /// `link` or `joint`.
        kind: &'static str,
        /// Its name.
        name: String,
    },
    /// Writing: a first moment without mass has no centre of mass.
    #[error("link `{link}` has a first moment but no mass, which URDF cannot express: give it some mass")]
    MomentWithoutMass {
        /// The link.
        link: String,
    },
}

/// The name among `names` that is most like `name`, if any is much like it.
pub(super) fn nearest<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<String> {
    names
        .map(|candidate| (strsim::normalized_damerau_levenshtein(name, candidate), candidate))
        .filter(|(similarity, _)| *similarity > 0.5)
        .max_by(|(a, _), (b, _)| a.total_cmp(b))
        .map(|(_, candidate)| candidate.to_owned())
}

fn at(line: Option<u32>) -> String {
    line.map_or_else(String::new, |line| format!("line {line}, "))
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest.as_ref().map_or_else(String::new, |name| format!("; did you mean `{name}`?"))
}

/// Names in a message; a broken file can have thousands.
const NAMED: usize = 10;

fn quoted(names: &[String]) -> String {
    let mut words: Vec<String> = names.iter().take(NAMED).map(|name| format!("`{name}`")).collect();
    if names.len() > NAMED {
        words.push(format!("and {} more", names.len() - NAMED));
    }
    words.join(", ")
}
