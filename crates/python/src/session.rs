//! Identification, checks and predictions: what the command does, on what Python has in memory.

use crate::arrays::{Doubles, array};
use crate::robot::Robot;
use crate::work::{InputError, raised, run};
use phiw::arguments::{
    CheckArguments, Derivatives, ExplainArguments, InMemory, MotionFormat, NextArguments, NextEstimator,
    NextSelection, PredictArguments, RetargetArguments, SessionArguments,
};
use phiw::identify::Results;
use phiw_identification::Interruption;
use phiw_result_folder::{Disk, ResultFile, replace_folder};
use phiw_telemetry::NamedColumns;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::ffi::OsString;
use std::path::PathBuf;
use std::sync::Arc;

/// A log as the package hands it over.
#[derive(FromPyObject)]
pub enum Log<'py> {
    /// A file.
    Path(PathBuf),
    /// A name and the columns of an array in memory.
    Columns(String, Vec<(String, Bound<'py, PyAny>)>),
}

/// Options that sessions share.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct SessionOptions<'py> {
    train: Vec<Log<'py>>,
    validate: Vec<Log<'py>>,
    map: Option<PathBuf>,
    declare: Vec<String>,
    mass: Vec<(String, f64)>,
    total_mass: Option<f64>,
    inside: Vec<(String, [f64; 6])>,
    inside_geometry: bool,
    mirrored: Vec<(String, String)>,
    motions: Option<PathBuf>,
    cutoff_hz: Option<f64>,
    parallel_cutoff_hz: Option<f64>,
}

/// Options of `explain` beside those.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct ExplainOptions {
    model: Option<String>,
    exclude: Vec<String>,
    false_name_rate: Option<f64>,
    draws: u32,
}

/// What was computed: files by name, the result as text, warnings.
type Told<'py> = (Bound<'py, PyDict>, String, Vec<String>);

/// Fits the declared model.
#[pyfunction]
pub fn identify<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    options: SessionOptions<'py>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Told<'py>> {
    let arguments = session(robot.get(), options)?;
    let interruption = arguments.in_memory.interruption.clone();
    let work = move |console: &_| phiw::identify::results(&arguments, console);
    told(py, run(py, progress, &interruption, work)?)
}

/// Fits the declared model, and finds what it lacks.
#[pyfunction]
pub fn explain<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    options: SessionOptions<'py>,
    own: ExplainOptions,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Told<'py>> {
    let mut session = session(robot.get(), options)?;
    let ExplainOptions { model, exclude, false_name_rate, draws } = own;
    let named = model.as_ref().map(|_| PathBuf::from("model"));
    session.in_memory.model = model;
    let arguments =
        ExplainArguments { session, model: named, draws, exclude, false_name_rate, threshold: Vec::new() };
    let interruption = arguments.session.in_memory.interruption.clone();
    let work = move |console: &_| phiw::explain::results(&arguments, console);
    told(py, run(py, progress, &interruption, work)?)
}

/// What is in logs: the report as JSON, and as text.
#[pyfunction]
pub fn check<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    logs: Vec<Log<'py>>,
    map: Option<PathBuf>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(String, String)> {
    let (urdf, mut in_memory) = of_robot(robot.get())?;
    let logs = taken(logs, &mut in_memory)?;
    let hold = robot.get().hold.clone();
    let interruption = in_memory.interruption.clone();
    let arguments = CheckArguments { urdf, logs, map, hold, out: None, quiet: true, in_memory };
    let outcome = run(py, progress, &interruption, move |console| phiw::check::check(&arguments, console))?;
    Ok((outcome.report.to_string(), outcome.summary))
}

/// Options of predictions.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct PredictOptions<'py> {
    logs: Vec<Log<'py>>,
    map: Option<PathBuf>,
    hold: Bound<'py, PyAny>,
    cutoff_hz: Option<f64>,
    parallel_cutoff_hz: Option<f64>,
}

