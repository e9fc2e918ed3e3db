//! Random robots and states for tests and benchmarks, the same on every machine for the same seed.

use crate::inertia::Inertia;
use crate::urdf::{UrdfError, UrdfOptions, read_urdf};
use crate::{JointType, Mat3, Tree, Vec3};
use std::fmt::Write;

/// What a random robot is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RandomTreeOptions {
    /// Number of moving joints, mimic joints among them.
    pub joints: usize,
    /// Whether the base floats.
    pub floating_base: bool,
    /// Whether some joints follow others.
    pub mimic: bool,
    /// Whether some links are behind fixed joints.
    pub fixed_links: bool,
}

impl Default for RandomTreeOptions {
    /// Ten joints on a fixed base, fixed links among them, no mimics.
    fn default() -> Self {
        RandomTreeOptions { joints: 10, floating_base: false, mimic: false, fixed_links: true }
    }
}

/// A state of motion.
#[derive(Clone, Debug, PartialEq)]
pub struct RandomState {
    /// Configuration, of [`Tree::configuration_size`].
    pub q: Vec<f64>,
    /// Velocity, of [`Tree::velocity_size`].
    pub v: Vec<f64>,
    /// Acceleration, of [`Tree::velocity_size`].
    pub a: Vec<f64>,
}

/// A small generator of pseudo-random numbers (SplitMix64, Steele, Lea & Flood 2014).
#[derive(Clone, Debug)]
pub struct RandomNumbers(u64);

impl RandomNumbers {
    /// A generator that gives the same numbers for the same seed.
    pub fn new(seed: u64) -> Self {
        RandomNumbers(seed)
    }

    /// 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform between `low` and `high`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// An index below `count`, which must not be 0.
    pub fn index(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    /// True with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.uniform(0.0, 1.0) < probability
    }

    fn vector(&mut self, extent: f64) -> [f64; 3] {
        [0; 3].map(|_| self.uniform(-extent, extent))
    }
}

/// The URDF of a random robot: a branching tree of joints of all types, with physically consistent inertias.
pub fn random_urdf(seed: u64, options: &RandomTreeOptions) -> String {
    let random = &mut RandomNumbers::new(seed);
    let mut links = vec!["base".to_owned()];
    let mut leaders: Vec<String> = Vec::new();
    let mut xml = format!("<robot name=\"random_{seed}\">\n");
    write_link(&mut xml, "base", random);
    for number in 0..options.joints {
        if options.fixed_links && random.chance(0.3) {
            let link = format!("fixed_link_{number}");
            let parent = recent(&links, random);
            write_link(&mut xml, &link, random);
            open_joint(&mut xml, &format!("fixed_{number}"), "fixed", parent, &link, random);
            xml.push_str("  </joint>\n");
            links.push(link);
        }
        let (joint, link) = (format!("joint_{number}"), format!("link_{number}"));
        let kind = ["revolute", "revolute", "continuous", "prismatic"][random.index(4)];
        let parent = recent(&links, random);
        write_link(&mut xml, &link, random);
        open_joint(&mut xml, &joint, kind, parent, &link, random);
        write_motion(&mut xml, kind, random);
        if options.mimic && !leaders.is_empty() && random.chance(0.3) {
            let leader = &leaders[random.index(leaders.len())];
            let (multiplier, offset) = (random.uniform(-1.5, 1.5), random.uniform(-0.5, 0.5));
            let _ = writeln!(
                xml,
                "    <mimic joint=\"{leader}\" multiplier=\"{multiplier}\" offset=\"{offset}\"/>"
            );
        }
        leaders.push(joint);
        xml.push_str("  </joint>\n");
        links.push(link);
    }
    xml.push_str("</robot>\n");
    xml
}

/// A random robot: [`random_urdf`] read as a tree.
///
/// # Errors
/// [`UrdfError::NoMovingJoints`] for a fixed base without joints.
pub fn random_tree(seed: u64, options: &RandomTreeOptions) -> Result<Tree, UrdfError> {
    let reading = UrdfOptions { floating_base: options.floating_base, ..UrdfOptions::default() };
    Ok(read_urdf(&random_urdf(seed, options), &reading)?.tree)
}

