//! `MAP.toml`: what the columns of a log mean, where their names and units do not say it.
//!
//! `docs/log-maps.md` describes the file.

mod error;
mod expression;
mod facts;
mod matrix;
mod read;
mod resolve;
mod signal;
mod units;

pub use error::MapError;
pub use facts::{LogFacts, LogPart, Payload};

pub(crate) use expression::Expression;
pub(crate) use resolve::Lookup;
pub(crate) use signal::Signal;

use facts::LogEntry;
use read::{RawJoint, RawTime};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use toml::Spanned;

/// What the columns of logs mean.
#[derive(Debug, Clone)]
pub struct LogMap {
    path: PathBuf,
    text: String,
    topic: Option<String>,
    time: Option<Spanned<RawTime>>,
    /// The order that `{index}` counts in.
    order: Vec<String>,
    every_joint: Option<RawJoint>,
    joints: BTreeMap<Spanned<String>, RawJoint>,
    motors: BTreeMap<Spanned<String>, RawJoint>,
    couplings: Vec<Coupling>,
    logs: Vec<LogEntry>,
}

/// Motors that move joints together.
#[derive(Debug, Clone)]
pub(crate) struct Coupling {
    motors: Vec<String>,
    joints: Vec<String>,
    /// From motor to joint coordinates, row by row.
    matrix: Vec<Vec<f64>>,
    /// From motor to joint torques: the transpose of the inverse.
    torques: Vec<Vec<f64>>,
}

impl LogMap {
    /// Reads a map from its text; `path` is its name in messages.
    ///
    /// # Errors
    /// It is no map; the message names line, key and mend.
    pub fn parse(path: &Path, text: &str) -> Result<Self, MapError> {
        read::read(path, text)
    }

    /// The file it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The topic of recordings of messages that is the log.
    pub fn topic(&self) -> Option<&str> {
        self.topic.as_deref()
    }

    /// Checks that each joint of the map is one of these.
    ///
    /// # Errors
    /// One is not; the message names it and those nearest to it.
    pub fn check_joints(&self, known: &[String]) -> Result<(), MapError> {
        let coupled = self.couplings.iter().flat_map(|coupling| &coupling.joints);
        let named = self.joints.keys().map(|joint| (joint.get_ref(), Some(joint.span())));
        let all = named.chain(self.order.iter().chain(coupled).map(|joint| (joint, None)));
        for (joint, span) in all {
            if !known.contains(joint) {
                let mut nearest = crate::columns::nearest(joint, known);
                if nearest.is_empty() {
                    nearest = known.iter().take(8).cloned().collect();
                }
                let at = span.map_or(0, |span| span.start);
                let what =
                    format!("the robot has no joint `{joint}`; its joints are named {}", nearest.join(", "));
                return Err(MapError::new(&self.path, &self.text, at, format!("joint.{joint}"), what));
            }
        }
        Ok(())
    }

    /// What is wrong with the payloads that it names.
    pub fn payload_error(&self, what: impl Into<String>) -> MapError {
        let at = self.text.find("payload").unwrap_or(0);
        MapError::new(&self.path, &self.text, at, "log.payload", what)
    }

    /// What the map says of one log, by its name.
    pub fn facts(&self, log: &Path) -> LogFacts {
        facts::of_log(&self.logs, log)
    }
}
