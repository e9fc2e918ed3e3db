//! `plan.json`: all that is decided over all logs of a session together.

use crate::arguments::SessionArguments;
use crate::bandwidth::with_textbook;
use crate::input::read_text;
use crate::log_inputs::{map_of, train_and_validate};
use crate::session::{Session, robot_of};
use crate::{Error, fingerprint};
use phiw_identification::bandwidth::{BandwidthSettings, Contest};
use phiw_identification::fitting::Declared;
use phiw_identification::model::DataFingerprint;
use phiw_identification::shard::ShardColumns;
use phiw_identification::{EffectCatalogue, EffectSpec, Fold, LogSet, Variants};
use phiw_limits::Limits;
use phiw_telemetry::{Conditioning, LogSource, Survey};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::path::Path;

/// Version of the file's form.
const SCHEMA: u32 = 1;

/// Why a plan cannot be made or used.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// Another file.
    #[error("not a plan.json of phiw: {0}")]
    NotAPlan(serde_json::Error),
    /// A plan of another phiw.
    #[error("phiw {theirs} has written it, this is phiw {}: plan again with this phiw, or use that one for all steps", env!("CARGO_PKG_VERSION"))]
    OtherVersion {
        /// The version that has written it.
        theirs: String,
    },
    /// A plan that somebody has edited, or of which bytes have changed.
    #[error("it has been changed since phiw plan wrote it (its checksum does not match); plan again")]
    Changed,
    /// Its parts do not fit each other.
    #[error("its {0} do not fit its logs; plan again")]
    Inconsistent(&'static str),
    /// Columns that the first pass does not know.
    #[error(
        "{kinds} cannot be reduced apart: its columns need the torque of the model that is being fitted; use phiw identify on all logs, or leave it out"
    )]
    NeedsModel {
        /// The kinds.
        kinds: String,
    },
}

/// The content of the file.
#[derive(Serialize, Deserialize)]
pub struct PlanFile {
    schema: u32,
    /// Version of the phiw that has written it.
    phiw: String,
    /// SHA-256 of the rest, as [`PlanFile::checksum`] has it.
    sha256: String,
    /// What was asked for.
    arguments: SessionArguments,
    /// Text of the URDF.
    urdf: String,
    /// Text of the map, where the logs are read with one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    map: Option<String>,
    /// Declared effects, each kind united.
    declared: Vec<String>,
    /// The logs, those to fit first: the order in which their factors are merged.
    logs: Vec<DataFingerprint>,
    surveys: Vec<Survey>,
    conditioning: Conditioning,
    /// For each declared effect the variants that the factors choose from.
    effects: Vec<Vec<EffectSpec>>,
    /// The effects that other cut-offs are compared with.
    compared: Vec<EffectSpec>,
}

impl PlanFile {
    /// Of a session, whose logs are read where an effect's constants are seen only in what is left of the
    /// torque.
    ///
    /// # Errors
    /// A log cannot be read any more, or an effect cannot be reduced apart.
    pub fn of_session(session: &Session, progress: phiw_identification::Progress<'_>) -> Result<Self, Error> {
        let sources = session.logs.sources(progress);
        let effects = session.effects(&session.data(&sources))?;
        let mut kinds: Vec<String> = Vec::new();
        for effect in effects.iter().flatten().filter(|effect| effect.needs().of_reference()) {
            let kind = effect.spec().kind;
            if !kinds.contains(&kind) {
                kinds.push(kind);
            }
        }
        if !kinds.is_empty() {
            let kinds = kinds.join(" and ");
            return Err(PlanError::NeedsModel { kinds }.in_file(&session.arguments.urdf));
        }
        let specs = |variants: &Variants| variants.iter().map(|effect| effect.spec()).collect();
        let specs: Vec<Vec<EffectSpec>> = effects.iter().map(specs).collect();
        let compared = with_textbook(session, effects)?;
        let compared = compared.iter().filter_map(|variants| variants.first()).map(|effect| effect.spec());
        let mut surveys = session.logs.surveys().to_vec();
        // Cut-offs are chosen; the page shows the first log's spectra only.
        surveys.iter_mut().skip(1).for_each(|survey| survey.spectrum = Default::default());
        let mut file = PlanFile {
            schema: SCHEMA,
            phiw: env!("CARGO_PKG_VERSION").to_owned(),
            sha256: String::new(),
            arguments: session.arguments.clone(),
            urdf: session.xml.clone(),
            map: surveys.iter().find_map(|survey| Some(survey.source.map.as_ref()?.text().to_owned())),
            declared: session.declared.clone(),
            logs: fingerprint::of_session(session)?,
            surveys,
            conditioning: session.logs.conditioning().clone(),
            effects: specs,
            compared: compared.collect(),
        };
        file.sha256 = file.checksum()?;
        Ok(file)
    }

    /// SHA-256 of the content with an empty checksum, written without spaces.
    fn checksum(&mut self) -> Result<String, Error> {
        let written = std::mem::take(&mut self.sha256);
        let json = serde_json::to_vec(self).map_err(|source| Error::Json { file: "the plan", source });
        self.sha256 = written;
        Ok(Sha256::digest(json?).iter().map(|byte| format!("{byte:02x}")).collect())
    }

    /// The file's text.
    ///
    /// # Errors
    /// A path is no text.
    pub fn to_json(&self) -> Result<String, Error> {
        let json = |source| Error::Json { file: "the plan", source };
        Ok(serde_json::to_string_pretty(self).map_err(json)? + "\n")
    }
}