/// A random state of the robot: inside its joint limits (±π where there are none), speeds and accelerations
/// up to 2 rad/s and 5 rad/s².
pub fn random_state(tree: &Tree, random: &mut RandomNumbers) -> RandomState {
    let mut q = Vec::with_capacity(tree.configuration_size());
    if tree.is_floating() {
        q.extend(random.vector(1.0));
        let quaternion: [f64; 4] = loop {
            let candidate = [0; 4].map(|_| random.uniform(-1.0, 1.0));
            let norm = candidate.iter().map(|x| x * x).sum::<f64>().sqrt();
            // Points outside the ball would favour the cube's diagonals; those near the centre lose digits.
            if (0.1..=1.0).contains(&norm) {
                break candidate.map(|x| x / norm);
            }
        };
        q.extend(quaternion);
    }
    for joint in 0..tree.joint_count() {
        let body = tree.joint(joint);
        let reach = if body.joint_type == JointType::Prismatic { 1.0 } else { std::f64::consts::PI };
        q.push(random.uniform(body.limits.lower.max(-reach), body.limits.upper.min(reach)));
    }
    let mut uniform = |extent: f64| -> Vec<f64> {
        (0..tree.velocity_size()).map(|_| random.uniform(-extent, extent)).collect()
    };
    RandomState { q, v: uniform(2.0), a: uniform(5.0) }
}

/// One of the last links, so that chains are long but branch.
fn recent<'a>(links: &'a [String], random: &mut RandomNumbers) -> &'a str {
    let back = if random.chance(0.75) { 1 } else { 1 + random.index(links.len().min(6)) };
    &links[links.len() - back]
}

fn write_link(xml: &mut String, name: &str, random: &mut RandomNumbers) {
    // The inertia of a cloud of point masses is always that of a real body.
    let points = [0; 5].map(|_| (random.uniform(0.1, 1.0), Vec3(random.vector(0.2))));
    let cloud = points.iter().fold(Inertia::zero(), |sum, &(mass, point)| {
        sum + Inertia::from_center_of_mass(mass, point, Mat3::constant([[0.0; 3]; 3]))
    });
    let center = cloud.moment.scale(1.0 / cloud.mass);
    let i = cloud.tensor_about_center_of_mass(center).0;
    let ([x, y, z], [roll, pitch, yaw]) = (center.0, random.vector(1.5));
    let _ = writeln!(
        xml,
        "  <link name=\"{name}\"><inertial><origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/><mass value=\"{}\"/>\
         <inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/></inertial></link>",
        cloud.mass, i[0][0], i[0][1], i[0][2], i[1][1], i[1][2], i[2][2]
    );
}

fn open_joint(
    xml: &mut String,
    name: &str,
    kind: &str,
    parent: &str,
    child: &str,
    random: &mut RandomNumbers,
) {
    let ([x, y, z], [roll, pitch, yaw]) = (random.vector(0.3), random.vector(1.5));
    let _ = writeln!(
        xml,
        "  <joint name=\"{name}\" type=\"{kind}\">\n    <parent link=\"{parent}\"/><child link=\"{child}\"/>\
         <origin xyz=\"{x} {y} {z}\" rpy=\"{roll} {pitch} {yaw}\"/>"
    );
}

fn write_motion(xml: &mut String, kind: &str, random: &mut RandomNumbers) {
    let [x, y, z] = match random.index(4) {
        0 => [1.0, 0.0, 0.0],
        1 => [0.0, -1.0, 0.0],
        2 => [0.0, 0.0, 1.0],
        _ => [random.uniform(0.2, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)],
    };
    let _ = writeln!(xml, "    <axis xyz=\"{x} {y} {z}\"/>");
    let range = if kind == "prismatic" { 0.5 } else { 2.5 };
    let (lower, upper) = (random.uniform(-range, 0.0), random.uniform(0.1 * range, range));
    let (effort, velocity) = (random.uniform(10.0, 200.0), random.uniform(1.0, 10.0));
    let _ = match kind {
        "continuous" => writeln!(xml, "    <limit effort=\"{effort}\" velocity=\"{velocity}\"/>"),
        _ => writeln!(
            xml,
            "    <limit lower=\"{lower}\" upper=\"{upper}\" effort=\"{effort}\" velocity=\"{velocity}\"/>"
        ),
    };
    let (damping, friction) = (random.uniform(0.0, 2.0), random.uniform(0.0, 2.0));
    let _ = writeln!(xml, "    <dynamics damping=\"{damping}\" friction=\"{friction}\"/>");
}
