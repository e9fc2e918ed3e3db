//! The real robots whose logs are at hand.

use std::path::{Path, PathBuf};

/// A robot and its logs.
pub struct Robot {
    /// Name in the table.
    pub name: &'static str,
    /// Its URDF.
    pub urdf: PathBuf,
    /// Logs to fit.
    pub train: Vec<PathBuf>,
    /// Logs held out.
    pub validate: Vec<PathBuf>,
}

/// What a robot's folder holds: its name in the table, the folder, the URDF, and how the names of the logs
/// begin that are fitted and held out.
const SETS: [(&str, &str, &str, &[&str], &str); 7] = [
    ("tx40", "tx40", "tx40.urdf", &["train"], "validate"),
    ("emps", "emps", "emps.urdf", &["train"], "validate"),
    ("kr300, A and B → C", "kr300", "kr300.urdf", &["traj_A", "traj_B"], "traj_C"),
    ("kr300, A → B", "kr300", "kr300.urdf", &["traj_A"], "traj_B"),
    ("schunk", "schunk", "robot.urdf", &["train"], "validate"),
    ("go2", "go2", "robot.urdf", &["train"], "validate"),
    ("xl330", "xl330", "robot.urdf", &["train"], "validate"),
];

/// The robots whose folders are there; says which are not.
///
/// # Errors
/// A folder cannot be listed.
pub fn robots(logs: &Path) -> anyhow::Result<Vec<Robot>> {
    let mut robots = Vec::new();
    for (name, folder, urdf, train, validate) in SETS {
        let folder = logs.join(folder);
        if !folder.is_dir() {
            println!("skipped: {name}, whose logs are absent");
            continue;
        }
        let mut files: Vec<PathBuf> =
            folder.read_dir()?.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>()?;
        files.sort();
        let beginning_with = |beginning: &str| -> Vec<PathBuf> {
            let is_it = |file: &&PathBuf| {
                let name = file.file_name().unwrap_or_default().to_string_lossy();
                name.starts_with(beginning) && name.ends_with(".csv")
            };
            files.iter().filter(is_it).cloned().collect()
        };
        robots.push(Robot {
            name,
            urdf: folder.join(urdf),
            train: train.iter().flat_map(|beginning| beginning_with(beginning)).collect(),
            validate: beginning_with(validate),
        });
    }
    Ok(robots)
}
