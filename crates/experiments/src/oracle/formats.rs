//! Logs in the formats that people keep them in, written by the formats' own Python packages: what `phiw
//! identify` makes of each must be what it makes of the CSV.

use super::python::Python;
use crate::environment;
use anyhow::{Context, ensure};
use serde_json::Value;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// What runs in Python.
const SCRIPT: &str = include_str!("formats_oracle.py");
/// The packages, pinned.
const PINNED: &str = "h5py==3.16.0\nmcap==1.6.0\nmcap-ros2-support==0.6.0\nnumpy==2.4.6\npyarrow==26.0.1\nrosbags==0.11.9\nscipy==1.17.1\n";
/// Rows of the short log that is damaged.
const SHORT_ROWS: usize = 2000;
/// Places at which each of its files is cut, and at which a bit is flipped.
const PLACES: usize = 60;
/// Rows of the long logs whose memory is compared.
const LONG: [&str; 3] = ["100000", "1000000", "10000000"];
/// Most that a long log may take over the short one; what is kept of each stretch and of each pass is less.
const GROWTH: f64 = 1.5;

/// A file that Python wrote.
struct Written {
    path: PathBuf,
    /// Name of the CSV with the same content, or `refused: ` and what the message says.
    expected: String,
}

impl Written {
    fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// The parts of `cargo xtask oracle formats`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum FormatsPart {
    /// The same log in all formats, and recordings that are hard to read.
    Same,
    /// Files that are cut and damaged.
    Damage,
    /// Memory over the length of a log.
    Memory,
}

/// Prints what became of each file; whether all is as it should be.
///
/// # Errors
/// Python cannot install the packages or write the files, or phiw does not build.
pub fn compare(python: &str, workspace: &Path, part: Option<FormatsPart>) -> anyhow::Result<bool> {
    let asked = |one| part.is_none_or(|part| part == one);
    let python = Python::install(python, "oracle-formats-python", PINNED)?;
    let phiw = environment::release_binary()?;
    let folder = tempfile::tempdir()?;
    let data = workspace.join("../shared/data/logs/tx40");
    let (log, urdf) = (data.join("train.csv"), data.join("tx40.urdf"));
    if !log.is_file() {
        println!("skipped: {} is absent", log.display());
        return Ok(true);
    }
    let mut agrees = true;
    if asked(FormatsPart::Same) {
        println!("{:<46} report.json against that of the CSV", "log (tx40)");
        for task in ["write", "odd"] {
            let written = write(&python, task, &log, &folder.path().join(task))?;
            agrees &= same(&phiw, &urdf, &written, &folder.path().join(task))?;
        }
    }
    if asked(FormatsPart::Damage) {
        agrees &= damage(&python, &phiw, &urdf, &log, &folder.path().join("damage"))?;
    }
    if asked(FormatsPart::Memory) {
        agrees &= memory(&python, &phiw, &folder.path().join("long"))?;
    }
    Ok(agrees)
}

/// Has Python write a log in many ways.
fn write(python: &Python, task: &str, log: &Path, folder: &Path) -> anyhow::Result<Vec<Written>> {
    let text = python.run(SCRIPT, [task.as_ref(), log.as_os_str(), folder.as_os_str()])?;
    let line = |line: &str| {
        let (path, expected) = line.split_once('\t').context("a line without what is expected")?;
        Ok(Written { path: path.into(), expected: expected.into() })
    };
    text.lines().map(line).collect()
}

/// What `phiw identify` says of a log: its report, or its message and exit status.
fn identify(
    phiw: &Path,
    urdf: &Path,
    log: &Path,
    out: &Path,
) -> anyhow::Result<Result<Value, (Option<i32>, String)>> {
    let output = Command::new(phiw)
        .args(["identify", "--quiet", "--urdf"])
        .args([urdf, Path::new("--train"), log, Path::new("--out"), out])
        .output()?;
    if !output.status.success() {
        let message = String::from_utf8_lossy(&output.stderr).trim().to_owned();
        return Ok(Err((output.status.code(), message)));
    }
    let mut report: Value = serde_json::from_slice(&std::fs::read(out.join("report.json"))?)?;
    // The command line and the log's hash differ; warnings say how the rows came about.
    if let Some(report) = report.as_object_mut() {
        report.remove("phiw");
        report.remove("warnings");
    }
    Ok(Ok(report))
}

fn same(phiw: &Path, urdf: &Path, written: &[Written], folder: &Path) -> anyhow::Result<bool> {
    let mut known: HashMap<String, Value> = HashMap::new();
    let mut agrees = true;
    for file in written {
        let out = folder.join("out").join(file.name());
        let found = identify(phiw, urdf, &file.path, &out)?;
        let verdict = match (file.expected.strip_prefix("refused: "), found) {
            (Some(part), Err((Some(2), message))) if message.contains(part) => {
                "refused, as it should be".into()
            }
            (Some(_), Ok(_)) => "NOT refused".to_owned(),
            (_, Err((status, message))) => format!("FAILED with status {status:?}: {message}"),
            (None, Ok(report)) => {
                if !known.contains_key(&file.expected) {
                    let csv = folder.join(format!("{}.csv", file.expected));
                    let out = folder.join("out").join(&file.expected);
                    let report = identify(phiw, urdf, &csv, &out)?;
                    let report = report.map_err(|(_, message)| anyhow::anyhow!(message))?;
                    known.insert(file.expected.clone(), report);
                }
                let differing = differences(&known[&file.expected], &report);
                match differing.is_empty() {
                    true => "bit-identical".to_owned(),
                    false => format!("DIFFERS in {}", differing.join(", ")),
                }
            }
        };
        agrees &= verdict == "bit-identical" || verdict.starts_with("refused");
        println!("{:<46} {verdict}", file.name());
    }
    Ok(agrees)
}

