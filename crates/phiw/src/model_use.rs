//! A `model.json` used by itself, on new logs: its robot, its columns, and the logs.

use crate::Error;
use crate::log_inputs::{read_map, sources, without_payload};
use crate::model_file::ModelFile;
use phiw_dynamics::Tree;
use phiw_dynamics::urdf::{UrdfOptions, held_joints, read_urdf};
use phiw_effects::Catalogue;
use phiw_identification::held_joints::HeldJoints;
use phiw_identification::{Design, IdentificationError, LogFile, LogSet, Model, Progress};
use phiw_telemetry::{ConditioningOptions, Survey};
use std::path::{Path, PathBuf};

/// How far two values of one held joint may be apart \[rad, m\].
const SAME_POSITION: f64 = 1e-9;

/// How the logs are read; what is `None` is as the model was made.
pub struct Reading<'a> {
    /// The logs.
    pub logs: &'a [PathBuf],
    /// What their columns mean.
    pub map: Option<&'a Path>,
    /// Joints that stand still in the logs, and where \[rad, m\].
    pub hold: &'a [(String, f64)],
    /// Whether the logs must have torques, and move all joints that the model moves.
    pub complete: bool,
    /// Cut-off of the positions' low-pass \[Hz\].
    pub cutoff_hz: Option<f64>,
    /// Cut-off of the parallel filter \[Hz\].
    pub parallel_cutoff_hz: Option<f64>,
}

/// A model and the logs that it is used on.
pub struct ModelUse {
    path: PathBuf,
    /// The model.
    pub model: Model,
    /// Its robot, with the URDF's inertial parameters.
    pub tree: Tree,
    /// Its columns.
    pub design: Design,
    /// The parameters of the columns.
    pub parameters: Vec<f64>,
    /// The logs: a row for each sample goes out.
    pub logs: LogSet,
    /// For each log, how many samples lie between two rows where a model is fitted or its error is measured:
    /// the rows between tell nothing new.
    pub strides: Vec<usize>,
    hold: Vec<(String, f64)>,
    logged: Vec<String>,
}

impl ModelUse {
    /// Reads a model and surveys the logs. What is quick to find wrong is found first.
    ///
    /// # Errors
    /// An input is wrong: model, held joint, or log.
    pub fn open(path: &Path, reading: &Reading<'_>, progress: Progress<'_>) -> Result<Self, Error> {
        let file = ModelFile::read(path)?;
        let held = extra_holds(&file.model, path, reading.hold)?;
        if let Some((joint, _)) = held.first().filter(|_| reading.complete) {
            return Err(Error::HeldInSimulation { path: path.to_owned(), joint: joint.clone() });
        }
        let tree = robot(&file.model, path, &[])?;
        let (design, parameters) = file.own_design(&tree, &Catalogue::default())?;
        let model = file.model;
        let design = design.with_rest_speeds(model.rest_speeds.clone());
        // Joints that are held in the logs only still move in the model.
        let logged = if held.is_empty() { tree.clone() } else { robot(&model, path, &held)? };
        let thinned = ConditioningOptions {
            cutoff_hz: Some(reading.cutoff_hz.unwrap_or(model.cutoff_hz.0)),
            parallel_cutoff_hz: Some(reading.parallel_cutoff_hz.unwrap_or(model.cutoff_hz.1)),
            ..ConditioningOptions::default()
        };
        let every_row = ConditioningOptions { decimation: Some(1), ..thinned.clone() };
        let held_before = model.held.iter().map(|(joint, _)| joint.as_str());
        let joints: Vec<String> = tree.joint_names().chain(held_before).map(str::to_owned).collect();
        let map = read_map(reading.map, &joints)?;
        without_payload(reading.logs, map.as_ref())?;
        let sources = sources(reading.logs, map.as_ref());
        let logs = match reading.complete {
            true => LogSet::open_unexcited(&logged, &sources, &[], &every_row, progress)?,
            false => LogSet::open_for_prediction(&logged, &sources, &every_row, progress)?,
        };
        let thinned = phiw_telemetry::Conditioning::choose(logs.surveys(), &thinned)?;
        let stride = |survey: &Survey| Ok(thinned.plan(survey)?.decimation());
        let strides = logs.surveys().iter().map(stride).collect::<Result<_, Error>>()?;
        let logged = logged.joint_names().map(str::to_owned).collect();
        let path = path.to_owned();
        Ok(ModelUse { path, model, tree, design, parameters, logs, strides, hold: held, logged })
    }

    /// The model's joints.
    pub fn joints(&self) -> Vec<String> {
        self.tree.joint_names().map(str::to_owned).collect()
    }

    /// For each joint whether the logs have its column.
    pub fn is_logged(&self) -> Vec<bool> {
        self.tree.joint_names().map(|joint| self.logged.iter().any(|logged| logged == joint)).collect()
    }

    /// The logs' blocks with all of the model's joints.
    ///
    /// # Errors
    /// A joint neither moves in the logs nor is held.
    pub fn with_held<'a>(&self, sources: &'a [LogFile<'a>]) -> Result<Vec<HeldJoints<'a>>, Error> {
        let logged: Vec<&str> = self.logged.iter().map(String::as_str).collect();
        let joints: Vec<&str> = self.tree.joint_names().collect();
        let source = |source: &'a LogFile<'a>| HeldJoints::new(source, &logged, &joints, &self.hold);
        let sources: Result<_, IdentificationError> = sources.iter().map(source).collect();
        sources.map_err(|source| Error::Model { path: self.path.clone(), source: Box::new(source) })
    }
}

/// The joints that are held beyond those of the model.
fn extra_holds(model: &Model, path: &Path, hold: &[(String, f64)]) -> Result<Vec<(String, f64)>, Error> {
    let named = match &model.urdf {
        Some(xml) => held_joints(xml, hold)
            .map_err(|source| Error::RobotOfModel { path: path.to_owned(), source: Box::new(source) })?,
        None => hold.to_vec(),
    };
    let mut extra = Vec::new();
    for (joint, asked) in &named {
        match model.held.iter().find(|(held, _)| held == joint) {
            Some((_, held)) if (held - asked).abs() <= SAME_POSITION => {}
            Some(&(_, held)) => {
                let (path, joint, asked) = (path.to_owned(), joint.clone(), *asked);
                return Err(Error::HeldElsewhere { path, joint, asked, held });
            }
            None => extra.push((joint.clone(), *asked)),
        }
    }
    Ok(extra)
}

/// The robot of a model, `also` held.
///
/// # Errors
/// The model holds no robot, or one that cannot be read.
pub(crate) fn robot(model: &Model, path: &Path, also: &[(String, f64)]) -> Result<Tree, Error> {
    let Some(xml) = &model.urdf else { return Err(Error::ModelWithoutRobot { path: path.to_owned() }) };
    let held = model.held.iter().chain(also).cloned().collect();
    let reading = read_urdf(xml, &UrdfOptions { held, snap: true, ..UrdfOptions::default() })
        .map_err(|source| Error::RobotOfModel { path: path.to_owned(), source: Box::new(source) })?;
    if reading.tree.is_floating() {
        return Err(Error::FloatingBase { path: path.to_owned() });
    }
    Ok(reading.tree)
}
