//! The robots that the suite is run on.

use crate::Failure;
use phiw_dynamics::inertia::Inertia;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use phiw_dynamics::{Foot, Mat3, Tree, Vec3, World};
use std::path::{Path, PathBuf};

/// A robot of the suite.
#[derive(Clone, Debug)]
pub struct Robot {
    /// The file's name, and how its base is held.
    pub name: String,
    /// The robot.
    pub tree: Tree,
}

/// Every URDF of the workspace's `models`, and of `../shared/data/robots` where that is present; prints which
/// folder is not. A robot whose root link has a mass comes twice: with a fixed and with a floating base; one
/// with mimic joints once more, with these held, for backends that refuse them.
///
/// # Errors
/// A URDF cannot be read.
pub fn robots() -> Result<Vec<Robot>, Failure> {
    let mut robots = robots_in(&models())?;
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/robots");
    for name in ["torobo20", "talos", "g1"] {
        let folder = shared.join(name);
        if folder.is_dir() {
            robots.extend(robots_in(&folder)?);
        } else {
            println!("skipped: shared/data/robots/{name} is not beside the workspace");
        }
    }
    Ok(robots)
}

/// Every URDF in a folder, in the order of their names; as [`robots`].
///
/// # Errors
/// The folder or a URDF cannot be read.
pub fn robots_in(folder: &Path) -> Result<Vec<Robot>, Failure> {
    let entries = std::fs::read_dir(folder)
        .map_err(|error| Failure::Wrong(format!("{}: {error}", folder.display())))?;
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "urdf"));
    files.sort();
    let mut robots = Vec::new();
    for path in files {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        push_bases(&mut robots, &name, &path, &[])?;
        let tree = read(&path, false, &[])?;
        if tree.has_mimic() {
            let followers = tree.bodies().iter().filter(|body| body.mimic);
            let held: Vec<_> = followers.map(|body| (body.joint.clone(), 0.0)).collect();
            push_bases(&mut robots, &format!("{name}, mimic joints held"), &path, &held)?;
        }
    }
    Ok(robots)
}

fn push_bases(
    robots: &mut Vec<Robot>,
    name: &str,
    path: &Path,
    held: &[(String, f64)],
) -> Result<(), Failure> {
    robots.push(Robot { name: format!("{name}, fixed base"), tree: read(path, false, held)? });
    let floating = read(path, true, held)?;
    // A base without mass is singular where the first joint alone turns it.
    if floating.bodies()[0].inertial[0] > 0.0 {
        robots.push(Robot { name: format!("{name}, floating base"), tree: floating });
    }
    Ok(())
}

/// The 18-joint upper body on a pedestal of 30 kg that stands on two soles, each 0.2 m × 0.1 m.
///
/// Its base frame is on the floor when the base is at the origin.
///
/// # Errors
/// The model cannot be read.
pub fn standing_robot() -> Result<(Tree, World), Failure> {
    let mut tree = read(&models().join("upper_body18.urdf"), true, &[])?;
    let pedestal = Inertia::from_center_of_mass(
        30.0,
        Vec3([0.0, 0.0, 0.28]),
        Mat3([[0.9, 0.0, 0.0], [0.0, 0.8, 0.0], [0.0, 0.0, 0.3]]),
    );
    let mut parameters = tree.inertial_parameters();
    parameters[..10].copy_from_slice(&pedestal.parameters());
    tree.set_inertial_parameters(&parameters)?;
    let sole = |y: f64| Foot {
        body: 0,
        sole: [(-0.08, -0.05), (0.12, -0.05), (0.12, 0.05), (-0.08, 0.05)]
            .map(|(x, aside)| [x, y + aside, 0.0])
            .to_vec(),
    };
    Ok((tree, World { feet: vec![sole(0.12), sole(-0.12)], ..World::default() }))
}

fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models")
}

fn read(path: &Path, floating_base: bool, held: &[(String, f64)]) -> Result<Tree, Failure> {
    let options = UrdfOptions { floating_base, held: held.to_vec(), ..UrdfOptions::default() };
    let reading = read_urdf_file(path, &options)
        .map_err(|error| Failure::Wrong(format!("{}: {error}", path.display())))?;
    Ok(reading.tree)
}
