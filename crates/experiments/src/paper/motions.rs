//! The motion dataset: retargeted once, then read.

use super::subject::Subject;
use crate::environment;
use crate::retarget::database::{c3d_files, embedded, two_handed};
use anyhow::{Context, ensure};
use phiw::arguments::{Derivatives, MotionFormat, RetargetArguments};
use phiw::console::Console;
use phiw_curriculum::motion::Motion;
use phiw_telemetry::{Recording, TorqueColumns};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Where motions come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Source {
    /// The synthetic motions of the paper's twelve tasks.
    Embedded,
    /// The seated set of the shared data: two-handed motions made of its trials, and single trials up to the
    /// paper's 110.
    UeAdl,
}

/// Seed of the embedded motions.
const SEED: u64 = 1;
/// Motions taken, and of them held out for validation, as in the paper.
const TAKEN: usize = 110;
const HELD_OUT: usize = 12;

/// All motions of an experiment.
pub struct Motions {
    /// Those to choose from.
    pub identification: Vec<Motion>,
    /// Those to validate on.
    pub validation: Vec<Motion>,
    /// A number that tells these motions from others.
    pub digest: String,
}

impl Motions {
    /// The motions of a folder.
    ///
    /// # Errors
    /// One does not read.
    pub fn of_folder(folder: &Path, subject: &Subject) -> anyhow::Result<Self> {
        let mut files: Vec<PathBuf> = Vec::new();
        for entry in folder.read_dir().with_context(|| folder.display().to_string())? {
            let path = entry?.path();
            if path.extension().is_some_and(|extension| extension == "csv") {
                files.push(path);
            }
        }
        files.sort();
        ensure!(files.len() > HELD_OUT, "{} has {} motions, which is too few", folder.display(), files.len());
        Self::of_files(&files, subject)
    }

    fn of_files(files: &[PathBuf], subject: &Subject) -> anyhow::Result<Self> {
        let joints = subject.moved_joints();
        let mut digest = Sha256::new();
        let mut motions = Vec::new();
        for file in files {
            digest.update(std::fs::read(file)?);
            let recording = Recording::from_csv(file, &joints, TorqueColumns::Absent)?;
            let name = name(file);
            let motion = Motion::from_recording(&name, task(&name), &recording)?;
            motions.push(match &subject.standing {
                Some(standing) => standing.with_legs(&motion)?,
                None => motion,
            });
        }
        let digest: String = digest.finalize().iter().take(8).map(|byte| format!("{byte:02x}")).collect();
        Ok(Self::split(motions, digest))
    }

    /// The motions of a source, retargeted into `folder` unless they are there.
    ///
    /// # Errors
    /// A recording is not there, or can not be retargeted.
    pub fn retargeted(
        source: Source,
        per_task: Option<usize>,
        subject: &Subject,
        folder: &Path,
        console: &Console,
    ) -> anyhow::Result<Self> {
        let temporary = tempfile::tempdir()?;
        let mut c3d = match source {
            Source::Embedded => embedded(SEED, temporary.path())?,
            Source::UeAdl => seated(temporary.path())?,
        };
        if let Some(most) = per_task {
            let mut counts: BTreeMap<String, usize> = BTreeMap::new();
            c3d.retain(|file| {
                let count = counts.entry(task(&name(file)).to_owned()).or_default();
                *count += 1;
                *count <= most
            });
        }
        ensure!(c3d.len() > HELD_OUT, "{} motions are too few", c3d.len());
        println!(
            "retargeting {} motions into {} (those that are there are kept)",
            c3d.len(),
            folder.display()
        );
        let arguments = RetargetArguments {
            urdf: subject.urdf.clone(),
            c3d: c3d.clone(),
            map: None,
            hold: subject.hold.clone(),
            torso_from_reach: source == Source::UeAdl,
            velocity_limits: false,
            interval: 0.2,
            derivatives: Derivatives::Analytic,
            format: MotionFormat::Csv,
            out: folder.to_owned(),
            quiet: true,
        };
        let outcome = phiw::retarget::retarget(&arguments, console)?;
        console.finish();
        for failure in &outcome.failures {
            println!("left out: {}", failure.reason);
        }
        // Of these alone: the folder may hold others, of earlier runs.
        let mut files: Vec<PathBuf> =
            c3d.iter().map(|file| folder.join(format!("{}.csv", name(file)))).collect();
        files.retain(|file| file.is_file());
        files.sort();
        Self::of_files(&files, subject)
    }

    /// One motion of each task is held out, the last, until there are enough; then others, evenly.
    fn split(motions: Vec<Motion>, digest: String) -> Self {
        let mut last: BTreeMap<&str, usize> = BTreeMap::new();
        motions.iter().enumerate().for_each(|(index, motion)| {
            last.insert(&motion.task, index);
        });
        let mut held: Vec<usize> = last.into_values().take(HELD_OUT).collect();
        let stride = motions.len() / HELD_OUT;
        let evenly = (0..).map(|k: usize| (k * stride + stride / 2) % motions.len());
        for index in evenly.take(motions.len()) {
            if held.len() < HELD_OUT && !held.contains(&index) {
                held.push(index);
            }
        }
        let (mut identification, mut validation) = (Vec::new(), Vec::new());
        for (index, motion) in motions.into_iter().enumerate() {
            if held.contains(&index) { &mut validation } else { &mut identification }.push(motion);
        }
        Motions { identification, validation, digest }
    }
}

/// The name of the motion in a file.
fn name(file: &Path) -> String {
    file.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// What is before the first `_`; of the seated set's `ADL001DR1` the letter after the subject.
fn task(name: &str) -> &str {
    match name.strip_prefix("ADL").and_then(|rest| rest.get(3..4)) {
        Some("A") => "reach across",
        Some("C") => "comb",
        Some("D") => "drink",
        Some("F") => "reach forward",
        _ => name.split('_').next().unwrap_or(name),
    }
}

/// The set's folder as C3D files: two-handed motions, then single trials. Static trials lie beside both.
fn seated(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let set = environment::workspace_root()?.join("../shared/data/motions/ue_adl/c3d");
    ensure!(set.is_dir(), "{} is not there: choose --dataset embedded, or --motions", set.display());
    let mut taken = two_handed(&set, folder)?;
    let right = |file: &PathBuf| file.file_stem().is_some_and(|name| name.to_string_lossy().ends_with("R1"));
    let single = c3d_files(&set)?.into_iter().filter(right);
    taken.extend(single.take(TAKEN.saturating_sub(taken.len())));
    Ok(taken)
}
