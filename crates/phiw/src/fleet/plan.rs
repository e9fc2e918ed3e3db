//! `phiw plan`: what must be decided over all logs together.

use super::FleetOutcome;
use super::plan_file::PlanFile;
use crate::Error;
use crate::argument_values::{held_joint, known_mass, positive};
use crate::arguments::SessionArguments;
use crate::console::Console;
use crate::output::check_file;
use crate::page::counted;
use crate::session::Session;
use crate::warnings::of_log;
use clap::Args;
use phiw_report::number::significant;
use phiw_result_folder::{Disk, Lock, StreamedFile, check_inputs};
use phiw_telemetry::Survey;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Arguments of `phiw plan`.
#[derive(Clone, Debug, Default, Args)]
pub struct PlanArguments {
    /// The robot's URDF, or MuJoCo's MJCF.
    #[arg(long, value_name = "ROBOT.urdf")]
    pub urdf: PathBuf,
    /// Logs that the model is fitted to: CSV, MCAP, ROS bags, LeRobot folders, npz.
    #[arg(value_name = "LOG", required = true)]
    pub train: Vec<PathBuf>,
    /// Logs that its error is measured on; without any, the last 30 % of each training log are held out.
    #[arg(long, value_name = "LOG", num_args = 1..)]
    pub validate: Vec<PathBuf>,
    /// What the columns of the logs mean: topics, units, gears, currents (docs/log-maps.md). Without it they
    /// are named as in a log of phiw.
    #[arg(long, value_name = "MAP.toml")]
    pub map: Option<PathBuf>,
    /// Effects beside the rigid body, wherever they can act or on the joints named: viscous_friction,
    /// coulomb_friction:j1+j2, transmission_coupling:j5+j6, …
    #[arg(long, value_name = "KIND[:JOINT[+JOINT…]],…", value_delimiter = ',')]
    pub declare: Vec<String>,
    /// Joints of the URDF that do not move, at 0 or at a value (rad, m); they need no column in the log. In a
    /// name, * stands for any letters and ? for one: --hold 'left_*'.
    #[arg(long, value_name = "JOINT[=VALUE],…", value_delimiter = ',', value_parser = held_joint)]
    pub hold: Vec<(String, f64)>,
    /// Masses that are known, as weighed (kg), of the links that joints carry.
    #[arg(long, value_name = "LINK=KG,…", value_delimiter = ',', value_parser = known_mass)]
    pub mass: Vec<(String, f64)>,
    /// Mass of all links that move, as weighed (kg).
    #[arg(long, value_name = "KG", value_parser = positive)]
    pub total_mass: Option<f64>,
    /// Cut-off of the low-pass over positions (Hz); by default chosen from the logs' spectra.
    #[arg(long, value_name = "HZ")]
    pub cutoff_hz: Option<f64>,
    /// Cut-off of the low-pass over the model's columns and the torque alike (Hz); by default the motion's
    /// bandwidth.
    #[arg(long, value_name = "HZ")]
    pub parallel_cutoff_hz: Option<f64>,
    /// The plan.
    #[arg(long, value_name = "PLAN.json")]
    pub out: PathBuf,
    /// Print nothing but errors.
    #[arg(long)]
    pub quiet: bool,
}

impl PlanArguments {
    /// The same as a session on the logs.
    fn session(&self) -> SessionArguments {
        let PlanArguments { urdf, train, validate, map, declare, hold, mass, total_mass, .. } = self.clone();
        let PlanArguments { cutoff_hz, parallel_cutoff_hz, .. } = *self;
        SessionArguments {
            urdf,
            train,
            validate,
            map,
            declare,
            hold,
            mass,
            total_mass,
            cutoff_hz,
            parallel_cutoff_hz,
            ..SessionArguments::default()
        }
    }
}

/// Surveys all logs and writes down what `phiw reduce` and `phiw identify --plan` need to work on each by
/// itself.
///
/// # Errors
/// An input is wrong, or the plan cannot be written.
pub fn plan(arguments: &PlanArguments, console: &Console) -> Result<FleetOutcome, Error> {
    check_file(&arguments.out)?;
    let of_session = arguments.session();
    check_inputs(&of_session.inputs(), std::slice::from_ref(&arguments.out))?;
    let _place = Lock::acquire(&arguments.out, "phiw plan")?;
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let session = Session::open(&of_session, &progress)?;
    let file = PlanFile::of_session(&session, &progress)?;
    console.finish();
    write(&arguments.out, file.to_json()?.as_bytes())?;
    let surveys = session.logs.surveys();
    let seconds: f64 = surveys.iter().map(Survey::duration).sum();
    let conditioning = session.logs.conditioning();
    Ok(FleetOutcome {
        summary: format!(
            "{}: {}, {} s; positions low-passed at {} Hz, columns and torque at {} Hz\n{} for phiw reduce\n",
            session.tree.name(),
            counted(surveys.len(), "log"),
            significant(seconds, 3),
            significant(conditioning.cutoff_hz, 3),
            significant(conditioning.parallel_cutoff_hz, 3),
            arguments.out.display()
        ),
        warnings: surveys.iter().flat_map(of_log).collect(),
    })
}

/// Writes a file in one step.
pub(super) fn write(path: &Path, content: &[u8]) -> Result<(), Error> {
    let mut file = StreamedFile::create(&Disk, path)?;
    file.write_all(content).map_err(|source| file.unwritable(source))?;
    Ok(file.commit()?)
}
