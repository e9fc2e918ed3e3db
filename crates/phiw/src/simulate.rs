//! `phiw simulate`: logs reproduced by the model and by its URDF, and how fast they go another way.

mod backends;
mod files;

pub use backends::Backend;
pub(crate) use files::{picture, worse};

use crate::Error;
use crate::arguments::{InMemory, SimulateArguments};
use crate::console::Console;
use crate::model_use::{ModelUse, Reading};
use crate::output::check_folder;
use crate::warnings::of_log;
use phiw_dynamics::Tree;
use phiw_identification::reproduction::{
    ErrorGrowth, Plant, ReproductionSettings, Window, collect_windows, reproduce,
};
use phiw_identification::{BlockSource, Design, Model};
use phiw_mjcf::impossible_bodies;
use phiw_result_folder::{Disk, Lock, check_inputs, replace_folder};
use phiw_telemetry::Survey;
use std::path::PathBuf;

/// Names of the files.
pub const FILES: [&str; 3] = ["simulation.json", "simulation.csv", "simulation.svg"];

/// Lengths of the windows \[s\]: the longest of which the logs have one.
const WINDOWS_S: [f64; 3] = [2.0, 1.0, 0.5];
/// Horizons that are told \[s\].
const TOLD_S: [f64; 3] = [0.5, 1.0, 2.0];
/// Distance of the poses at which M(q) is looked at \[s\].
const BETWEEN_POSES_S: f64 = 0.1;
/// Speed within which a friction of the URDF turns where the model says nothing of it \[rad/s, m/s\].
const SIGN_WIDTH: f64 = 1e-3;

/// What the command has done.
#[derive(Debug)]
pub struct SimulateOutcome {
    /// Errors by horizon, as text for a terminal.
    pub summary: String,
    /// What a reader should know before trusting a number, and whether the URDF does better.
    pub warnings: Vec<String>,
    /// All errors.
    pub reproduction: Reproduction,
}

/// Logs as the models reproduce them.
#[derive(Clone, Debug)]
pub struct Reproduction {
    /// Number of windows.
    pub windows: usize,
    /// Their length \[s\].
    pub window_s: f64,
    /// Travel of each joint in the logs \[rad, m\].
    pub travel: Vec<f64>,
    /// Kinds of effects that have no place in a simulation.
    pub left_out: Vec<String>,
    /// Why the URDF by itself cannot be simulated, if it cannot.
    pub nominal_refused: Option<String>,
    /// Why the bodies of least squares cannot be simulated, if they cannot.
    pub least_squares_refused: Option<String>,
    /// The URDF and the bodies of least squares (if they can be simulated) and the model, each in open and in
    /// closed loop.
    pub cases: Vec<Case>,
}

/// What is simulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Simulated {
    /// The URDF by itself.
    Nominal,
    /// The bodies and effects that least squares has found.
    LeastSquares,
    /// The model as it is used: bodies that can exist, and effects within their bounds.
    Identified,
}

impl Simulated {
    /// Its name in files and on the terminal.
    pub fn name(self) -> &'static str {
        match self {
            Simulated::Nominal => "nominal",
            Simulated::LeastSquares => "least squares",
            Simulated::Identified => "identified",
        }
    }
}

/// One model in one loop.
#[derive(Clone, Debug)]
pub struct Case {
    /// What moves.
    pub model: Simulated,
    /// Whether a PD loop holds it to the log.
    pub closed: bool,
    /// Its errors.
    pub growth: ErrorGrowth,
}

impl Case {
    /// `identified, open loop`.
    pub fn name(&self) -> String {
        format!("{}, {} loop", self.model.name(), if self.closed { "closed" } else { "open" })
    }
}

impl Reproduction {
    /// The errors of a model in a loop, if it could be simulated.
    pub fn growth(&self, model: Simulated, closed: bool) -> Option<&ErrorGrowth> {
        let is_it = |case: &&Case| (case.model, case.closed) == (model, closed);
        self.cases.iter().find(is_it).map(|case| &case.growth)
    }

    /// The horizons that are told \[s\], each with its place in the errors.
    pub fn told(&self) -> Vec<(f64, usize)> {
        let Some(case) = self.cases.first() else { return Vec::new() };
        let place =
            |told: &f64| case.growth.horizons.iter().position(|horizon| (horizon - told).abs() < 1e-9);
        TOLD_S.iter().filter_map(|told| Some((*told, place(told)?))).collect()
    }
}

