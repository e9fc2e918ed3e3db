//! `cargo xtask synthetic-log`: a log as long as wanted.
//!
//! # What it asks
//!
//! Whether memory grows with the length of a log. It makes the log; `phiw identify` on it gives the answer.
//!
//! # How it is run
//!
//! `cargo xtask synthetic-log --out target/long.csv --rows 5000000`, then `phiw identify` with that log.
//!
//! # What it prints
//!
//! The paths of the log and of the robot's URDF.
//!
//! # Where results go
//!
//! The log goes where `--out` says. A robot of other than 18 joints is a random one, and its URDF is written
//! beside the log.

use crate::environment;
use crate::run::synthetic::Plant;
use anyhow::ensure;
use phiw_dynamics::Tree;
use phiw_dynamics::random_tree::{RandomTreeOptions, random_urdf};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf, read_urdf_file};
use std::path::PathBuf;

/// Command line of `cargo xtask synthetic-log`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Rows of the log.
    #[arg(long, default_value_t = 5_000_000)]
    rows: u64,
    /// Joints of the robot; with 18 it is models/upper_body18.urdf, else a random one, written beside the
    /// log.
    #[arg(long, default_value_t = 18)]
    joints: usize,
    /// Rows a second.
    #[arg(long, default_value_t = 500.0)]
    rate: f64,
    /// Seed of motion and noise.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// The log.
    #[arg(long)]
    out: PathBuf,
}

/// Writes the log, in constant memory.
///
/// # Errors
/// The robot cannot be read, or the log not written.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.rate > 0.0, "--rate {} is no rate", arguments.rate);
    let (tree, urdf) = robot(arguments)?;
    let bar = indicatif::ProgressBar::new(arguments.rows);
    let mut progress = |row| bar.set_position(row);
    Plant::new(tree).write_log(
        &arguments.out,
        arguments.seed,
        arguments.rows,
        arguments.rate,
        &mut progress,
    )?;
    bar.finish_and_clear();
    println!("{}, of the robot {}", arguments.out.display(), urdf.display());
    Ok(())
}

fn robot(arguments: &Arguments) -> anyhow::Result<(Tree, PathBuf)> {
    let model = environment::workspace_root()?.join("models/upper_body18.urdf");
    if arguments.joints == 18 {
        return Ok((read_urdf_file(&model, &UrdfOptions::default())?.tree, model));
    }
    let xml = random_urdf(
        arguments.seed,
        &RandomTreeOptions { joints: arguments.joints, ..RandomTreeOptions::default() },
    );
    let path = arguments.out.with_extension("urdf");
    std::fs::write(&path, &xml)?;
    Ok((read_urdf(&xml, &UrdfOptions::default())?.tree, path))
}
