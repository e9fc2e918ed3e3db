//! Logs as a command line names them, with the map that says what their columns mean.

use crate::Error;
use crate::in_memory::InMemory;
use crate::input::read_text;
use crate::warnings::file_name;
use phiw_limits::Limits;
use phiw_telemetry::{LogError, LogMap, LogPart, LogSource, Payload};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Reads a map and checks it against the robot's joints, those that are held among them.
///
/// # Errors
/// It cannot be read, is no map, or names a joint that the robot has not.
pub fn read_map(path: Option<&Path>, joints: &[String]) -> Result<Option<Arc<LogMap>>, Error> {
    let Some(path) = path else { return Ok(None) };
    let text = read_text(path, Limits::default().toml_bytes)?;
    map_of(path, &text, joints).map(Some)
}

/// The same of a map's text, which `path` had.
///
/// # Errors
/// It is no map, or names a joint that the robot has not.
pub fn map_of(path: &Path, text: &str, joints: &[String]) -> Result<Arc<LogMap>, Error> {
    let map = LogMap::parse(path, text).map_err(LogError::from)?;
    map.check_joints(joints).map_err(LogError::from)?;
    Ok(Arc::new(map))
}

/// Logs of which all is read that the map does not leave out.
pub fn sources(logs: &[PathBuf], map: Option<&Arc<LogMap>>, given: &InMemory) -> Vec<LogSource> {
    let source = |log: &PathBuf| {
        let columns = given.logs.get(log).cloned();
        LogSource { columns, ..LogSource::mapped(log, map.cloned()) }
    };
    logs.iter().map(source).collect()
}

/// Logs to train and to validate on: where the map gives stretches of a training log to validation, they are
/// taken from it.
pub fn train_and_validate(
    train: &[PathBuf],
    validate: &[PathBuf],
    map: Option<&Arc<LogMap>>,
    given: &InMemory,
) -> [Vec<LogSource>; 2] {
    let undisturbed = |source: LogSource| {
        let disturbed = given.disturbed.get(&source.path).cloned().unwrap_or_default();
        LogSource { disturbed, ..source }
    };
    let Some(map) = map else {
        let training = sources(train, None, given).into_iter().map(undisturbed).collect();
        return [training, sources(validate, None, given)];
    };
    let part = |log: &PathBuf, part| {
        let columns = given.logs.get(log).cloned();
        LogSource { part, columns, ..LogSource::mapped(log, Some(map.clone())) }
    };
    let has_validation = |log: &&PathBuf| !map.facts(log).validate.is_empty();
    let training = train.iter().map(|log| undisturbed(part(log, LogPart::Train))).collect();
    let mut held_out: Vec<LogSource> =
        train.iter().filter(has_validation).map(|log| part(log, LogPart::Validate)).collect();
    held_out.extend(validate.iter().map(|log| match has_validation(&log) {
        true => part(log, LogPart::Validate),
        false => part(log, LogPart::All),
    }));
    [training, held_out]
}

/// Refuses logs of a robot that held something, where the robot alone is computed.
///
/// # Errors
/// The map says so of one of them.
pub fn without_payload(logs: &[PathBuf], map: Option<&Arc<LogMap>>) -> Result<(), Error> {
    let Some(map) = map else { return Ok(()) };
    match logs.iter().find(|log| map.facts(log).payload.is_some()) {
        None => Ok(()),
        Some(log) => {
            let what = format!(
                "the model is of the robot alone, which held something in {}; predict or simulate a log without a payload",
                log.display()
            );
            Err(LogError::from(map.payload_error(what)).into())
        }
    }
}

/// What a map says of logs beside their columns.
pub fn said_of_logs(map: &LogMap, logs: &[PathBuf]) -> Vec<String> {
    let mut said = Vec::new();
    for log in logs {
        let (name, facts) = (file_name(log), map.facts(log));
        let stretches = |stretches: &[[f64; 2]]| {
            stretches.iter().map(|[from, to]| format!("{from} to {to} s")).collect::<Vec<_>>().join(", ")
        };
        for (what, part) in
            [("train", &facts.train), ("validate", &facts.validate), ("left out", &facts.leave_out)]
        {
            if !part.is_empty() {
                said.push(format!("{name}: {what}, as the map says: {}", stretches(part)));
            }
        }
        match facts.payload {
            None => {}
            Some(Payload::UnknownButTheSame) => {
                said.push(format!("{name}: an unknown payload, as the map says; no fit takes it"));
            }
            Some(Payload::Known { link, mass_kg, .. }) => said.push(format!(
                "{name}: a payload of {mass_kg} kg at `{link}`, as the map says; its torques are taken off where a model is fitted"
            )),
        }
    }
    said
}