impl PlanError {
    /// The error of this file.
    pub fn in_file(self, path: &Path) -> Error {
        Error::Plan { path: path.to_owned(), source: Box::new(self) }
    }
}

/// A plan, ready to be worked with.
pub struct Plan {
    /// Robot, logs, declared effects.
    pub session: Session,
    /// SHA-256 of the file.
    pub hash: [u8; 32],
    /// The logs, in the order of the session.
    pub logs: Vec<DataFingerprint>,
    /// The columns that the logs are reduced over.
    pub declared: Declared,
    /// The cut-offs that are compared, if any are.
    pub contest: Option<Contest>,
}

impl Plan {
    /// Reads a file.
    ///
    /// # Errors
    /// It is no plan, or one of another phiw.
    pub fn read(path: &Path) -> Result<Self, Error> {
        let text = read_text(path, Limits::default().plan_bytes)?;
        let wrong = |error: PlanError| error.in_file(path);
        let head: Head = serde_json::from_str(&text).map_err(|error| wrong(PlanError::NotAPlan(error)))?;
        if (head.schema, head.phiw.as_str()) != (SCHEMA, env!("CARGO_PKG_VERSION")) {
            return Err(wrong(PlanError::OtherVersion { theirs: head.phiw }));
        }
        let mut file: PlanFile =
            serde_json::from_str(&text).map_err(|error| wrong(PlanError::NotAPlan(error)))?;
        if file.checksum()? != file.sha256 {
            return Err(wrong(PlanError::Changed));
        }
        let hash = Sha256::digest(text.as_bytes()).into();
        Self::of_file(file, hash, path)
    }

    fn of_file(file: PlanFile, hash: [u8; 32], path: &Path) -> Result<Self, Error> {
        let wrong = |what| Err(PlanError::Inconsistent(what).in_file(path));
        let PlanFile { arguments, urdf, map, declared, logs, mut surveys, conditioning, .. } = file;
        let (effects, compared) = (file.effects, file.compared);
        let robot = robot_of(urdf, &arguments)?;
        let map = match (&arguments.map, map) {
            (Some(path), Some(text)) => Some(map_of(path, &text, &robot.all_joints())?),
            (None, None) => None,
            _ => return wrong("maps"),
        };
        let [train, validate] =
            train_and_validate(&arguments.train, &arguments.validate, map.as_ref(), &arguments.in_memory);
        let to_fit = train.len();
        let sources: Vec<LogSource> = train.into_iter().chain(validate).collect();
        if surveys.is_empty() || surveys.len() != logs.len() || surveys.len() != sources.len() {
            return wrong("surveys");
        }
        surveys.iter_mut().zip(sources).for_each(|(survey, source)| survey.source = source);
        let joints: Vec<&str> = robot.tree.joint_names().collect();
        let of_robot = |survey: &Survey| {
            survey.joints.iter().map(|joint| joint.name.as_str()).eq(joints.iter().copied())
                && !survey.segments.is_empty()
                && survey.period > 0.0
        };
        if !surveys.iter().all(of_robot)
            || !surveys.iter().enumerate().all(|(log, survey)| survey.session.log == log)
        {
            return wrong("surveys");
        }
        let logs_of_session = LogSet::of_surveys(&robot.tree, surveys, to_fit, conditioning)?;
        for survey in logs_of_session.surveys() {
            logs_of_session.conditioning().plan(survey)?;
        }
        let session = Session::of(robot, declared, logs_of_session, arguments);
        let build = |spec: &EffectSpec| session.catalogue.build(spec, &session.tree);
        let variants = |specs: &Vec<EffectSpec>| specs.iter().map(build).collect::<Result<Variants, _>>();
        let effects: Vec<Variants> = effects.iter().map(variants).collect::<Result<_, _>>()?;
        let compared: Vec<Variants> =
            compared.iter().map(|spec| Ok(vec![build(spec)?])).collect::<Result<_, Error>>()?;
        let folds = session.logs.training_folds().len() + session.logs.held_out_folds().len();
        let declared = Declared::new(&session.tree, effects, folds, session.logs.rest_speeds())?;
        let contest = Contest::new(&session.tree, compared, &session.logs, &BandwidthSettings::default())?;
        Ok(Plan { session, hash, logs, declared, contest })
    }

    /// The columns of the logs' factors.
    pub fn columns(&self) -> ShardColumns<'_> {
        let rungs = self.contest.as_ref().map(Contest::design);
        ShardColumns { folds: self.declared.design(), rungs }
    }

    /// The folds of a log: those to fit, then those held out.
    pub fn folds_of(&self, log: usize) -> [Vec<Fold>; 2] {
        let logs = &self.session.logs;
        [logs.training_folds(), logs.held_out_folds()]
            .map(|folds| folds.into_iter().filter(|fold| fold.log == log).collect())
    }

    /// For each cut-off the stretches of time of a log that are compared.
    pub fn compared_of(&self, log: usize) -> Vec<usize> {
        let Some(contest) = &self.contest else { return Vec::new() };
        let stretches = contest.folds().iter().filter(|fold| fold.log == log).count();
        match stretches {
            0 => Vec::new(),
            stretches => vec![stretches; contest.rungs()],
        }
    }

    /// Name of a log in messages.
    pub fn name_of(&self, log: usize) -> String {
        self.session.logs.surveys()[log].path.display().to_string()
    }
}

/// What every version of the file has.
#[derive(Deserialize)]
struct Head {
    schema: u32,
    phiw: String,
}
