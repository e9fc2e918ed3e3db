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
mod stick_figure;

use crate::environment;
use anyhow::Context;
use phiw_bspline_retarget::human::MarkerMap;
use phiw_bspline_retarget::markers::read_recording;
use phiw_bspline_retarget::{RetargetOptions, Retargeter};
use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::PathBuf;

/// Joints of the 20-joint Torobo that the paper's 18-joint robot has not.
const HELD: [&str; 2] = ["torso/joint_3", "head/joint_1"];

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

/// The robot, the person and the files that the measurements are made on.
struct Scene {
    urdf: PathBuf,
    hold: Vec<(String, f64)>,
    tree: Tree,
    /// The folder of the set `ue_adl`, if it is there.
    seated: Option<PathBuf>,
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

impl Scene {
    /// The Torobo and the seated set of the shared data; the project's own robot where they are absent.
    fn find() -> anyhow::Result<Self> {
        let root = environment::workspace_root()?;
        let torobo = root.join("../shared/data/robots/torobo20/torobo20.urdf");
        let (urdf, hold) = if torobo.is_file() {
            (torobo, HELD.map(|joint| (joint.to_owned(), 0.0)).to_vec())
        } else {
            println!("skipped: ../shared/data/robots is absent; the robot is models/upper_body18.urdf");
            (root.join("models/upper_body18.urdf"), vec![])
        };
        let options = UrdfOptions { floating_base: false, held: hold.clone() };
        let tree = read_urdf_file(&urdf, &options)?.tree;
        let seated = Some(root.join("../shared/data/motions/ue_adl/c3d")).filter(|folder| folder.is_dir());
        if seated.is_none() {
            println!("skipped: ../shared/data/motions is absent; the embedded motions stand in");
        }
        Ok(Scene { urdf, hold, tree, seated })
    }

    fn retargeter(&self, map: MarkerMap, options: RetargetOptions) -> anyhow::Result<Retargeter> {
        Ok(Retargeter::new(self.tree.clone(), map, options)?)
    }

    /// A drinking motion of the seated set, or an embedded one.
    fn example(&self, seed: u64, options: RetargetOptions) -> anyhow::Result<Example> {
        let Some(folder) = &self.seated else {
            let retargeter = self.retargeter(MarkerMap::embedded()?, options)?;
            let motion =
                phiw_bspline_retarget::embedded::embedded_motions(seed)?.find(|motion| motion.task == "Pour");
            let motion = motion.context("no embedded motion")?;
            return Ok(Example {
                retargeter,
                recording: motion.recording,
                calibration: None,
                name: motion.name,
            });
        };
        let retargeter = self.retargeter(MarkerMap::ue_adl()?, options)?;
        let calibration = retargeter.calibrate(&read_recording(&folder.join("ADL001_static.c3d"), None)?)?;
        let recording = read_recording(&folder.join("ADL001DR1.c3d"), None)?;
        Ok(Example { retargeter, recording, calibration: Some(calibration), name: "ADL001DR1".to_owned() })
    }
}

/// One recording and what is needed to retarget it.
struct Example {
    retargeter: Retargeter,
    recording: phiw_bspline_retarget::markers::MarkerRecording,
    calibration: Option<phiw_bspline_retarget::Calibration>,
    name: String,
}
