//! What every command on measured logs starts from: robot, logs, declared effects.

use crate::Error;
use crate::arguments::SessionArguments;
use crate::in_memory::text_of;
use crate::log_inputs::{read_map, train_and_validate};
use crate::robot_file::{RobotText, as_urdf};
use phiw_dynamics::urdf::{Finding, LinkInBody, UrdfOptions, UrdfReading, read_urdf};
use phiw_dynamics::{DimensionError, JointType, Tree};
use phiw_effects::{Catalogue, SignalRanges};
use phiw_identification::checks::{InputError, check_excitation};
use phiw_identification::effect::{EffectError, EffectSelector};
use phiw_identification::fitting::torques_with_enough_rows;
use phiw_identification::{BlockSource, Data, IdentificationError, LogFile, LogSet, Progress, Variants};
use phiw_limits::Limits;
use phiw_regressor::least_squares::GroupedFactor;
use phiw_residual::trace::ranges_of_residual;
use phiw_telemetry::{ConditioningOptions, TorqueColumns};
use std::path::PathBuf;

/// Robot, logs and declared effects, read and checked.
pub struct Session {
    /// The robot.
    pub tree: Tree,
    /// Text of its URDF.
    pub xml: String,
    /// What in the URDF should not be trusted.
    pub findings: Vec<Finding>,
    /// Joints that are held, by name, and where \[rad, m\].
    pub held: Vec<(String, f64)>,
    /// Number of angles and axes of the URDF that were made exact (see [`UrdfOptions::snap`]).
    pub snapped: usize,
    /// What of an MJCF file a URDF cannot express, in words.
    pub left_out: Vec<String>,
    /// The links that the robot's bodies are made of.
    pub links: Vec<LinkInBody>,
    /// Declared effects in the syntax of `--declare`, each kind united, `rigid_body` left out.
    pub declared: Vec<String>,
    /// The kinds that there are.
    pub catalogue: Catalogue,
    /// The logs.
    pub logs: LogSet,
    /// What was asked for.
    pub arguments: SessionArguments,
}

impl Session {
    /// Reads the URDF and surveys the logs. What is quick to find wrong is found first.
    ///
    /// # Errors
    /// An input is wrong: robot, effect, or log.
    pub fn open(arguments: &SessionArguments, progress: Progress<'_>) -> Result<Self, Error> {
        let session = Self::open_unexcited(arguments, progress)?;
        check_excitation(&session.tree, session.logs.training())
            .map_err(|error| session.of_training_logs(error.into()))?;
        Ok(session)
    }

    /// [`Session::open`] where joints may stand still in all logs.
    ///
    /// # Errors
    /// An input is wrong: robot, effect, or log.
    pub fn open_unexcited(arguments: &SessionArguments, progress: Progress<'_>) -> Result<Self, Error> {
        let catalogue = Catalogue::default();
        known_kinds(&arguments.declare, &catalogue)?;
        let robot = read_robot(arguments)?;
        let declared = catalogue.united(&arguments.declare, &robot.tree)?;
        let options = ConditioningOptions {
            cutoff_hz: arguments.cutoff_hz,
            parallel_cutoff_hz: arguments.parallel_cutoff_hz,
            ..ConditioningOptions::default()
        };
        let map = read_map(arguments.map.as_deref(), &robot.all_joints())?;
        let given = &arguments.in_memory;
        let logs = train_and_validate(&arguments.train, &arguments.validate, map.as_ref(), given);
        let interruption = given.interruption.clone();
        let torque = TorqueColumns::Required;
        let logs = LogSet::surveyed(&robot.tree, logs, torque, &options, interruption, progress)?;
        Ok(Session::of(robot, declared, logs, arguments.clone()))
    }

    /// Of what was read and checked.
    pub(crate) fn of(
        robot: RobotOfUrdf,
        declared: Vec<String>,
        logs: LogSet,
        arguments: SessionArguments,
    ) -> Self {
        let RobotOfUrdf { tree, xml, findings, held, snapped, left_out, links } = robot;
        let catalogue = Catalogue::default();
        Session { tree, xml, findings, held, snapped, left_out, links, declared, catalogue, logs, arguments }
    }

    /// The same error, with the training logs' names if it is about all of them.
    pub fn of_training_logs(&self, error: IdentificationError) -> Error {
        of_training_logs(error, &self.arguments.train)
    }

    /// The declared effects, each with the constants that the data choose from.
    ///
    /// A kind whose constants are seen only in what is left of the torque (the periods of a ripple) takes
    /// them from the residual of the others.
    ///
    /// # Errors
    /// A log cannot be read, or holds too little for the others.
    pub fn effects(&self, data: &Data<'_>) -> Result<Vec<Variants>, Error> {
        let ranges = SignalRanges::of_surveys(self.logs.training());
        let declare =
            |ranges: &SignalRanges, declared: &String| self.catalogue.declare(declared, &self.tree, ranges);
        let of_motion = |declared: &&String| self.catalogue.is_scanned(declared, &self.tree, &ranges);
        if self.declared.iter().all(|declared| of_motion(&declared)) {
            let effects = self.declared.iter().map(|declared| declare(&ranges, declared));
            return Ok(effects.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect());
        }
        let others = self.declared.iter().filter(of_motion).map(|declared| declare(&ranges, declared));
        let others = others.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
        let fitted = phiw_identification::identify(&self.tree, others, data)
            .map_err(|error| self.of_training_logs(error))?;
        let ranges = ranges_of_residual(&fitted.design, &fitted.fit.parameters, data, ranges)?;
        let effects = self.declared.iter().map(|declared| declare(&ranges, declared));
        Ok(effects.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect())
    }

