//! The C3D reader against ezc3d's, file by file and coordinate by coordinate.

use super::python::{self, Python};
use crate::environment;
use anyhow::Context;
use phiw_bspline_retarget::c3d::{C3d, C3dFormat, Processor, Storage, read_c3d, write_c3d};
use phiw_bspline_retarget::markers::read_recording;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// ezc3d's side of the comparison.
const SCRIPT: &str = include_str!("ezc3d_oracle.py");
/// Folders with C3D files, seen from the workspace.
const FOLDERS: [&str; 2] = ["../shared/data/motions/ue_adl/c3d", "../shared/data/motions/c3d_with_gaps"];
/// Files that ezc3d is asked for at once.
const BATCH: usize = 40;
/// ezc3d keeps points as 32-bit reals: half a unit in the last place.
const TOLERANCE: f64 = 6e-8;

/// What ezc3d says of a file, beside its points.
#[derive(Deserialize)]
struct Answer {
    labels: Vec<String>,
    rate_hz: f64,
    frames: usize,
}

/// Prints the comparison; whether all files are read alike.
///
/// # Errors
/// A file cannot be read by either side.
pub fn compare(python: &Python) -> anyhow::Result<bool> {
    let workspace = environment::workspace_root()?;
    let written = tempfile::tempdir()?;
    let mut sets: Vec<(String, Vec<PathBuf>)> = Vec::new();
    for name in FOLDERS {
        let folder = workspace.join(name);
        if folder.is_dir() {
            sets.push((name.to_owned(), files(&folder)?));
        } else {
            println!("skipped: {name} is absent");
        }
    }
    if let Some(source) = sets.first().and_then(|(_, files)| files.first()) {
        sets.push(("written by us, 2 processors × 2 kinds".to_owned(), rewritten(source, written.path())?));
    }
    println!("\nC3D files against ezc3d {}", python.version("ezc3d")?);
    println!(
        "{:<40} {:>5} {:>10} {:>9}  {:>12} {:>9}",
        "files", "count", "points", "missing", "rel. diff.", "unequal"
    );
    let mut agrees = true;
    for (name, files) in &sets {
        let mut total = Difference::default();
        for batch in files.chunks(BATCH) {
            batch_difference(python, batch, &mut total)?;
        }
        println!(
            "{name:<40} {:>5} {:>10} {:>9}  {:>12.1e} {:>9}",
            files.len(),
            total.points,
            total.missing,
            total.largest,
            total.unequal
        );
        agrees &= total.unequal == 0 && total.largest <= TOLERANCE && total.points > 0;
    }
    Ok(agrees)
}

/// What comes out of comparing files.
#[derive(Default)]
struct Difference {
    points: usize,
    missing: usize,
    /// Largest difference of a coordinate, relative to the largest coordinate of its point.
    largest: f64,
    /// Labels, rates, counts and gaps that are not the same.
    unequal: usize,
}

fn batch_difference(python: &Python, files: &[PathBuf], total: &mut Difference) -> anyhow::Result<()> {
    let folder = tempfile::tempdir()?;
    python.run(SCRIPT, std::iter::once(folder.path()).chain(files.iter().map(PathBuf::as_path)))?;
    for (index, file) in files.iter().enumerate() {
        let ours = read_c3d(&std::fs::read(file)?).with_context(|| file.display().to_string())?;
        let answer = folder.path().join(format!("{index}.json"));
        let answer: Answer = serde_json::from_str(&std::fs::read_to_string(answer)?)?;
        let theirs = python::read_numbers(&folder.path().join(format!("{index}.points")))?;
        let before = total.unequal;
        total.add(&ours, &answer, &theirs);
        if total.unequal > before {
            println!("{}: not read alike", file.display());
        }
    }
    Ok(())
}

impl Difference {
    fn add(&mut self, ours: &C3d, answer: &Answer, theirs: &[f64]) {
        // A label that is absent has a number here, and is left empty there.
        let labels = ours.labels.iter().zip(&answer.labels);
        self.unequal += labels.filter(|(ours, theirs)| ours != theirs && !ours.starts_with('*')).count();
        self.unequal += usize::from((ours.rate_hz - answer.rate_hz).abs() > 1e-6 * answer.rate_hz);
        self.unequal += usize::from(ours.frames() != answer.frames || 3 * ours.points.len() != theirs.len());
        for (ours, theirs) in ours.points.iter().zip(theirs.as_chunks::<3>().0) {
            self.points += 1;
            let gap = |point: &[f64; 3]| point.iter().any(|coordinate| coordinate.is_nan());
            match (gap(ours), gap(theirs)) {
                (true, true) => self.missing += 1,
                (false, false) => {
                    let scale = theirs.iter().fold(1e-12f64, |scale, value| scale.max(value.abs()));
                    let apart = ours.iter().zip(theirs).map(|(ours, theirs)| (ours - theirs).abs());
                    self.largest = self.largest.max(apart.fold(0.0, f64::max) / scale);
                }
                _ => self.unequal += 1,
            }
        }
    }
}

/// A recording with gaps, written in every format of the writer.
fn rewritten(source: &Path, folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut recording = read_recording(source, None)?;
    recording.positions_m.iter_mut().step_by(5).for_each(|position| *position = [f64::NAN; 3]);
    let mut files = Vec::new();
    // ezc3d reads no SGI files.
    for processor in [Processor::Intel, Processor::Dec] {
        for storage in [Storage::Real, Storage::Integer { scale: 0.1 }] {
            let file = folder.join(format!("{}.c3d", files.len()));
            let format = C3dFormat { processor, storage, millimetres: true };
            std::fs::write(&file, write_c3d(&recording, format, &[]))?;
            files.push(file);
        }
    }
    Ok(files)
}

fn files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for entry in folder.read_dir()? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension == "c3d") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}
