//! `cargo xtask fleet`: logs reduced by many processes, against one process.
//!
//! # What it asks
//!
//! Whether logs that are reduced apart and merged give the files of one process to the last bit, and what is
//! gained.
//!
//! # How it is run
//!
//! `cargo xtask fleet` makes 64 logs of a simulated robot of 18 joints and identifies it in one process, with
//! one thread and with all, then by `phiw plan`, `phiw reduce` in one to eight processes of one thread each,
//! and `phiw identify --plan`. `--dask` has the processes of a Dask cluster do it as well
//! (`examples/fleet/fleet.py`), `--slurm` an array of Slurm (`examples/fleet/slurm_array.sbatch`, where
//! `sbatch` is installed).
//!
//! # What it prints
//!
//! A table of times by the clock, behind them in brackets the processors' time of the process that takes
//! most, and for each way whether its files are those of one process. It fails where they are not.
//!
//! # Where results go
//!
//! Into `target/fleet`; the table belongs into `docs/results/fleet.md`.

use crate::environment;
use crate::oracle::python::Python;
use crate::run::synthetic::Plant;
use anyhow::{Context, ensure};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf_file};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::Instant;

/// Numbers of processes that reduce.
const PROCESSES: [usize; 4] = [1, 2, 4, 8];
/// Files that must be the same, byte by byte.
const FILES: [&str; 4] = ["model.json", "report.json", "identified.urdf", "identified.xml"];

/// Command line of `cargo xtask fleet`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Logs.
    #[arg(long, default_value_t = 64)]
    logs: u64,
    /// Rows of each log, at 500 Hz.
    #[arg(long, default_value_t = 10_000)]
    rows: u64,
    /// Effects beside the rigid body.
    #[arg(long, default_value = "viscous_friction,coulomb_friction")]
    declare: String,
    /// Also by the processes of a Dask cluster, installed from PyPI into an environment.
    #[arg(long)]
    dask: bool,
    /// Also by an array of Slurm, whose `sbatch` is on the path.
    #[arg(long)]
    slurm: bool,
    /// The Python that makes the environment.
    #[arg(long, default_value = "python3")]
    python: String,
}

/// Makes the logs, identifies in all ways, compares.
///
/// # Errors
/// A step fails, or a way gives other files than one process.
pub fn command(arguments: &Arguments) -> anyhow::Result<()> {
    ensure!(arguments.logs >= PROCESSES.len() as u64, "--logs {} are too few", arguments.logs);
    let fleet = Fleet::make(arguments)?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    println!("| way | plan | reduce | fit | in all | files of one process |\n|---|--:|--:|--:|--:|---|");
    for (threads, out) in [(1, "one_thread"), (threads, "one")] {
        let time = fleet.identify(threads, out)?;
        let same = if out == "one" { fleet.same(out, "one_thread")? } else { "" };
        println!("| one process, threads: {threads} | | | | {time} | {same} |");
    }
    let planned = fleet.plan()?;
    for processes in PROCESSES {
        let reduced = fleet.reduce(processes)?;
        let way = format!("processes of one thread: {processes}");
        fleet.merge(&way, [planned, reduced], &fleet.factors(processes), &format!("merged_{processes}"))?;
    }
    if arguments.slurm {
        let (factors, reduced) = fleet.slurm()?;
        fleet.merge("Slurm, 8 tasks", [planned, reduced], &factors, "slurm")?;
    }
    if arguments.dask {
        let time = fleet.dask(&arguments.python)?;
        let same = fleet.same("dask", "one")?;
        println!("| Dask, {threads} workers | | | | {time} | {same} |");
    }
    Ok(())
}

/// What a step takes.
#[derive(Clone, Copy, Default)]
struct Time {
    /// By the clock \[s\].
    clock: f64,
    /// Of the processors, of that process which takes most \[s\]; not a number where the system does not
    /// tell.
    processor: f64,
}

impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{:.1} s", self.clock)?;
        if self.processor.is_finite() { write!(f, " ({:.1} s)", self.processor) } else { Ok(()) }
    }
}

/// Logs of one robot, and the folder that all happens in.
struct Fleet {
    phiw: PathBuf,
    folder: PathBuf,
    urdf: PathBuf,
    logs: Vec<PathBuf>,
    declare: String,
}

impl Fleet {
    fn make(arguments: &Arguments) -> anyhow::Result<Self> {
        let phiw = environment::release_binary()?;
        let folder = environment::target_directory()?.join("fleet");
        let urdf = environment::workspace_root()?.join("models/upper_body18.urdf");
        std::fs::create_dir_all(&folder)?;
        let plant = Plant::new(read_urdf_file(&urdf, &UrdfOptions::default())?.tree);
        let mut logs = Vec::new();
        for seed in 1..=arguments.logs {
            let log = folder.join(format!("log_{seed:02}.csv"));
            plant.write_log(&log, seed, arguments.rows, 500.0, &mut |_| ())?;
            logs.push(log);
        }
        Ok(Fleet { phiw, folder, urdf, logs, declare: arguments.declare.clone() })
    }

    fn phiw(&self, command: &str, threads: usize) -> Command {
        let mut phiw = Command::new(&self.phiw);
        phiw.arg(command).arg("--quiet").current_dir(&self.folder).stdout(Stdio::null());
        phiw.env("RAYON_NUM_THREADS", threads.to_string());
        phiw
    }

    /// Identifies in one process.
    fn identify(&self, threads: usize, out: &str) -> anyhow::Result<Time> {
        let mut phiw = self.phiw("identify", threads);
        phiw.arg("--urdf").arg(&self.urdf).args(["--declare", &self.declare, "--out", out]);
        timed(|| Ok(vec![phiw.arg("--train").args(&self.logs).spawn()?]))
    }