/// Keys of two reports whose values differ.
fn differences(one: &Value, other: &Value) -> Vec<String> {
    let keys = one.as_object().into_iter().flatten().map(|(key, _)| key);
    keys.filter(|key| one[key.as_str()] != other[key.as_str()]).cloned().collect()
}

/// Cuts and flips bits; whether `phiw check` answers or refuses, and never fails otherwise.
fn damage(python: &Python, phiw: &Path, urdf: &Path, log: &Path, folder: &Path) -> anyhow::Result<bool> {
    std::fs::create_dir_all(folder)?;
    let text = std::fs::read_to_string(log)?;
    let short = folder.join("short.csv");
    let head: Vec<&str> = text.lines().take(SHORT_ROWS + 1).collect();
    std::fs::write(&short, head.join("\n") + "\n")?;
    println!("\n{:<24} {:>6} {:>9} {:>9} {:>7}", "damaged", "cut", "refused", "answered", "failed");
    let mut agrees = true;
    for file in write(python, "write", &short, &folder.join("whole"))? {
        // Of a folder the largest file is damaged.
        let place = largest_file(&file.path)?;
        let whole = std::fs::read(&place)?;
        for cut in [true, false] {
            let mut counts = [0; 3];
            for k in 0..PLACES {
                let at = k * whole.len() / PLACES;
                let mut bytes = whole.clone();
                match cut {
                    true => bytes.truncate(at),
                    false => bytes[at] ^= 1 << (k % 8),
                }
                std::fs::write(&place, bytes)?;
                let mut command = Command::new(phiw);
                command.args(["check", "--quiet", "--urdf"]).arg(urdf).arg(&file.path);
                let output = command.stdout(Stdio::null()).output()?;
                let message = String::from_utf8_lossy(&output.stderr);
                let told = output.status.code() == Some(2)
                    && message.lines().count() == 1
                    && message.contains(&file.name());
                counts[match output.status.code() {
                    Some(0) => 1,
                    Some(2) if told => 0,
                    _ => 2,
                }] += 1;
            }
            std::fs::write(&place, &whole)?;
            let what = if cut { "yes" } else { "no" };
            println!("{:<24} {what:>6} {:>9} {:>9} {:>7}", file.name(), counts[0], counts[1], counts[2]);
            agrees &= counts[2] == 0;
        }
    }
    Ok(agrees)
}

fn largest_file(path: &Path) -> anyhow::Result<PathBuf> {
    if path.is_file() {
        return Ok(path.into());
    }
    let mut found: Option<(u64, PathBuf)> = None;
    for entry in path.read_dir()? {
        let file = largest_file(&entry?.path())?;
        let bytes = file.metadata()?.len();
        if found.as_ref().is_none_or(|(most, _)| bytes > *most) {
            found = Some((bytes, file));
        }
    }
    found.map(|(_, file)| file).with_context(|| format!("{} is empty", path.display()))
}

/// Peak memory of `phiw check` over the length of a log; whether it is flat.
fn memory(python: &Python, phiw: &Path, folder: &Path) -> anyhow::Result<bool> {
    ensure!(cfg!(target_os = "linux"), "peak memory is measured on Linux only");
    let urdf = folder.join("pendulum.urdf");
    std::fs::create_dir_all(folder)?;
    std::fs::write(&urdf, PENDULUM)?;
    println!("\npeak memory of `phiw check` [MB], and time [s]");
    let mut first: HashMap<String, f64> = HashMap::new();
    let mut agrees = true;
    for rows in LONG {
        let place = folder.join(rows);
        let text = python.run(SCRIPT, ["long".as_ref(), rows.as_ref(), place.as_os_str()])?;
        for line in text.lines() {
            let path = Path::new(line.split('\t').next().unwrap_or_default());
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            let start = std::time::Instant::now();
            let peak = python.run(PEAK, [phiw.as_os_str(), urdf.as_os_str(), path.as_os_str()])?;
            let peak: f64 = peak.trim().parse().context("no peak memory")?;
            println!("{name:<20} {rows:>9} rows {peak:>8.1} {:>8.2}", start.elapsed().as_secs_f64());
            let least = *first.entry(name).or_insert(peak);
            agrees &= peak < GROWTH * least;
        }
        std::fs::remove_dir_all(&place)?;
    }
    Ok(agrees)
}

/// Runs `phiw check` and prints its peak memory.
const PEAK: &str = "import resource, subprocess, sys\n\
    phiw, urdf, log = sys.argv[1:]\n\
    subprocess.run([phiw, 'check', '--quiet', '--urdf', urdf, log], check=True)\n\
    print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024)\n";

/// The robot of the long logs.
const PENDULUM: &str = "<robot name=\"pendulum\"><link name=\"base\"/><link name=\"arm\"><inertial><origin xyz=\"0 0 -0.5\"/>\
    <mass value=\"1\"/><inertia ixx=\"0.1\" iyy=\"0.1\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
    <joint name=\"hinge\" type=\"revolute\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 1 0\"/>\
    <limit lower=\"-3\" upper=\"3\" effort=\"50\" velocity=\"20\"/></joint></robot>";
