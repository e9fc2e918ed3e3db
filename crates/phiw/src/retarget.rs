//! `phiw retarget`: marker recordings in, motions of the robot out, many files at a time.

mod batch;
mod learning_file;
mod motion_file;

pub use batch::{Failure, RetargetOutcome};

use crate::Error;
use crate::arguments::RetargetArguments;
use crate::console::Console;
use crate::input::read_text;
use crate::output::check_folder;
use crate::robot_file::{RobotText, as_urdf, warning};
use batch::stem;
use phiw_bspline_retarget::human::{MapError, MarkerMap};
use phiw_bspline_retarget::markers::{MarkerRecording, read_recording};
use phiw_bspline_retarget::{RetargetOptions, Retargeter};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_limits::Limits;
use phiw_result_folder::{Disk, Lock, check_inputs, remove_partial_files};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Retargets all recordings: for each a log `<name>.csv` without torques (or `<name>.npz`), and `<name>.json`
/// with what it is worth.
///
/// A file that has been done with the same settings is kept. A file that cannot be done does not stop the
/// others.
///
/// # Errors
/// The robot or the map is wrong, two recordings would go into one file, or no recording can be retargeted at
/// all.
pub fn retarget(arguments: &RetargetArguments, console: &Console) -> Result<RetargetOutcome, Error> {
    check_folder(&arguments.out)?;
    check_names(&arguments.c3d)?;
    let inputs: Vec<PathBuf> =
        std::iter::once(&arguments.urdf).chain(&arguments.c3d).chain(&arguments.map).cloned().collect();
    let result = |file: &PathBuf, extension| arguments.out.join(format!("{}.{extension}", stem(file)));
    let extension = arguments.format.extension();
    let outputs: Vec<PathBuf> =
        arguments.c3d.iter().flat_map(|file| [result(file, extension), result(file, "json")]).collect();
    check_inputs(&inputs, &outputs)?;
    let _place = Lock::acquire(&arguments.out, "phiw retarget")?;
    remove_partial_files(&Disk, &arguments.out);
    let limits = Limits::default();
    let RobotText { urdf, left_out } =
        as_urdf(read_text(&arguments.urdf, limits.urdf_bytes)?, &arguments.urdf)?;
    let options = UrdfOptions { held: arguments.hold.clone(), ..UrdfOptions::default() };
    let reading = read_urdf(&urdf, &options)
        .map_err(|source| Error::Urdf { path: arguments.urdf.clone(), source: Box::new(source) })?;
    let map = match &arguments.map {
        Some(path) => MarkerMap::from_toml(&read_text(path, limits.toml_bytes)?)
            .map_err(|source| Error::Map { path: path.clone(), source })?,
        None => default_map(&arguments.c3d)
            .map_err(|source| Error::Map { path: PathBuf::from("the built-in map"), source })?,
    };
    let mut options = RetargetOptions {
        interval_s: arguments.interval,
        torso_from_reach: arguments.torso_from_reach,
        ..RetargetOptions::default()
    };
    if arguments.velocity_limits {
        options.weights.velocity_limits = options.weights.limits;
    }
    let retargeter = Retargeter::new(reading.tree, map, options)
        .map_err(|source| Error::Robot { path: arguments.urdf.clone(), source })?;
    let mut outcome = batch::run(arguments, &urdf, &retargeter, console)?;
    outcome.warnings.splice(0..0, warning(&left_out));
    Ok(outcome)
}

/// No two recordings may have the same name: their motions would.
fn check_names(files: &[PathBuf]) -> Result<(), Error> {
    let mut names: BTreeMap<String, &PathBuf> = BTreeMap::new();
    for file in files {
        if let Some(first) = names.insert(stem(file), file) {
            return Err(Error::SameName { first: first.clone(), second: file.clone() });
        }
    }
    Ok(())
}

/// The built-in map that names most markers of the first recording that can be read; the first of them where
/// none can.
fn default_map(files: &[PathBuf]) -> Result<MarkerMap, MapError> {
    // Only the names count here, whatever unit the numbers are in.
    let named = |file: &PathBuf| read_recording(file, Some("m")).ok();
    let recording = files.iter().find_map(named);
    let share = |map: &MarkerMap| recording.as_ref().map_or(0.0, |recording| share_named(map, recording));
    let mut maps = MarkerMap::built_in()?.into_iter();
    let first = maps.next().map_or_else(MarkerMap::ue_adl, Ok)?;
    Ok(maps.fold(first, |best, map| if share(&map) > share(&best) { map } else { best }))
}

/// Share of a map's markers that a recording has.
fn share_named(map: &MarkerMap, recording: &MarkerRecording) -> f64 {
    let found = map.names().filter(|name| recording.marker(name).is_some()).count();
    found as f64 / map.names().count().max(1) as f64
}