    /// The stretches of time to fit and to validate on, read from `sources` (see [`LogSet::sources`]).
    pub fn data<'a>(&self, sources: &'a [LogFile<'a>]) -> Data<'a> {
        Data {
            train: self.logs.training_folds(),
            held_out: self.logs.held_out_folds(),
            sources: sources.iter().map(|source| source as &dyn BlockSource).collect(),
            rest_speeds: self.logs.rest_speeds(),
        }
    }

    /// Joints of which the folds held out say nothing, since they do not move there.
    ///
    /// # Errors
    /// No joint moves in what is held out: then there is no error to report, and no verdict.
    pub fn joints_without_held_out_motion(&self, held_out: &[GroupedFactor]) -> Result<Vec<usize>, Error> {
        let enough = torques_with_enough_rows(held_out).map_err(IdentificationError::from)?;
        if !enough.contains(&true) {
            return Err(InputError::NothingHeldOut { held_out: self.logs.held_out_in_words() }.into());
        }
        Ok((0..enough.len()).filter(|&joint| !enough[joint]).collect())
    }

    /// Unit of a joint's torque.
    pub fn torque_unit(&self, joint: usize) -> &'static str {
        torque_unit(&self.tree, joint)
    }
}

/// Unit of the torque of a robot's joint.
pub(crate) fn torque_unit(tree: &Tree, joint: usize) -> &'static str {
    if tree.joint(joint).joint_type == JointType::Prismatic { "N" } else { "N·m" }
}

/// Numbers that do not fit each other.
pub(crate) fn of_numbers(error: DimensionError) -> Error {
    IdentificationError::from(error).into()
}

/// The same error, with the names of `logs` if it is about all of them.
pub(crate) fn of_training_logs(error: IdentificationError, logs: &[PathBuf]) -> Error {
    match error {
        IdentificationError::Input(
            source @ (InputError::TooShort { .. } | InputError::NotExcited { .. }),
        ) => {
            let names: Vec<String> =
                logs.iter().take(LOGS_NAMED).map(|log| log.display().to_string()).collect();
            let more = logs.len().saturating_sub(LOGS_NAMED);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            Error::TrainingLogs { logs: names.join(", ") + &more, source: Box::new(source) }
        }
        error => error.into(),
    }
}

/// Logs that a message names.
const LOGS_NAMED: usize = 5;

/// The first kind that is unknown or cannot be declared, before anything else is looked at: that needs no
/// robot.
///
/// # Errors
/// There is one.
pub(crate) fn known_kinds(declared: &[String], catalogue: &Catalogue) -> Result<(), EffectError> {
    let kinds = declared.iter().map(|declared| EffectSelector::read(declared).kind);
    for kind in kinds.filter(|kind| !kind.is_empty() && kind != "rigid_body") {
        catalogue.declarable(&kind)?;
    }
    Ok(())
}

/// A robot on its fixed base, as its URDF describes it.
pub(crate) struct RobotOfUrdf {
    pub tree: Tree,
    /// The URDF's text.
    pub xml: String,
    /// What in it should not be trusted.
    pub findings: Vec<Finding>,
    /// Joints that are held, by name, and where \[rad, m\].
    pub held: Vec<(String, f64)>,
    /// Number of angles and axes that were made exact.
    pub snapped: usize,
    /// What of an MJCF file a URDF cannot express, in words.
    pub left_out: Vec<String>,
    /// The links that bodies are made of.
    pub links: Vec<LinkInBody>,
}

impl RobotOfUrdf {
    /// Joints that move and joints that are held, by name.
    pub fn all_joints(&self) -> Vec<String> {
        let held = self.held.iter().map(|(joint, _)| joint.as_str());
        self.tree.joint_names().chain(held).map(str::to_owned).collect()
    }
}

/// The robot of a session.
pub(crate) fn read_robot(arguments: &SessionArguments) -> Result<RobotOfUrdf, Error> {
    let given = arguments.in_memory.urdf.as_ref();
    let text = text_of(given, &arguments.urdf, Limits::default().urdf_bytes)?;
    let RobotText { urdf, left_out } = as_urdf(text, &arguments.urdf)?;
    Ok(RobotOfUrdf { left_out, ..robot_of(urdf, arguments)? })
}

/// The robot of a session, given the text of its URDF.
pub(crate) fn robot_of(xml: String, arguments: &SessionArguments) -> Result<RobotOfUrdf, Error> {
    let path = || arguments.urdf.clone();
    let options = UrdfOptions { held: arguments.hold.clone(), snap: true, ..UrdfOptions::default() };
    let reading =
        read_urdf(&xml, &options).map_err(|source| Error::Urdf { path: path(), source: Box::new(source) })?;
    if reading.tree.is_floating() {
        return Err(Error::FloatingBase { path: path() });
    }
    let UrdfReading { tree, findings, held, snapped, links } = reading;
    Ok(RobotOfUrdf { tree, xml, findings, held, snapped, left_out: Vec::new(), links })
}