/// Predictions of a model, given as its text: names, columns, the log of each row, relative error, warnings.
#[pyfunction]
#[allow(clippy::type_complexity)] // a tuple that only the package takes apart
pub fn predict<'py>(
    py: Python<'py>,
    model: String,
    options: PredictOptions<'py>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(Vec<String>, Vec<Bound<'py, PyAny>>, Vec<usize>, f64, Vec<String>)> {
    let mut in_memory = InMemory { model: Some(model), ..InMemory::default() };
    let arguments = PredictArguments {
        model: PathBuf::from("model"),
        logs: taken(options.logs, &mut in_memory)?,
        map: options.map,
        hold: crate::hold::hold(Some(&options.hold))?,
        cutoff_hz: options.cutoff_hz,
        parallel_cutoff_hz: options.parallel_cutoff_hz,
        in_memory,
        ..PredictArguments::default()
    };
    let interruption = arguments.in_memory.interruption.clone();
    let work = move |console: &_| phiw::predict::predicted_columns(&arguments, console);
    let predicted = run(py, progress, &interruption, work)?;
    let rows = predicted.log.len();
    let columns = predicted.columns.into_iter().map(|column| Ok(array(py, column, &[rows])?.into_any()));
    let columns = columns.collect::<PyResult<_>>()?;
    Ok((predicted.names, columns, predicted.log, predicted.relative, predicted.warnings))
}

/// Options of the choice of a motion.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct NextOptions<'py> {
    motions: PathBuf,
    measured: Vec<Log<'py>>,
    map: Option<PathBuf>,
    support: Option<PathBuf>,
    model: Option<String>,
    declare: Vec<String>,
    urdf_error: f64,
    estimator: String,
    selection: String,
    command_hz: Option<f64>,
    alpha: Option<f64>,
    cutoff_hz: Option<f64>,
    parallel_cutoff_hz: Option<f64>,
}

/// The motion that a robot should run next: files, text, warnings.
#[pyfunction]
pub fn next_motion<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    options: NextOptions<'py>,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<Told<'py>> {
    let estimator = match options.estimator.as_str() {
        "unknown-noise" => NextEstimator::UnknownNoise,
        "least-squares" => NextEstimator::LeastSquares,
        other => {
            let what =
                format!("estimator=\"{other}\" is not known; write \"unknown-noise\" or \"least-squares\"");
            return Err(InputError::new_err(what));
        }
    };
    let selection = match options.selection.as_str() {
        "torque-per-second" => NextSelection::TorquePerSecond,
        "condition" => NextSelection::Condition,
        other => {
            let what =
                format!("selection=\"{other}\" is not known; write \"torque-per-second\" or \"condition\"");
            return Err(InputError::new_err(what));
        }
    };
    let (urdf, mut in_memory) = of_robot(robot.get())?;
    let measured = taken(options.measured, &mut in_memory)?;
    in_memory.model = options.model;
    let arguments = NextArguments {
        urdf,
        motions: options.motions,
        measured,
        map: options.map,
        support: options.support,
        model: in_memory.model.as_ref().map(|_| PathBuf::from("model")),
        declare: options.declare,
        hold: robot.get().hold.clone(),
        urdf_error: options.urdf_error,
        estimator,
        selection,
        command_hz: options.command_hz,
        slower: Vec::new(),
        false_fall_rate: None,
        base_error: None,
        alpha: options.alpha,
        cutoff_hz: options.cutoff_hz,
        parallel_cutoff_hz: options.parallel_cutoff_hz,
        out: PathBuf::from("motion.csv"),
        quiet: true,
        in_memory,
    };
    let interruption = arguments.in_memory.interruption.clone();
    let chosen = run(py, progress, &interruption, move |console| phiw::next::chosen(&arguments, console))?;
    Ok((contents(py, chosen.files)?, without_last_line(&chosen.summary), chosen.warnings))
}

/// Options of retargeting.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub struct RetargetOptions {
    urdf: PathBuf,
    files: Vec<PathBuf>,
    map: Option<PathBuf>,
    torso_from_reach: bool,
    velocity_limits: bool,
    interval: f64,
    format: String,
    out: PathBuf,
}

/// Marker recordings as motions of a robot, in a folder: text, warnings, and for each recording that could
/// not be retargeted its path and why.
#[pyfunction]
#[allow(clippy::type_complexity)] // a tuple that only the package takes apart
pub fn retarget<'py>(
    py: Python<'py>,
    robot: &Bound<'py, Robot>,
    options: RetargetOptions,
    progress: Option<&Bound<'py, PyAny>>,
) -> PyResult<(String, Vec<String>, Vec<(PathBuf, String)>)> {
    let RetargetOptions { urdf, files, map, torso_from_reach, velocity_limits, interval, format, out } =
        options;
    let format = match format.as_str() {
        "csv" => MotionFormat::Csv,
        "npz" => MotionFormat::Npz,
        other => {
            let what = format!("format=\"{other}\" is not known; write \"csv\" or \"npz\"");
            return Err(InputError::new_err(what));
        }
    };
    let arguments = RetargetArguments {
        urdf,
        c3d: files,
        map,
        hold: robot.get().hold.clone(),
        torso_from_reach,
        velocity_limits,
        interval,
        derivatives: Derivatives::Analytic,
        format,
        out,
        quiet: true,
    };
    let work = move |console: &_| phiw::retarget::retarget(&arguments, console);
    let outcome = run(py, progress, &Interruption::default(), work)?;
    let failures = outcome.failures.iter().map(|failure| (failure.file.clone(), failure.reason.to_string()));
    Ok((outcome.summary, outcome.warnings, failures.collect()))
}

