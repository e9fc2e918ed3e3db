//! The first part of `cargo xtask run`: a curriculum over a robot that has something nobody declared.
//!
//! Marker recordings become motions of an 18-joint upper body; a model that is anything between nothing and
//! twice the truth chooses among them, five times, and after each the residual is traced. Beside it the same
//! without tracing, on the same noise.

use super::curriculum_page;
use crate::paper::{
    Arm, Detector, Engine, EstimatorName, Footing, Initial, Job, NoiseIn, RunArguments, RunFile, SecretKind,
    Setup, Source, Subject, SubjectName, do_all,
};
use anyhow::Context;
use phiw::console::Console;
use phiw_estimation::{MotionLog, RobotModel};
use phiw_identification::fitting::TorqueError;
use phiw_plant::PlantEffect;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// What nobody declares. On which joint and how large follows from the seed.
const SECRET: SecretKind = SecretKind::CoulombFriction;
/// Seed of the initial model, the noise and the secret: one that puts it into the right elbow, which works
/// against more than the actuators' noise. (In a neck that hardly moves it would stay hidden.)
const SEED: u64 = 4;
/// Embedded motions of each of the twelve tasks: half of them, to be done in minutes. One of each is held
/// out.
const PER_TASK: usize = 4;
/// Iterations, as in the paper.
const ITERATIONS: usize = 5;
/// Torque noise over the torque limit. The paper's 5 % are three times this elbow's friction: in five motions
/// nobody would see it.
const NOISE: f64 = 0.02;

/// What came out.
pub struct Outcome {
    /// What the runs share.
    pub setup: Setup,
    /// What the plant has.
    pub secret: Vec<PlantEffect>,
    /// The runs: with the model as it was declared, and with the loop closed.
    pub runs: [RunFile; 2],
    /// Error of the initial model, and of both at the end, on the held-out motions.
    pub errors: [TorqueError; 3],
}

/// Runs both, and writes the page into `out`. Returns where it is, and what to print.
///
/// # Errors
/// Files cannot be read or written, or the robot cannot be run.
pub fn run(out: &Path) -> anyhow::Result<(PathBuf, String)> {
    let console = Console::of_terminal(false);
    let subject = Subject::read(SubjectName::UpperBody18, 0.01)?;
    let engine = match Engine::Mujoco.check(&subject.tree) {
        Ok(()) => Engine::Mujoco,
        Err(_) => Engine::Rapier,
    };
    let setup = Setup::new(&arguments(engine, out), out, &console)?;
    let folder = out.join("runs");
    if folder.exists() {
        // What is there may be of another version; runs would go on from it.
        std::fs::remove_dir_all(&folder).with_context(|| folder.display().to_string())?;
    }
    let jobs = [Arm::Curriculum, Arm::Closed].map(|arm| Job {
        arm,
        footing: Footing::Fixed,
        secret: Some(SECRET),
        seed: SEED,
        representative: true,
        backend: engine,
    });
    let done = AtomicU64::new(0);
    let all = (jobs.len() * ITERATIONS) as u64;
    let progress = |count: u64| {
        let done = done.fetch_add(count, Ordering::Relaxed) + count;
        console.progress("curriculum: choose, move, estimate, trace", done, all);
    };
    progress(0);
    do_all(&setup, &jobs, out, None, &progress)?;
    console.finish();
    let mut runs = Vec::with_capacity(jobs.len());
    for job in &jobs {
        let path = RunFile::path(out, job);
        runs.push(RunFile::read(&path)?.with_context(|| path.display().to_string())?);
    }
    let [open, closed]: [RunFile; 2] = runs.try_into().map_err(|_| anyhow::anyhow!("a run is missing"))?;
    let secret = setup.secret(SECRET, SEED)?;
    let logs: Vec<MotionLog> = setup.validation_logs(engine, &secret)?;
    let error = |model: &RobotModel| setup.torque_error(model, &logs);
    let errors = [error(&closed.run.initial)?, error(&open.run.model)?, error(&closed.run.model)?];
    let outcome = Outcome { setup, secret, runs: [open, closed], errors };
    let page = curriculum_page::page(&outcome)?;
    let file = out.join("report.html");
    std::fs::write(&file, page.render()).with_context(|| file.display().to_string())?;
    Ok((file, page.headline.join("\n")))
}

fn arguments(backend: Engine, out: &Path) -> RunArguments {
    RunArguments {
        seeds: 1,
        first_seed: SEED,
        backend,
        robot: SubjectName::UpperBody18,
        dataset: Source::Embedded,
        motions: None,
        per_task: Some(PER_TASK),
        arm: vec![Arm::Curriculum, Arm::Closed],
        footing: vec![Footing::Fixed],
        secret: vec![SECRET],
        control: 0,
        // At this noise the residual has a colour, and a trace needs one effect where a score test takes two.
        detector: Detector::Trace,
        false_fall_rate: None,
        slower: Vec::new(),
        method: None,
        estimator: EstimatorName::Likelihood,
        prior: None,
        relaxation: None,
        noise: NOISE,
        noise_in: NoiseIn::Motion,
        iterations: ITERATIONS,
        initial: Initial::Each,
        shard: None,
        slurm: None,
        stop_after: None,
        out: out.to_owned(),
    }
}
