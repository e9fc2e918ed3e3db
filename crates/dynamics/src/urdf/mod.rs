//! Robots from URDF files, and back.
//!
//! [`read_urdf`] builds the [`Tree`] and reports what in the file should not be trusted ([`Finding`]): a URDF
//! without inertials, with massless links or impossible inertias is read all the same.
//! [`write_identified_urdf`] writes the tree's parameters into the URDF that it came from.

mod assemble;
mod bodies_only;
mod error;
mod finding;
mod geometry;
mod guard;
mod held;
mod inertial;
mod joint;
mod movement;
#[cfg(test)]
mod oracle;
mod reading;
mod robot;
mod snap;
mod source;
mod splice;
mod topology;
mod write;

pub use bodies_only::without_geometry;
pub use error::UrdfError;
pub use finding::Finding;
pub use geometry::{Extent, LinkInBody, LinkShape, Shape, link_shapes};
pub use guard::check as check_xml;
pub use write::{JointFriction, write_identified_urdf};

use crate::Tree;
use phiw_limits::Limits;
use std::path::Path;

/// How to read a URDF.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct UrdfOptions {
    /// The root link floats: it becomes body 0 and keeps its inertia. A `floating` joint alone behind the
    /// root link has the same effect.
    pub floating_base: bool,
    /// Joints that are fixed, and at which position \[rad, m\]; what they carry is merged into their parent.
    /// A name that no joint has may be a pattern of names: `*` stands for any letters, `?` for one.
    pub held: Vec<(String, f64)>,
    /// Angles of the joints' frames within 1e-4 rad of a multiple of π/2 are taken as it, and axes as near to
    /// a coordinate axis as that one: as an identification needs them, since an angle of 1.5708 makes
    /// parameters identifiable that are not.
    pub snap: bool,
}

/// A robot, and what is to be said of its URDF.
#[derive(Clone, Debug)]
pub struct UrdfReading {
    /// The robot.
    pub tree: Tree,
    /// What should not be trusted, in the order of the bodies.
    pub findings: Vec<Finding>,
    /// The joints that are held, by name, and where \[rad, m\].
    pub held: Vec<(String, f64)>,
    /// Number of angles and axes that were off a right angle by rounding, and have been made exact.
    pub snapped: usize,
    /// The links that bodies are made of; those that are fixed to the world are in none.
    pub links: Vec<LinkInBody>,
}

/// Reads a robot from the text of a URDF.
///
/// Joints are in depth-first order, children in the order of the file. Links behind fixed and held joints are
/// merged into the moving link before them; on a fixed base what is fixed to the world is left out, since no
/// joint feels it.
///
/// # Errors
/// The text is not a URDF, its links are not a tree, a joint is of a type that is not supported, a name is
/// unknown, a number is not finite, or nothing moves.
pub fn read_urdf(xml: &str, options: &UrdfOptions) -> Result<UrdfReading, UrdfError> {
    let limits = Limits::default();
    guard::check(xml, &limits)?;
    let mut robot = reading::read(&source::parse(xml)?)?;
    let snapped = if options.snap { snap::snap(&mut robot) } else { 0 };
    let topology = topology::Topology::new(&robot)?;
    let held = held::held_joints(&robot, &options.held)?;
    let movements = movement::movements(&robot, &held)?;
    let joints = movements.iter().filter(|movement| **movement == movement::Movement::Free).count();
    if joints > limits.moving_joints {
        return Err(UrdfError::TooManyJoints { joints, most: limits.moving_joints });
    }
    let (tree, findings, links) = assemble::assemble(&robot, &topology, &movements, options.floating_base)?;
    let named = |(joint, position): (usize, f64)| (robot.joints[joint].name.clone(), position);
    Ok(UrdfReading { tree, findings, held: held.into_iter().map(named).collect(), snapped, links })
}

/// The joints of a URDF that are held, by name, patterns resolved as in [`UrdfOptions::held`].
///
/// # Errors
/// As [`read_urdf`]; a pattern that no joint has, or a joint held in two places.
pub fn held_joints(xml: &str, held: &[(String, f64)]) -> Result<Vec<(String, f64)>, UrdfError> {
    guard::check(xml, &Limits::default())?;
    let robot = reading::read(&source::parse(xml)?)?;
    let named = |(joint, position): (usize, f64)| (robot.joints[joint].name.clone(), position);
    Ok(held::held_joints(&robot, held)?.into_iter().map(named).collect())
}

/// [`read_urdf`] from a file.
///
/// # Errors
/// As [`read_urdf`], or the file cannot be read.
pub fn read_urdf_file(path: impl AsRef<Path>, options: &UrdfOptions) -> Result<UrdfReading, UrdfError> {
    let path = path.as_ref();
    let xml = std::fs::read_to_string(path)
        .map_err(|source| UrdfError::Unreadable { path: path.display().to_string(), source })?;
    read_urdf(&xml, options)
}
