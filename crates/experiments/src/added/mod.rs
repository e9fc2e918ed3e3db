//! `cargo xtask added`: effects of known form and size, added to the torques of measured logs.
//!
//! # What it asks
//!
//! Whether `phiw explain` finds an effect in a real robot's log, beside all that this robot has anyway: its
//! own noise, its own motion, frictions that nobody has a formula for. Robots of our own making flatter a
//! tracer; here all but one effect is measured. The motion is what it was, and to make it, a robot with the
//! effect needs the torque that is added: of inverse dynamics nothing else changes.
//!
//! # How it is run
//!
//! `cargo xtask added`, for the robots in `../shared/data/logs` that `--robot` names. Each effect is added to
//! each joint alone, with `--share` of the joint's torque (RMS). `--kind` and `--joint` choose among them.
//!
//! # What it prints
//!
//! The names that the robot has as it is. Then, for each effect and joint, what became of it: it is named, or
//! what forms.rs calls equal to it is; it is among the rivals of a name on its joint, or among the
//! refinements; it is missed. "Absorbed" is what the declared model takes up (a rotor on an axis whose
//! inertia is free), and "there" what its joint has as a name or a refinement as it is: neither counts. Names
//! that neither the robot has as it is nor the effect brings are listed beside.
//!
//! # Where results go
//!
//! To standard output and, as `added.md`, into `target/added` below the working directory, or where `--out`
//! says. The logs and reports of each effect are in a folder there.

mod forms;
mod log;
mod outcome;

use crate::consistent::robots::{Robot, robots};
use crate::environment;
use crate::undeclared::report_file::Report;
use anyhow::{Context, ensure};
use forms::{Form, Scale};
use log::MeasuredLog;
use outcome::{Outcome, Traced, table};
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Command line of `cargo xtask added`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Robots, by the names of their folders.
    #[arg(long, value_delimiter = ',', default_value = "tx40,emps")]
    robot: Vec<String>,
    /// Effects that are declared; `nothing` for none.
    #[arg(long, value_delimiter = ',', default_value = "viscous_friction,coulomb_friction,rotor_inertia")]
    declare: Vec<String>,
    /// Only these effects.
    #[arg(long, value_delimiter = ',')]
    kind: Vec<Form>,
    /// Only these joints.
    #[arg(long, value_delimiter = ',')]
    joint: Vec<String>,
    /// RMS of the added torque over that of its joint's torque.
    #[arg(long, default_value_t = 0.25)]
    share: f64,
    /// Logs at a time, each traced by one thread.
    #[arg(long, default_value_t = 2)]
    jobs: usize,
    /// The tracer (default: build it from this workspace).
    #[arg(long, value_name = "PATH")]
    phiw: Option<PathBuf>,
    /// Where logs, reports and `added.md` go.
    #[arg(long, value_name = "DIR", default_value = "target/added")]
    out: PathBuf,
}

/// Runs the task.
///
/// # Errors
/// A robot is not there, a log cannot be read or written, or the tracer fails.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.share > 0.0, "--share must be above zero");
    let program = match &arguments.phiw {
        Some(path) => path.canonicalize().with_context(|| path.display().to_string())?,
        None => environment::release_binary()?,
    };
    let logs = environment::workspace_root()?.join("../shared/data/logs");
    let all = robots(&logs)?;
    let mut pages = Vec::new();
    for name in &arguments.robot {
        let folder = |robot: &Robot| robot.urdf.parent().and_then(Path::file_name).map(OsStr::to_owned);
        let Some(robot) = all.iter().find(|robot| folder(robot).is_some_and(|folder| folder == **name))
        else {
            println!("skipped: {name}, of which {} has no logs", logs.display());
            continue;
        };
        let page = of_robot(arguments, &program, name, robot).with_context(|| name.clone())?;
        println!("{page}");
        pages.push(page);
    }
    let path = arguments.out.join("added.md");
    std::fs::write(&path, pages.join("\n")).with_context(|| path.display().to_string())
}