/// The command `phiw`: does what the command line says and gives the exit status.
#[pyfunction]
pub fn command(py: Python<'_>, command_line: Vec<OsString>) -> u8 {
    py.detach(|| phiw::command::main(command_line))
}

/// Writes files into a folder of results, which then holds all of them or what it held before.
#[pyfunction]
pub fn write_results(py: Python<'_>, out: PathBuf, files: Vec<(String, Vec<u8>)>) -> PyResult<()> {
    let write = || {
        let place = phiw::output::take_folder(&out, &[], "phiw in Python")?;
        let files: Vec<ResultFile> =
            files.into_iter().map(|(name, content)| ResultFile::new(name, content)).collect();
        replace_folder(&Disk, &place, &files)?;
        Ok(())
    };
    py.detach(write).map_err(raised)
}

/// The robot of a session: its URDF's name, and its text in memory.
fn of_robot(robot: &Robot) -> PyResult<(PathBuf, InMemory)> {
    if robot.tree.is_floating() {
        return Err(InputError::new_err(
            "identification is of a robot on a fixed base: make it without floating_base",
        ));
    }
    let path = robot.path.clone().unwrap_or_else(|| PathBuf::from(format!("{}.urdf", robot.tree.name())));
    Ok((path, InMemory { urdf: Some(robot.xml.clone()), ..InMemory::default() }))
}

fn session(robot: &Robot, options: SessionOptions<'_>) -> PyResult<SessionArguments> {
    let (urdf, mut in_memory) = of_robot(robot)?;
    Ok(SessionArguments {
        urdf,
        train: taken(options.train, &mut in_memory)?,
        validate: taken(options.validate, &mut in_memory)?,
        map: options.map,
        declare: options.declare,
        hold: robot.hold.clone(),
        mass: options.mass,
        total_mass: options.total_mass,
        inside: options.inside,
        inside_geometry: options.inside_geometry,
        mirrored: options.mirrored,
        motions: options.motions,
        cutoff_hz: options.cutoff_hz,
        parallel_cutoff_hz: options.parallel_cutoff_hz,
        quiet: true,
        in_memory,
        ..SessionArguments::default()
    })
}

/// Names of the logs; those in memory are put there.
fn taken(logs: Vec<Log<'_>>, in_memory: &mut InMemory) -> PyResult<Vec<PathBuf>> {
    let mut take = |log| match log {
        Log::Path(path) => Ok(path),
        Log::Columns(name, columns) => {
            let mut own = Vec::with_capacity(columns.len());
            for (column, values) in columns {
                let values = Doubles::of(&values, &format!("{name}, column `{column}`"))?;
                own.push((column, values.as_slice()?.to_vec()));
            }
            let path = PathBuf::from(name);
            let log =
                NamedColumns::new(&path, own).map_err(|error| InputError::new_err(error.to_string()))?;
            in_memory.logs.insert(path.clone(), Arc::new(log));
            Ok(path)
        }
    };
    logs.into_iter().map(&mut take).collect()
}

fn told(py: Python<'_>, results: Results) -> PyResult<Told<'_>> {
    Ok((contents(py, results.files)?, without_last_line(&results.summary), results.warnings))
}

/// The files, by name.
fn contents(py: Python<'_>, files: impl IntoIterator<Item = ResultFile>) -> PyResult<Bound<'_, PyDict>> {
    let contents = PyDict::new(py);
    for file in files {
        contents.set_item(file.name, PyBytes::new(py, &file.content))?;
    }
    Ok(contents)
}

/// A summary without its last line, which says where the files are.
fn without_last_line(summary: &str) -> String {
    summary.trim_end().rsplit_once('\n').map_or_else(String::new, |(text, _)| text.trim_end().to_owned())
}
