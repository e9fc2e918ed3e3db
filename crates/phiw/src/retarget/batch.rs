//! Many recordings, in parallel, each by itself.

use super::motion_file::{MotionFile, Settings};
use crate::Error;
use crate::arguments::RetargetArguments;
use crate::console::Console;
use phiw_bspline_retarget::markers::{Artefact, RecordingError};
use phiw_bspline_retarget::{Calibration, Quality, RetargetError, Retargeter};
use phiw_report::statistics::median;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

/// What became of the recordings.
#[derive(Debug)]
pub struct RetargetOutcome {
    /// What was done, as text for a terminal.
    pub summary: String,
    /// What was taken out of the recordings.
    pub warnings: Vec<String>,
    /// Recordings that could not be retargeted.
    pub failures: Vec<Failure>,
}

/// A recording that could not be retargeted.
#[derive(Debug)]
pub struct Failure {
    /// The recording.
    pub file: PathBuf,
    /// Why: names the file.
    pub reason: Error,
}

/// What became of one recording.
enum Done {
    /// Its quality, its duration \[s\], and what was taken out of the recording.
    Retargeted(Box<Quality>, f64, Vec<Artefact>),
    Kept,
}

/// Retargets everything, then says what became of it.
pub fn run(
    arguments: &RetargetArguments,
    urdf: &str,
    retargeter: &Retargeter,
    console: &Console,
) -> Result<RetargetOutcome, Error> {
    let suffix = retargeter.map().static_suffix.clone();
    let is_static = |file: &&PathBuf| suffix.as_ref().is_some_and(|suffix| stem(file).ends_with(suffix));
    let (statics, motions): (Vec<&PathBuf>, Vec<&PathBuf>) = arguments.c3d.iter().partition(is_static);
    let trials = static_trials(retargeter, &motions, suffix.as_deref());
    let done = AtomicU64::new(0);
    let total = motions.len() as u64;
    let outcomes: Vec<Result<Done, Error>> = motions
        .par_iter()
        .map(|file| {
            if console.is_interrupted() {
                return Err(Error::Interrupted);
            }
            let outcome = one(arguments, urdf, retargeter, file, &trials, suffix.as_deref());
            console.progress("retargeting", done.fetch_add(1, Ordering::Relaxed) + 1, total);
            outcome
        })
        .collect();
    console.finish();
    if console.is_interrupted() {
        return Err(Error::Interrupted);
    }

    let (mut qualities, mut kept, mut seconds) = (Vec::new(), 0, 0.0);
    let (mut failures, mut warnings) = (Vec::new(), Vec::new());
    let trial = |file: &Path| suffix.as_deref().and_then(|suffix| static_trial(file, suffix));
    // What was taken out of a static trial concerns all motions that it calibrates, and is said once.
    let mut untold = trials;
    for (file, outcome) in motions.iter().zip(outcomes) {
        let told = if matches!(outcome, Ok(Done::Kept)) { None } else { trial(file) };
        if let Some((file, trial)) = told.and_then(|trial| untold.remove_entry(&trial)) {
            warnings.extend(in_words(&file, &trial.artefacts));
        }
        match outcome {
            Ok(Done::Retargeted(quality, duration_s, artefacts)) => {
                warnings.extend(in_words(file, &artefacts));
                seconds += duration_s;
                qualities.push(quality);
            }
            Ok(Done::Kept) => kept += 1,
            Err(reason) => failures.push(Failure { file: (*file).clone(), reason }),
        }
    }
    // A command that did nothing has one message, like any other.
    if qualities.is_empty() && kept == 0 {
        return Err(failures.into_iter().next().map_or(Error::NoMotion, |failure| failure.reason));
    }
    let counts = Counts { kept, statics: statics.len(), failed: failures.len(), seconds };
    let summary = summary(arguments, retargeter, &qualities, &counts);
    Ok(RetargetOutcome { summary, warnings, failures })
}

/// How many recordings became what, and how long the motions last.
struct Counts {
    kept: usize,
    statics: usize,
    failed: usize,
    /// \[s\]
    seconds: f64,
}

