//! `cargo xtask run`: the main job, on motions and logs that this program makes itself.
//!
//! # What it asks
//!
//! Whether the whole chain works, from motions and logs to a model with its missing effect found. First a
//! curriculum runs on an 18-joint upper body (`models/upper_body18.urdf`) with an effect that nobody
//! declared: 48 embedded marker recordings are retargeted, five of the motions are chosen and done on a
//! simulated robot, and after each an effect is looked for that the model lacks. Then `phiw explain` works on
//! logs of an arm (`models/puma560.urdf`) whose wrist has a differential that nobody declared. Where logs of
//! a real robot lie beside the workspace (`../shared/data/logs/tx40`), they are explained as well.
//!
//! # How it is run
//!
//! `cargo xtask run`, or `cargo xtask run --open` to see the reports in the browser. The outcome is the same
//! on every machine with the same physics engine, which is MuJoCo where its library is there, and Rapier
//! otherwise. A run that was stopped goes on where it was.
//!
//! # What it prints
//!
//! For the curriculum: the effect that was found, and the errors of torque and parameters before and after.
//! For each explained robot what `phiw explain` prints. The paths of the reports come last.
//!
//! # Where results go
//!
//! Into `out/run` in the workspace, or where `--out` says: `report.html`, `motions/` and `runs/` of the
//! curriculum, and a folder of results for each explained robot (`example/`, `tx40/`).

// These two know each other: curriculum.rs makes the runs and writes their page, which curriculum_page.rs
// puts together from the runs.
mod curriculum;
mod curriculum_page;
pub(crate) mod synthetic;

use crate::environment;
use anyhow::Context;
use phiw::arguments::{ExplainArguments, SessionArguments};
use phiw::console::Console;
use phiw::explain::{command_line, explain};
use phiw::identify::Outcome;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::{Path, PathBuf};
use std::process::Command;
use synthetic::Plant;

/// What an arm with gears is declared to have beside its rigid body.
const DECLARED: [&str; 3] = ["viscous_friction", "coulomb_friction", "rotor_inertia"];
/// Joints of the example whose motors turn with their sum: joint_5 and joint_6.
const DIFFERENTIAL: [usize; 2] = [4, 5];
/// Length of an example log \[s\] and its rows per second.
const EXAMPLE: (f64, f64) = (20.0, 500.0);

/// Command line of `cargo xtask run`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Open the report in the browser.
    #[arg(long)]
    open: bool,
    /// Folder for the results, seen from the workspace.
    #[arg(long, default_value = "out/run")]
    out: PathBuf,
}

/// Runs the curriculum, explains the example, and a real robot where its logs are there.
///
/// # Errors
/// Files cannot be read or written, or the identification fails.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    let root = environment::workspace_root()?;
    let out = root.join(&arguments.out);
    std::fs::create_dir_all(&out).with_context(|| format!("cannot make {}", out.display()))?;
    println!("A curriculum on models/upper_body18.urdf with an effect that nobody declares\n");
    let (report, found) = curriculum::run(&out)?;
    println!("{found}\n");
    let mut reports = vec![report, run(&example(&root, &out)?)?];
    let tx40 = root.join("../shared/data/logs/tx40");
    if tx40.exists() {
        let log = |name: &str| vec![tx40.join(name)];
        reports.push(run(&session(
            &tx40.join("tx40.urdf"),
            log("train.csv"),
            log("validate.csv"),
            out.join("tx40"),
        ))?);
    }
    for report in &reports {
        println!("report: {}", report.display());
    }
    if arguments.open {
        reports.iter().try_for_each(|report| open(report))?;
    }
    Ok(())
}

/// A PUMA-560-like arm on three Fourier motions, two to train on.
fn example(root: &Path, out: &Path) -> anyhow::Result<SessionArguments> {
    let urdf = root.join("models/puma560.urdf");
    let tree = read_urdf_file(&urdf, &UrdfOptions::default())?.tree;
    let plant = Plant::new(tree).with_shared_motor(DIFFERENTIAL);
    let folder = out.join("example");
    std::fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    let mut logs = Vec::new();
    for (seed, name) in [(1, "train_a.csv"), (2, "train_b.csv"), (3, "validate.csv")] {
        let path = folder.join(name);
        let (seconds, rate) = EXAMPLE;
        plant.write_log(&path, seed, (seconds * rate) as u64, rate, &mut |_| ())?;
        logs.push(path);
    }
    let validate = logs.split_off(2);
    Ok(session(&urdf, logs, validate, folder))
}

fn session(urdf: &Path, train: Vec<PathBuf>, validate: Vec<PathBuf>, out: PathBuf) -> SessionArguments {
    let declare = DECLARED.map(str::to_owned).to_vec();
    SessionArguments { urdf: urdf.to_owned(), train, validate, declare, out, ..SessionArguments::default() }
}

fn run(arguments: &SessionArguments) -> anyhow::Result<PathBuf> {
    let arguments = ExplainArguments { session: arguments.clone(), ..ExplainArguments::default() };
    println!("{}\n", command_line(&arguments));
    let Outcome { summary, warnings, report_html, .. } = explain(&arguments, &Console::of_terminal(false))?;
    warnings.iter().for_each(|warning| println!("warning: {warning}"));
    println!("{summary}");
    Ok(report_html)
}

/// Shows a file with what the desktop opens it with.
fn open(path: &Path) -> anyhow::Result<()> {
    let opener = match std::env::consts::OS {
        "macos" => "open",
        "windows" => "explorer",
        _ => "xdg-open",
    };
    Command::new(opener)
        .arg(path)
        .spawn()
        .with_context(|| format!("cannot start {opener}; open {} yourself", path.display()))?;
    Ok(())
}
