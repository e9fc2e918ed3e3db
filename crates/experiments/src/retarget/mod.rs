//! `cargo xtask retarget`: what retargeting can do, measured.
//!
//! # What it asks
//!
//! How fast and how close the robot follows recordings of people. `databases`: whole databases through `phiw
//! retarget`, with marker error, hands, elbows, jerk and time. `animation`: a film of person and robot.
//! `mink`: the same markers through mink, frame by frame. `figure9`: the paper's figure 9, time and final
//! cost of the solvers from several starts.
//!
//! # How it is run
//!
//! `cargo xtask retarget` measures everything, `cargo xtask retarget figure9 databases` some parts. mink is
//! installed from PyPI into a private environment, only if `--mink python3` names a Python. The robot is
//! Torobo and the recordings are the seated set where `../shared/data` has them; otherwise the embedded
//! motions and `models/upper_body18.urdf` stand in, and it is said.
//!
//! # What it prints
//!
//! The sentences of the page, as they are measured.
//!
//! # Where results go
//!
//! Into `retarget` in the build folder, or where `--out` says: `retarget.html` with pictures, and the
//! retargeted motions of each database.

mod animation;
pub(crate) mod database;
mod figure9;
mod mink;
mod mjcf;
mod page;
mod scene;
mod stick_figure;

use crate::environment;
use anyhow::Context;
use scene::Scene;
use std::path::PathBuf;

/// Command line of `cargo xtask retarget`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Starts of each strategy of figure 9.
    #[arg(long, default_value_t = 10)]
    starts: usize,
    /// Seed of the starts and of the embedded motions.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Compare with mink, installed from PyPI by this Python into a private environment.
    #[arg(long, value_name = "PYTHON")]
    mink: Option<String>,
    /// Folder for the page and the motions; by default `retarget` in the build folder.
    #[arg(long)]
    out: Option<PathBuf>,
    /// What is measured; everything by default.
    #[arg(value_enum)]
    parts: Vec<Part>,
}

/// A part of the measurements.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Part {
    /// Whole databases through `phiw retarget`.
    Databases,
    /// A film of person and robot.
    Animation,
    /// mink on the same markers; needs --mink.
    Mink,
    /// Time and cost of the solvers from several starts.
    Figure9,
}

/// Measures, prints and writes a page.
///
/// # Errors
/// A file cannot be read or written.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let scene = Scene::find()?;
    let out = match &arguments.out {
        Some(out) => out.clone(),
        None => environment::target_directory()?.join("retarget"),
    };
    std::fs::create_dir_all(&out).with_context(|| out.display().to_string())?;
    let mut page = page::Page::default();
    let asked = |part| arguments.parts.is_empty() || arguments.parts.contains(&part);
    if asked(Part::Databases) {
        database::measure(&scene, arguments.seed, &out, &mut page)?;
    }
    if asked(Part::Animation) {
        animation::draw(&scene, arguments.seed, &mut page)?;
    }
    match &arguments.mink {
        Some(python) if asked(Part::Mink) => mink::compare(&scene, arguments.seed, python, &mut page)?,
        None if arguments.parts.contains(&Part::Mink) => {
            anyhow::bail!("name the Python to install mink with: --mink python3")
        }
        _ => {}
    }
    if asked(Part::Figure9) {
        figure9::measure(&scene, arguments.starts, arguments.seed, &mut page)?;
    }
    let file = out.join("retarget.html");
    std::fs::write(&file, page.render()).with_context(|| file.display().to_string())?;
    println!("{}", file.display());
    Ok(())
}