/// What was done, for a terminal.
fn summary(
    arguments: &RetargetArguments,
    retargeter: &Retargeter,
    qualities: &[Box<Quality>],
    counts: &Counts,
) -> String {
    let mut summary = String::new();
    let torso = if arguments.torso_from_reach {
        "; torso and head from the reach, not from the recordings"
    } else {
        ""
    };
    // Writing to a string does not fail.
    let _ = writeln!(
        summary,
        "{} motions ({:.0} s) in {} with the map `{}`{torso}; {} kept, {} static trials, {} failed",
        qualities.len(),
        counts.seconds,
        arguments.out.display(),
        retargeter.map().name,
        counts.kept,
        counts.statics,
        counts.failed
    );
    if !qualities.is_empty() {
        let median =
            |value: &dyn Fn(&Quality) -> f64| median(&qualities.iter().map(|q| value(q)).collect::<Vec<_>>());
        let most = |value: &dyn Fn(&Quality) -> f64| qualities.iter().map(|q| value(q)).fold(0.0, f64::max);
        let _ = writeln!(
            summary,
            "markers {:.1} mm RMS in the median, {:.1} at most; hands {:.2} % of the arm, {:.2} at most; jerk {:.0} rad/s³; \
             beyond limits {:.1e}",
            1e3 * median(&|q| q.marker_rms_m),
            1e3 * most(&|q| q.marker_rms_m),
            1e2 * median(&|q| q.hand_share()),
            1e2 * most(&|q| q.hand_share()),
            median(&|q| q.jerk_rms),
            most(&|q| q.limit_excess)
        );
    }
    summary
}

/// Warnings of what was taken out of a file.
fn in_words(file: &Path, artefacts: &[Artefact]) -> Vec<String> {
    artefacts.iter().map(|artefact| format!("{}: {artefact}", file.display())).collect()
}

/// What a static trial tells, and what was taken out of it.
struct StaticTrial {
    calibration: Result<Calibration, String>,
    artefacts: Vec<Artefact>,
}

/// By file.
type StaticTrials = BTreeMap<PathBuf, StaticTrial>;

/// The static trials of these recordings.
fn static_trials(retargeter: &Retargeter, motions: &[&PathBuf], suffix: Option<&str>) -> StaticTrials {
    let Some(suffix) = suffix else { return StaticTrials::new() };
    let mut files: Vec<PathBuf> = motions.iter().filter_map(|file| static_trial(file, suffix)).collect();
    files.sort();
    files.dedup();
    let calibrate = |file: PathBuf| {
        let trial = match retargeter.read(&file) {
            Ok((recording, artefacts)) => {
                let calibration = retargeter.calibrate(&recording);
                let calibration = calibration.map_err(|error| format!("{}: {error}", file.display()));
                StaticTrial { calibration, artefacts }
            }
            Err(error) => StaticTrial { calibration: Err(error.to_string()), artefacts: Vec::new() },
        };
        (file, trial)
    };
    files.into_par_iter().map(calibrate).collect()
}

/// The static trial beside a recording that shares the longest beginning of its name.
fn static_trial(file: &Path, suffix: &str) -> Option<PathBuf> {
    let (name, extension) = (stem(file), file.extension()?);
    let ends = name.char_indices().map(|(at, c)| at + c.len_utf8()).collect::<Vec<_>>();
    ends.into_iter().rev().find_map(|end| {
        let other = file.with_file_name(format!("{}{suffix}", &name[..end])).with_extension(extension);
        other.is_file().then_some(other)
    })
}

fn one(
    arguments: &RetargetArguments,
    urdf: &str,
    retargeter: &Retargeter,
    file: &Path,
    trials: &StaticTrials,
    suffix: Option<&str>,
) -> Result<Done, Error> {
    let trial = suffix.and_then(|suffix| static_trial(file, suffix));
    let (recording, artefacts) = retargeter.read(file).map_err(Error::Recording)?;
    let content = std::fs::read(file)
        .map_err(|source| Error::Recording(RecordingError::Unreadable { path: file.to_owned(), source }))?;
    let settings = Settings::new(arguments, urdf, retargeter, &content, trial.as_deref());
    let output = MotionFile::new(&arguments.out, &stem(file), arguments.format);
    if output.holds(&settings) {
        return Ok(Done::Kept);
    }
    let trial = trial.and_then(|trial| trials.get(&trial));
    let calibration = trial
        .map(|trial| trial.calibration.as_ref())
        .transpose()
        .map_err(|reason| Error::StaticTrial { path: file.to_owned(), reason: reason.clone() })?;
    let wrong = |source: RetargetError| Error::Retarget { path: file.to_owned(), source };
    let motion = retargeter.retarget(&recording, calibration).map_err(wrong)?;
    let of_trial = trial.iter().flat_map(|trial| &trial.artefacts);
    let told: Vec<String> = of_trial
        .map(|artefact| format!("static trial: {artefact}"))
        .chain(artefacts.iter().map(Artefact::to_string))
        .collect();
    output.write(&motion, &told, retargeter, &settings, arguments)?;
    Ok(Done::Retargeted(Box::new(motion.quality), recording.duration_s(), artefacts))
}

/// A file's name without folder and extension.
pub(super) fn stem(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}