    fn plan(&self) -> anyhow::Result<Time> {
        let mut phiw = Command::new(&self.phiw);
        phiw.args(["plan", "--quiet", "--urdf"]).arg(&self.urdf).current_dir(&self.folder);
        let declare = ["--declare", &self.declare, "--out", "plan.json"];
        timed(|| Ok(vec![phiw.args(&self.logs).args(declare).spawn()?]))
    }

    fn factors(&self, processes: usize) -> Vec<PathBuf> {
        (0..processes).map(|process| self.folder.join(format!("{processes}_{process}.factor"))).collect()
    }

    /// Reduces all logs, each process its share with one thread.
    fn reduce(&self, processes: usize) -> anyhow::Result<Time> {
        let factors = self.factors(processes);
        let reduce = |(process, factor): (usize, &PathBuf)| {
            let own = self.logs.iter().skip(process).step_by(processes);
            let mut phiw = self.phiw("reduce", 1);
            phiw.args(["--plan", "plan.json"]).args(own).arg("--out").arg(factor).spawn()
        };
        timed(|| Ok(factors.iter().enumerate().map(reduce).collect::<Result<Vec<Child>, _>>()?))
    }

    /// Fits the factors and prints a row of the table.
    fn merge(&self, way: &str, before: [Time; 2], factors: &[PathBuf], out: &str) -> anyhow::Result<()> {
        let threads = std::thread::available_parallelism().map_or(1, usize::from);
        let mut phiw = self.phiw("identify", threads);
        phiw.args(["--plan", "plan.json", "--out", out]).arg("--factors").args(factors);
        let fit = timed(|| Ok(vec![phiw.spawn()?]))?;
        let [plan, reduce] = before;
        let (all, same) = (plan.clock + reduce.clock + fit.clock, self.same(out, "one")?);
        println!("| {way} | {plan} | {reduce} | {fit} | {all:.1} s | {same} |");
        Ok(())
    }

    /// The factors that an array of Slurm makes.
    fn slurm(&self) -> anyhow::Result<(Vec<PathBuf>, Time)> {
        let script = environment::workspace_root()?.join("examples/fleet/slurm_array.sbatch");
        let paths: Vec<String> = self.logs.iter().map(|log| log.display().to_string()).collect();
        std::fs::write(self.folder.join("logs.txt"), paths.join("\n") + "\n")?;
        let mut sbatch = Command::new("sbatch");
        sbatch.env("PHIW", &self.phiw).current_dir(&self.folder).stdout(Stdio::null());
        sbatch.arg("--wait").arg(script).args(["plan.json", "logs.txt", "shards"]);
        let absent = "sbatch cannot be started; install Slurm, or leave out --slurm";
        let time = timed(|| Ok(vec![sbatch.spawn().context(absent)?]))?;
        let files = std::fs::read_dir(self.folder.join("shards"))?;
        let factors = files.map(|file| file.map(|file| file.path())).collect::<Result<_, _>>()?;
        // The tasks are the cluster's, not this program's.
        Ok((factors, Time { processor: f64::NAN, ..time }))
    }

    /// All by a Dask cluster.
    fn dask(&self, python: &str) -> anyhow::Result<Time> {
        let python = Python::install(python, "dask", DASK)?;
        let script = environment::workspace_root()?.join("examples/fleet/fleet.py");
        let script = std::fs::read_to_string(&script).with_context(|| script.display().to_string())?;
        let begin = Instant::now();
        let mut words: Vec<PathBuf> = self.logs.clone();
        words.extend(["--urdf".into(), self.urdf.clone(), "--phiw".into(), self.phiw.clone()]);
        words.extend(["--declare".into(), PathBuf::from(&self.declare)]);
        words.extend(["--out".into(), self.folder.join("dask")]);
        python.run(&script, words)?;
        Ok(Time { clock: begin.elapsed().as_secs_f64(), processor: f64::NAN })
    }

    /// `yes` where two folders hold the same results.
    fn same(&self, out: &str, other: &str) -> anyhow::Result<&'static str> {
        for file in FILES {
            let read = |folder: &str| {
                let path: &Path = &self.folder.join(folder).join(file);
                std::fs::read(path).with_context(|| path.display().to_string())
            };
            ensure!(read(out)? == read(other)?, "{file} in {out} is not that in {other}");
        }
        Ok("yes")
    }
}

/// What the Dask cluster needs.
const DASK: &str = "dask[distributed]==2025.5.1\n";

/// Starts processes, waits for all of them, and says what that takes. All must succeed.
fn timed(start: impl FnOnce() -> anyhow::Result<Vec<Child>>) -> anyhow::Result<Time> {
    let begin = Instant::now();
    let mut processor: f64 = f64::NAN;
    let mut before = processor_time();
    let mut ends = Vec::new();
    // All are waited for before any failure is told, so that none is left running.
    for mut child in start()? {
        ends.push(child.wait());
        let now = processor_time();
        processor = processor.max(now - before);
        before = now;
    }
    for end in ends {
        let end = end?;
        ensure!(end.success(), "a process has failed ({end})");
    }
    Ok(Time { clock: begin.elapsed().as_secs_f64(), processor })
}

/// Processors' time of all processes that were waited for \[s\], as Linux counts it in hundredths; elsewhere
/// not a number.
fn processor_time() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let fields: Vec<&str> = stat.rsplit(')').next().unwrap_or_default().split_whitespace().collect();
    let field = |place: usize| fields.get(place).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN);
    // Fields 16 and 17 of proc(5), of which the first two are before the last bracket.
    0.01 * (field(13) + field(14))
}
