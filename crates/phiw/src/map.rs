//! `phiw map`: a first map of a log's columns, by names, ranges and units.

mod guess;
mod names;
mod text;
mod units;

use crate::output::check_file;
use crate::{Error, session};
use clap::Args;
use guess::Guesses;
use phiw_result_folder::{Disk, Lock, ResultFile, check_inputs, replace_files};
use phiw_telemetry::LogContents;
use std::path::{Path, PathBuf};

/// Arguments of `phiw map`.
#[derive(Clone, Debug, Default, Args)]
pub struct MapArguments {
    /// The robot's URDF, or MuJoCo's MJCF.
    #[arg(long, value_name = "ROBOT.urdf")]
    pub urdf: PathBuf,
    /// A log: CSV, MCAP, ROS bag, LeRobot folder, npz, HDF5 or MAT-file.
    #[arg(value_name = "LOG")]
    pub log: PathBuf,
    /// The topic of a recording with several.
    #[arg(long, value_name = "TOPIC")]
    pub topic: Option<String>,
    /// Joints of the URDF that do not move, at 0 or at a value (rad, m); they need no column in the log. In a
    /// name, * stands for any letters and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = crate::argument_values::held_joint)]
    pub hold: Vec<(String, f64)>,
    /// The map; without it the map is printed.
    #[arg(long, value_name = "MAP.toml")]
    pub out: Option<PathBuf>,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

/// A first map.
#[derive(Debug)]
pub struct MapOutcome {
    /// What was guessed and why, or the map itself if it goes to no file.
    pub summary: String,
    /// What must be looked at before the map is used.
    pub warnings: Vec<String>,
    /// The map.
    pub map: String,
}

/// Guesses which column is which signal of which joint, and in what unit.
///
/// # Errors
/// The robot or the log cannot be read, or the map not be written.
pub fn map(arguments: &MapArguments) -> Result<MapOutcome, Error> {
    let place = match &arguments.out {
        Some(out) => {
            check_file(out)?;
            check_inputs(&[arguments.urdf.clone(), arguments.log.clone()], std::slice::from_ref(out))?;
            Some(Lock::acquire(out, "phiw map")?)
        }
        None => None,
    };
    let session = crate::arguments::SessionArguments {
        urdf: arguments.urdf.clone(),
        hold: arguments.hold.clone(),
        ..Default::default()
    };
    let robot = session::read_robot(&session)?;
    let contents = LogContents::read(&arguments.log, arguments.topic.as_deref())?;
    let guesses = Guesses::of(&robot.tree, &contents);
    let map = text::map(&guesses, arguments);
    if let Some(place) = place {
        let target = place.target();
        let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let folder = target.parent().unwrap_or(Path::new("."));
        replace_files(&Disk, folder, &name, &[ResultFile::new(&name, map.clone())])?;
    }
    let summary = if arguments.out.is_some() { text::summary(&guesses) } else { map.clone() };
    Ok(MapOutcome { summary, warnings: text::warnings(&guesses), map })
}
