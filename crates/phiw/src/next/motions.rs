//! The motions to choose from: a folder of logs without torques, as `phiw retarget` writes them.

use crate::Error;
use phiw_curriculum::CurriculumError;
use phiw_curriculum::motion::{Motion, MotionDataset, StepTolerance};
use phiw_dynamics::{JointType, Tree};
use phiw_effects::SignalRanges;
use phiw_identification::{IdentificationError, Progress};
use phiw_telemetry::{Recording, Survey, TorqueColumns};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// A joint that moves less than this in all motions stands still \[rad, m\].
const STANDING_STILL: f64 = 1e-3;

/// The motions, and where they come from.
pub struct Motions {
    /// The motions, by name.
    pub dataset: MotionDataset,
    /// Their files, in the same order; slower versions come after all of them, in the same order again.
    pub files: Vec<PathBuf>,
    /// What signals they have.
    pub ranges: SignalRanges,
}

impl Motions {
    /// The same with slower versions of all motions after them.
    pub fn with_slower(self, times: &[f64]) -> Result<Self, Error> {
        Ok(Motions { dataset: self.dataset.with_slower(times)?, ..self })
    }

    /// The file that a motion of the dataset comes from.
    pub fn file(&self, motion: usize) -> &Path {
        &self.files[motion % self.files.len()]
    }
}

/// Reads every CSV file of the folder, in the order of their names.
///
/// # Errors
/// A motion cannot be read, or a joint stands still in all of them.
pub fn read(folder: &Path, tree: &Tree, progress: Progress<'_>) -> Result<Motions, Error> {
    let (motions, surveys) = read_with_surveys(folder, tree, progress)?;
    check_excitation(folder, tree, &surveys)?;
    Ok(motions)
}

/// The same where joints may stand still in all of them.
///
/// # Errors
/// A motion cannot be read.
pub fn read_all(folder: &Path, tree: &Tree, progress: Progress<'_>) -> Result<Motions, Error> {
    Ok(read_with_surveys(folder, tree, progress)?.0)
}

fn read_with_surveys(
    folder: &Path,
    tree: &Tree,
    progress: Progress<'_>,
) -> Result<(Motions, Vec<Survey>), Error> {
    let entries =
        std::fs::read_dir(folder).map_err(|source| Error::Unreadable { path: folder.to_owned(), source })?;
    let hidden = |path: &Path| path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let mut files: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.extension().is_some_and(|extension| extension == "csv") && !hidden(path));
    files.sort();
    if files.is_empty() {
        return Err(Error::NoMotions { folder: folder.to_owned() });
    }
    let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
    let speed_limits: Vec<f64> =
        (0..tree.joint_count()).map(|joint| tree.joint(joint).limits.velocity).collect();
    let (done, total) = (AtomicU64::new(0), files.len() as u64);
    let read = |path: &PathBuf| {
        let log = |source| Error::from(IdentificationError::from(source));
        let recording = Recording::from_csv(path, &joints, TorqueColumns::Absent).map_err(log)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        let wrong = |source: CurriculumError| Error::Motion { path: path.clone(), source: Box::new(source) };
        let motion = Motion::from_recording(&name, "", &recording).map_err(wrong)?;
        motion.check_steps(&joints, &speed_limits, &StepTolerance::default()).map_err(wrong)?;
        progress("reading motions", done.fetch_add(1, Ordering::Relaxed) + 1, total);
        Ok((motion, recording.survey().map_err(log)?))
    };
    let read: Result<Vec<(Motion, Survey)>, Error> = files.par_iter().map(read).collect();
    let (motions, surveys): (Vec<Motion>, Vec<Survey>) = read?.into_iter().unzip();
    let ranges = SignalRanges::of_surveys(&surveys);
    Ok((Motions { dataset: MotionDataset::new(joints.len(), motions)?, files, ranges }, surveys))
}

/// What no motion moves, no motion can tell: every condition number would be infinite, and the choice
/// arbitrary.
fn check_excitation(folder: &Path, tree: &Tree, surveys: &[Survey]) -> Result<(), Error> {
    for joint in 0..tree.joint_count() {
        let travel = surveys.iter().map(|survey| survey.joints[joint].travel()).fold(0.0, f64::max);
        if travel < STANDING_STILL {
            let body = tree.joint(joint);
            return Err(Error::JointStandsStill {
                folder: folder.to_owned(),
                joint: body.joint.clone(),
                travel,
                unit: if body.joint_type == JointType::Prismatic { "m" } else { "rad" },
                position: surveys.first().map_or(0.0, |survey| survey.joints[joint].q_mean),
            });
        }
    }
    Ok(())
}