/// Reproduces logs with a model and with the URDF that it was made from, open loop and closed loop.
///
/// Nothing is written before everything has been computed.
///
/// # Errors
/// An input is wrong, the model's M(q) is not positive definite, or the results cannot be written:
/// [`Error::exit_status`] tells them apart.
pub fn simulate(arguments: &SimulateArguments, console: &Console) -> Result<SimulateOutcome, Error> {
    check_folder(&arguments.out)?;
    backends::check(arguments.backend)?;
    let inputs: Vec<PathBuf> = std::iter::once(&arguments.model).chain(&arguments.logs).cloned().collect();
    check_inputs(&inputs, &FILES.map(|name| arguments.out.join(name)))?;
    let place = Lock::acquire(&arguments.out, "phiw simulate")?;
    let progress = |what: &str, done: u64, total: u64| console.progress(what, done, total);
    let reading = Reading {
        logs: &arguments.logs,
        map: arguments.map.as_deref(),
        hold: &arguments.hold,
        complete: true,
        cutoff_hz: None,
        parallel_cutoff_hz: None,
        in_memory: &InMemory::default(),
    };
    let used = ModelUse::open(&arguments.model, &reading, &progress)?;
    let sources = used.logs.sources(&progress);
    let sources: Vec<&dyn BlockSource> = sources.iter().map(|source| source as &dyn BlockSource).collect();
    let total: f64 = used.logs.surveys().iter().map(|survey| survey.duration()).sum();
    let most = ReproductionSettings::default().most_windows;
    let Some((settings, windows)) = longest_windows(&sources, total, most)? else {
        let logs: Vec<String> = arguments.logs.iter().map(|log| log.display().to_string()).collect();
        let needed = WINDOWS_S[WINDOWS_S.len() - 1];
        return Err(Error::NothingToReproduce { logs: logs.join(", "), needed });
    };
    let reproduction = reproduced(&used, &windows, &settings, arguments)?;
    console.finish();
    let mut warnings: Vec<String> = used.logs.surveys().iter().flat_map(of_log).collect();
    warnings.extend(files::warnings(&reproduction));
    let written = files::files(&used, &reproduction, arguments, &warnings)?;
    replace_folder(&Disk, &place, &written)?;
    let summary = files::summary(&used, &reproduction, arguments);
    Ok(SimulateOutcome { summary, warnings, reproduction })
}

/// The longest windows of which the logs have one; at most `most` of them, over `total` seconds of logs.
pub(crate) fn longest_windows(
    sources: &[&dyn BlockSource],
    total: f64,
    most: usize,
) -> Result<Option<(ReproductionSettings, Vec<Window>)>, Error> {
    for window_s in WINDOWS_S {
        let settings = ReproductionSettings { window_s, ..ReproductionSettings::default() };
        let windows = collect_windows(sources, window_s, total, most)?;
        if !windows.is_empty() {
            return Ok(Some((settings, windows)));
        }
    }
    Ok(None)
}

fn reproduced(
    used: &ModelUse,
    windows: &[Window],
    settings: &ReproductionSettings,
    arguments: &SimulateArguments,
) -> Result<Reproduction, Error> {
    let subject = Subject {
        tree: &used.tree,
        model: &used.model,
        design: &used.design,
        parameters: &used.parameters,
        travel: (0..used.tree.joint_count()).map(|joint| travel(used.logs.surveys(), joint)).collect(),
        logs: arguments.logs.clone(),
        backend: arguments.backend,
    };
    subject.reproduced(windows, settings, &[false, true])?.map_err(|(log, t)| Error::NotPositiveDefinite {
        path: arguments.model.clone(),
        log: arguments.logs[log].clone(),
        t,
        bodies: subject
            .model
            .consistent_tree(subject.tree)
            .map_or(String::new(), |tree| bodies_in_words(&tree)),
    })
}

/// A model that reproduces logs, and its URDF.
pub(crate) struct Subject<'a> {
    /// The robot, with the URDF's inertial parameters.
    pub tree: &'a Tree,
    /// The model.
    pub model: &'a Model,
    /// Its columns.
    pub design: &'a Design,
    /// Their parameters by least squares.
    pub parameters: &'a [f64],
    /// Travel of each joint in the logs \[rad, m\].
    pub travel: Vec<f64>,
    /// The logs.
    pub logs: Vec<PathBuf>,
    /// What computes the motion.
    pub backend: Backend,
}