/// One robot as it is, and with each effect on each joint.
fn of_robot(arguments: &Arguments, program: &Path, name: &str, robot: &Robot) -> anyhow::Result<String> {
    let read = |paths: &[PathBuf]| -> anyhow::Result<Vec<MeasuredLog>> {
        paths.iter().map(|path| MeasuredLog::read(path)).collect()
    };
    let [training, held_out] = [read(&robot.train)?, read(&robot.validate)?];
    let tracer = Tracer { program, urdf: &robot.urdf, declared: &arguments.declare };
    let folder = arguments.out.join(name);
    let as_it_is = tracer.run(&robot.train, &robot.validate, &folder.join("as_it_is"))?;
    let joints = training.first().context("no training log")?.joints();
    for joint in &arguments.joint {
        ensure!(joints.contains(joint), "no joint {joint:?}; there are {}", joints.join(", "));
    }
    let wanted = |joint: &&String| arguments.joint.is_empty() || arguments.joint.contains(joint);
    let forms = if arguments.kind.is_empty() { Form::ALL.to_vec() } else { arguments.kind.clone() };
    let cases: Vec<(Form, usize)> = forms
        .into_iter()
        .filter(|form| *form != Form::TransmissionCoupling || joints.len() > 1)
        .flat_map(|form| joints.iter().filter(wanted).map(move |joint| (form, joint)))
        .filter_map(|(form, joint)| Some((form, joints.iter().position(|other| other == joint)?)))
        .collect();

    let run_case = |&(form, joint): &(Form, usize)| -> anyhow::Result<Traced> {
        let own = folder.join(format!("{}.{}", form.kind(), joints[joint]));
        let traced = |outcome| Traced { form, joint: joints[joint].clone(), outcome, report: None };
        if outcome::has(&as_it_is, form.kind(), &joints[joint]) {
            return Ok(traced(Outcome::There));
        }
        let scale = Scale::of(form, joint, &training, arguments.share);
        let write = |logs: &[MeasuredLog], paths: &[PathBuf], mut before: f64| -> anyhow::Result<_> {
            let mut written = Vec::new();
            for (log, path) in logs.iter().zip(paths) {
                let target = own.join(path.file_name().context("a log without a name")?);
                let added = scale.torque(log, before);
                log.write_with(joint, &added, &target)?;
                before += log.duration();
                written.push(target.canonicalize()?);
            }
            Ok((written, before))
        };
        std::fs::create_dir_all(&own).with_context(|| own.display().to_string())?;
        let (train, after) = write(&training, &robot.train, 0.0)?;
        let (validate, _) = write(&held_out, &robot.validate, after)?;
        let report = tracer.run(&train, &validate, &own)?;
        let outcome = outcome::of(&as_it_is, &report, &scale, &joints);
        Ok(Traced { report: Some(report), ..traced(outcome) })
    };
    let traced = at_once(arguments.jobs, &cases, run_case)?;
    Ok(table(name, &as_it_is, &traced))
}

/// Does all cases, several at a time; the results are in their order.
fn at_once<T: Sync, R: Send>(
    jobs: usize,
    cases: &[T],
    run: impl Fn(&T) -> anyhow::Result<R> + Sync,
) -> anyhow::Result<Vec<R>> {
    let progress = indicatif::ProgressBar::new(cases.len() as u64);
    let next = AtomicUsize::new(0);
    let results: Mutex<Vec<(usize, anyhow::Result<R>)>> = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..jobs.max(1) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(case) = cases.get(index) else { break };
                    let result = run(case);
                    if let Ok(mut results) = results.lock() {
                        results.push((index, result));
                    }
                    progress.inc(1);
                }
            });
        }
    });
    progress.finish_and_clear();
    let mut results = results.into_inner().ok().context("a worker died")?;
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

/// The program under test, on one robot.
struct Tracer<'a> {
    program: &'a Path,
    urdf: &'a Path,
    declared: &'a [String],
}

impl Tracer<'_> {
    fn run(&self, train: &[PathBuf], validate: &[PathBuf], out: &Path) -> anyhow::Result<Report> {
        let mut command = Command::new(self.program);
        command.env("RAYON_NUM_THREADS", "1").arg("explain").arg("--urdf").arg(self.urdf);
        command.arg("--train").args(train).arg("--validate").args(validate).arg("--out").arg(out);
        if self.declared != ["nothing"] {
            command.args(["--declare", &self.declared.join(",")]);
        }
        let output = command.output().with_context(|| self.program.display().to_string())?;
        let message = String::from_utf8_lossy(&output.stderr);
        ensure!(output.status.success(), "phiw explain into {}: {}", out.display(), message.trim());
        let path = out.join("report.json");
        let text = std::fs::read_to_string(&path).with_context(|| path.display().to_string())?;
        serde_json::from_str(&text).with_context(|| path.display().to_string())
    }
}
