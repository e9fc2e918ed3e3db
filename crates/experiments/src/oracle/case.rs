//! The robots to compare on.

use anyhow::Context;
use phiw_dynamics::Tree;
use phiw_dynamics::random_tree::{RandomTreeOptions, random_urdf};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::{Path, PathBuf};

/// Folders that are searched for URDF files, seen from the workspace.
const FOLDERS: [&str; 3] = ["models", "../shared/data/robots", "../shared/data/logs"];

/// Robots that are compared once more with these joints held.
const HELD: [(&str, &[&str]); 1] = [("torobo20", &["torso/joint_3", "head/joint_1"])];

/// A robot, read in one way.
pub struct Case {
    /// Name of the file, without extension.
    pub robot: String,
    /// The file.
    pub urdf: PathBuf,
    /// How it is read.
    pub options: UrdfOptions,
}

impl Case {
    /// The robot as this workspace reads it.
    ///
    /// # Errors
    /// The file cannot be read as a robot.
    pub fn read(&self) -> anyhow::Result<Tree> {
        let reading = read_urdf_file(&self.urdf, &self.options)
            .with_context(|| format!("{} is not read", self.urdf.display()))?;
        Ok(reading.tree)
    }

    /// What the base does and how many joints are held, in a word or two.
    pub fn base(&self) -> String {
        let base = if self.options.floating_base { "floating" } else { "fixed" };
        match self.options.held.len() {
            0 => base.to_owned(),
            held => format!("{base}, -{held}"),
        }
    }
}

/// Every URDF file of the workspace and of the shared data; says which folders are absent.
///
/// # Errors
/// A folder cannot be listed.
pub fn from_files(workspace: &Path) -> anyhow::Result<Vec<Case>> {
    let mut cases = Vec::new();
    for name in FOLDERS {
        let folder = workspace.join(name);
        if !folder.is_dir() {
            println!("skipped: {name} is absent");
            continue;
        }
        let mut files = Vec::new();
        collect_urdf_files(&folder, &mut files).with_context(|| format!("{name} cannot be listed"))?;
        files.sort();
        cases.extend(files.iter().flat_map(|file| variants(file)));
    }
    Ok(cases)
}

/// Random robots of 5 to 30 joints with fixed links, every other one with mimic joints; their files go into
/// `folder`.
///
/// # Errors
/// A file cannot be written.
pub fn random(folder: &Path, first_seed: u64, count: u64) -> anyhow::Result<Vec<Case>> {
    let mut cases = Vec::new();
    for number in 0..count {
        let seed = first_seed + number;
        let joints = 5 + (number * 25 / count.max(2).saturating_sub(1)) as usize;
        let options = RandomTreeOptions { joints, mimic: number % 2 == 1, ..Default::default() };
        let file = folder.join(format!("random_{seed}.urdf"));
        std::fs::write(&file, random_urdf(seed, &options))?;
        cases.extend(variants(&file));
    }
    Ok(cases)
}

fn collect_urdf_files(folder: &Path, files: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            collect_urdf_files(&path, files)?;
        } else if path.extension().is_some_and(|extension| extension == "urdf") {
            files.push(path);
        }
    }
    Ok(())
}

/// The robot on a fixed and on a floating base, and again with joints held if it is listed in [`HELD`].
fn variants(file: &Path) -> Vec<Case> {
    let robot = file.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
    let held = HELD.iter().find(|(name, _)| *name == robot).map(|&(_, joints)| joints);
    let mut cases = Vec::new();
    for joints in std::iter::once(&[][..]).chain(held) {
        for floating_base in [false, true] {
            let held = joints.iter().map(|joint| (joint.to_string(), 0.0)).collect();
            let options = UrdfOptions { floating_base, held, ..UrdfOptions::default() };
            cases.push(Case { robot: robot.clone(), urdf: file.to_owned(), options });
        }
    }
    cases
}