impl Subject<'_> {
    /// Reproduces windows in the loops that are asked for (open: `false`), or gives the log and the time of
    /// the first pose in which the model's M(q) is not positive definite.
    pub fn reproduced(
        &self,
        windows: &[Window],
        settings: &ReproductionSettings,
        loops: &[bool],
    ) -> Result<Result<Reproduction, (usize, f64)>, Error> {
        // Bodies that can exist, and friction that dissipates: what least squares alone finds often cannot
        // move, and is shown beside it where it can.
        let least_squares_tree = self.model.identified_tree(self.tree)?;
        let identified_tree = self.model.consistent_tree(self.tree)?;
        let mut parameters = self.parameters.to_vec();
        for effect in 0..self.design.effects().len() {
            for (at, parameter) in self.design.effect_parameters(effect).enumerate() {
                parameters[parameter] =
                    self.model.consistent_effect(effect, at).unwrap_or(parameters[parameter]);
            }
        }
        let widths: Vec<f64> = (0..self.tree.joint_count())
            .map(|joint| self.model.rest_speeds.get(joint).copied().unwrap_or(SIGN_WIDTH))
            .collect();
        // The rigid body moves by the backend: its columns would be evaluated for nothing.
        let all: Vec<usize> = (0..self.design.effects().len()).collect();
        let effects = self.design.part(&all, false);
        let identified = || {
            Ok(Plant::new(backends::of(self.backend, &identified_tree)?)
                .with_effects(&effects, &parameters)?)
        };
        let least_squares = || {
            Ok(Plant::new(backends::of(self.backend, &least_squares_tree)?)
                .with_effects(&effects, self.parameters)?)
        };
        let nominal = || {
            Ok(Plant::new(backends::of(self.backend, self.tree)?).with_declared_friction(self.tree, &widths))
        };
        let inertia = match inertia(identified().map_err(Error::Simulation)?, windows)? {
            Ok(inertia) => inertia,
            Err(place) => return Ok(Err(place)),
        };
        let refused = |what: &str, tree: &Tree, plant: Result<Plant<'_>, _>| {
            inertia_refused(what, tree, plant.map_err(Error::Simulation)?, windows, &self.logs)
        };
        let nominal_refused = refused("the URDF by itself", self.tree, nominal())?;
        let least_squares_refused =
            refused("what least squares has found", &least_squares_tree, least_squares())?;
        let mut cases = Vec::new();
        for &closed in loops {
            let loop_inertia = closed.then_some(inertia.as_slice());
            let mut add = |model, growth: Result<ErrorGrowth, _>| {
                cases.push(Case { model, closed, growth: growth.map_err(Error::Simulation)? });
                Ok::<(), Error>(())
            };
            if nominal_refused.is_none() {
                let growth = reproduce(&nominal, windows, &self.travel, loop_inertia, settings);
                add(Simulated::Nominal, growth)?;
            }
            if least_squares_refused.is_none() {
                let growth = reproduce(&least_squares, windows, &self.travel, loop_inertia, settings);
                add(Simulated::LeastSquares, growth)?;
            }
            let growth = reproduce(&identified, windows, &self.travel, loop_inertia, settings);
            add(Simulated::Identified, growth)?;
        }
        Ok(Ok(Reproduction {
            windows: windows.len(),
            window_s: settings.window_s,
            travel: self.travel.clone(),
            left_out: Plant::left_out(self.design),
            nominal_refused,
            least_squares_refused,
            cases,
        }))
    }
}

/// Mean of M(q)'s diagonal over the poses of the windows, or the log and time of the first pose in which it
/// is not positive definite.
fn inertia(mut plant: Plant<'_>, windows: &[Window]) -> Result<Result<Vec<f64>, (usize, f64)>, Error> {
    let joints = plant.joints();
    let (mut sum, mut own, mut count) = (vec![0.0; joints], vec![0.0; joints], 0.0);
    for window in windows {
        let stride = (BETWEEN_POSES_S / window.period).ceil().max(1.0) as usize;
        for sample in (0..window.len()).step_by(stride) {
            let q = &window.q[sample * joints..(sample + 1) * joints];
            if !plant.inertia(q, &mut own).map_err(Error::Simulation)? {
                return Ok(Err((window.log, window.start + sample as f64 * window.period)));
            }
            sum.iter_mut().zip(&own).for_each(|(sum, own)| *sum += own);
            count += 1.0;
        }
    }
    Ok(Ok(sum.iter().map(|sum| sum / count).collect()))
}

/// Why a robot cannot be simulated.
fn inertia_refused(
    what: &str,
    tree: &Tree,
    plant: Plant<'_>,
    windows: &[Window],
    logs: &[PathBuf],
) -> Result<Option<String>, Error> {
    let said = |(log, t): (usize, f64)| {
        format!(
            "{what} cannot be simulated: its M(q) is not positive definite at {t:.3} s of {}{}",
            logs[log].display(),
            bodies_in_words(tree)
        )
    };
    Ok(inertia(plant, windows)?.err().map(said))
}

/// `, and no real body has the inertial parameters of link_1, link_2`.
fn bodies_in_words(tree: &Tree) -> String {
    match impossible_bodies(tree).as_slice() {
        [] => String::new(),
        links => format!(", and no real body has the inertial parameters of {}", links.join(", ")),
    }
}

/// The longest way of a joint in the logs.
pub(crate) fn travel(surveys: &[Survey], joint: usize) -> f64 {
    surveys.iter().map(|survey| survey.joints[joint].travel()).fold(f64::MIN_POSITIVE, f64::max)
}
