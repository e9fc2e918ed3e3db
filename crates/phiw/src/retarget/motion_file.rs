//! One motion in the result folder: a log and what is known of it.

use super::learning_file::learning_file;
use crate::Error;
use crate::arguments::{Derivatives, MotionFormat, RetargetArguments};
use phiw_bspline_retarget::{Retargeted, Retargeter, backward_differences};
use phiw_result_folder::{Disk, ResultError, replace_vouched};
use phiw_telemetry::{LogColumns, LogWriter};
use serde_json::json;
use sha2::{Digest, Sha256};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Everything that a motion depends on, in one number.
pub struct Settings(String);

impl Settings {
    pub fn new(
        arguments: &RetargetArguments,
        urdf: &str,
        retargeter: &Retargeter,
        recording: &[u8],
        static_trial: Option<&Path>,
    ) -> Self {
        let mut digest = Sha256::new();
        digest.update(env!("CARGO_PKG_VERSION"));
        digest.update(urdf);
        let written = (&arguments.derivatives, &arguments.format);
        let settings = (&arguments.hold, written, retargeter.map(), retargeter.options(), static_trial);
        digest.update(format!("{settings:?}"));
        digest.update(recording);
        if let Some(Ok(trial)) = static_trial.map(fs::read) {
            digest.update(trial);
        }
        Settings(digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

/// `<name>.csv` (or `<name>.npz`) and `<name>.json`.
pub struct MotionFile {
    log: PathBuf,
    facts: PathBuf,
}

impl MotionFile {
    pub fn new(folder: &Path, name: &str, format: MotionFormat) -> Self {
        let file = |extension: &str| folder.join(format!("{name}.{extension}"));
        MotionFile { log: file(format.extension()), facts: file("json") }
    }

    /// Whether the motion is there, made with the same settings.
    pub fn holds(&self, settings: &Settings) -> bool {
        let facts = fs::read_to_string(&self.facts).ok();
        let facts = facts.and_then(|text| serde_json::from_str::<serde_json::Value>(&text).ok());
        self.log.is_file() && facts.is_some_and(|facts| facts["settings"] == settings.0)
    }

    /// Writes both, the facts last: whoever finds them finds the log that they are about.
    pub fn write(
        &self,
        motion: &Retargeted,
        artefacts: &[String],
        retargeter: &Retargeter,
        settings: &Settings,
        arguments: &RetargetArguments,
    ) -> Result<(), Error> {
        let log = log(motion, retargeter, arguments).map_err(unwritable(&self.log))?;
        let mut facts = facts(motion, artefacts, retargeter, settings).to_string();
        facts.push('\n');
        if let Some(folder) = self.log.parent() {
            fs::create_dir_all(folder).map_err(unwritable(folder))?;
        }
        replace_vouched(&Disk, (&self.log, &log), (&self.facts, facts.as_bytes()))?;
        Ok(())
    }
}

fn unwritable(path: &Path) -> impl FnOnce(io::Error) -> Error {
    let path = path.to_owned();
    move |source| ResultError::Unwritable { path, source }.into()
}

/// The robot's motion at the recording's rate.
fn log(motion: &Retargeted, retargeter: &Retargeter, arguments: &RetargetArguments) -> io::Result<Vec<u8>> {
    let joints: Vec<String> = retargeter.robot().tree().joint_names().map(str::to_owned).collect();
    let (count, frames) = (joints.len(), motion.frames);
    let mut signals = motion.signals();
    let [q, qd, qdd] = &mut signals;
    if arguments.derivatives == Derivatives::BackwardDifferences {
        backward_differences(q, count, 1.0 / motion.rate_hz, qd, qdd)
            .map_err(|error| io::Error::other(error.to_string()))?;
    }
    if arguments.format == MotionFormat::Npz {
        return learning_file(retargeter.robot().tree(), motion.rate_hz, q, qd);
    }
    let columns = LogColumns { velocity: true, acceleration: true, ..LogColumns::default() };
    let mut writer = LogWriter::new(Vec::new(), &joints, columns)?;
    for frame in 0..frames {
        let range = frame * count..(frame + 1) * count;
        let row = [&q[range.clone()], &qd[range.clone()], &qdd[range]];
        writer.write(frame as f64 / motion.rate_hz, &row)?;
    }
    writer.finish()
}

fn facts(
    motion: &Retargeted,
    artefacts: &[String],
    retargeter: &Retargeter,
    settings: &Settings,
) -> serde_json::Value {
    let (quality, options) = (&motion.quality, retargeter.options());
    let torso = if options.torso_from_reach { "from_reach" } else { "from_recording" };
    json!({
        "schema": 1,
        "map": retargeter.map().name,
        "torso_and_head": torso,
        "rate_hz": motion.rate_hz,
        "frames": motion.frames,
        "artefacts": artefacts,
        "marker_rms_m": quality.marker_rms_m,
        "elbow_rms_m": quality.elbow_rms_m,
        "hand_rms_m": quality.hand_rms_m,
        "arm_length_m": quality.arm_length_m,
        "limit_excess": quality.limit_excess,
        "peak_speed": quality.peak_speed,
        "peak_speed_share": quality.peak_speed_share,
        "jerk_rms": quality.jerk_rms,
        "cost": {
            "markers": motion.cost.markers,
            "correspondence": motion.cost.correspondence,
            "limits": motion.cost.limits,
            "prior": motion.cost.prior,
        },
        "iterations": motion.iterations,
        "parameters": motion.parameters.iter().cloned().collect::<std::collections::BTreeMap<_, _>>(),
        "settings": settings.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_bspline_retarget::RetargetOptions;
    use phiw_bspline_retarget::human::MarkerMap;
    use phiw_bspline_retarget::markers::MarkerSettings;
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};

    /// A motion made with other bounds of what a spike is was kept as if it were the same.
    #[test]
    fn settings_of_the_markers_were_not_part_of_what_a_motion_depends_on() {
        let urdf = include_str!("../../../../models/upper_body18.urdf");
        let arguments = RetargetArguments {
            urdf: PathBuf::new(),
            c3d: Vec::new(),
            map: None,
            hold: Vec::new(),
            torso_from_reach: false,
            velocity_limits: false,
            interval: 0.2,
            derivatives: Derivatives::Analytic,
            format: MotionFormat::Csv,
            out: PathBuf::new(),
            quiet: true,
        };
        let settings_of = |markers: MarkerSettings, arguments: &RetargetArguments| {
            let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
            let options = RetargetOptions { markers, ..RetargetOptions::default() };
            let retargeter = Retargeter::new(tree, MarkerMap::embedded().unwrap(), options).unwrap();
            Settings::new(arguments, urdf, &retargeter, &[], None).0
        };
        let settings = |markers| settings_of(markers, &arguments);
        let usual = settings(MarkerSettings::default());
        assert_eq!(settings(MarkerSettings::default()), usual);
        let mut spikes = MarkerSettings::default();
        spikes.spikes.smallest = 0.1;
        assert_ne!(settings(spikes), usual);
        assert_ne!(settings(MarkerSettings { person_m: 0.1..=9.0, ..MarkerSettings::default() }), usual);
        // One motion written in two formats has one file of facts, which is about the last.
        let npz = RetargetArguments { format: MotionFormat::Npz, ..arguments.clone() };
        assert_ne!(settings_of(MarkerSettings::default(), &npz), usual);
        assert_ne!(settings(MarkerSettings { frozen_share: 0.8, ..MarkerSettings::default() }), usual);
    }
}
