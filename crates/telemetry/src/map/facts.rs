//! What a map says of single logs: which stretches are what, and what the robot held.

use super::MapError;
use super::read::{RawLog, RawPayload};
use std::path::Path;

/// Which part of a log is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum LogPart {
    /// All that the map does not leave out.
    #[default]
    All,
    /// What the map gives to training: its `train` stretches, or all but its `validate` stretches.
    Train,
    /// The map's `validate` stretches.
    Validate,
}

/// What the robot held while a log was recorded.
#[derive(Debug, Clone, PartialEq)]
pub enum Payload {
    /// A body that was weighed.
    Known {
        /// The link that holds it.
        link: String,
        /// Its mass \[kg\].
        mass_kg: f64,
        /// Its centre of mass in the link's frame \[m\].
        com_m: [f64; 3],
    },
    /// A body of which nothing is known but that all logs with it hold the same.
    UnknownButTheSame,
}

/// What a map says of one log. Stretches are in seconds after the log's first row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LogFacts {
    /// Stretches to fit.
    pub train: Vec<[f64; 2]>,
    /// Stretches to validate on.
    pub validate: Vec<[f64; 2]>,
    /// Stretches that are not looked at.
    pub leave_out: Vec<[f64; 2]>,
    /// What the robot held.
    pub payload: Option<Payload>,
}

impl LogFacts {
    /// Whether a row so long after the first belongs to a part \[s\].
    pub fn holds(&self, part: LogPart, seconds: f64) -> bool {
        let inside =
            |stretches: &[[f64; 2]]| stretches.iter().any(|[from, to]| (*from..=*to).contains(&seconds));
        !inside(&self.leave_out)
            && match part {
                LogPart::All => true,
                LogPart::Train if self.train.is_empty() => !inside(&self.validate),
                LogPart::Train => inside(&self.train),
                LogPart::Validate => inside(&self.validate),
            }
    }

    /// Whether every row is wanted.
    pub fn holds_all(&self, part: LogPart) -> bool {
        self.leave_out.is_empty()
            && (part == LogPart::All || (self.train.is_empty() && self.validate.is_empty()))
    }
}

/// An entry `[[log]]`.
#[derive(Debug, Clone)]
pub(crate) struct LogEntry {
    file: Option<String>,
    facts: LogFacts,
}

impl LogEntry {
    /// # Errors
    /// A stretch that ends before it begins, or a payload that is none.
    pub fn new(raw: RawLog, path: &Path, text: &str) -> Result<Self, MapError> {
        let stretches = |key: &str, stretches: &toml::Spanned<Vec<[f64; 2]>>| {
            for [from, to] in stretches.get_ref() {
                if !(from < to && *from >= 0.0) {
                    let what = format!(
                        "[{from}, {to}] is no stretch; write [FROM, TO] in seconds after the log's first row"
                    );
                    return Err(MapError::new(
                        path,
                        text,
                        stretches.span().start,
                        format!("log.{key}"),
                        what,
                    ));
                }
            }
            Ok(stretches.get_ref().clone())
        };
        let optional = |key: &str, raw: &Option<toml::Spanned<Vec<[f64; 2]>>>| {
            raw.as_ref().map(|raw| stretches(key, raw)).transpose().map(Option::unwrap_or_default)
        };
        let facts = LogFacts {
            train: optional("train", &raw.train)?,
            validate: optional("validate", &raw.validate)?,
            leave_out: optional("leave_out", &raw.leave_out)?,
            payload: raw.payload.map(|payload| of_payload(&payload, path, text)).transpose()?,
        };
        Ok(LogEntry { file: raw.file, facts })
    }
}

fn of_payload(raw: &toml::Spanned<RawPayload>, path: &Path, text: &str) -> Result<Payload, MapError> {
    let wrong = |what: String| MapError::new(path, text, raw.span().start, "log.payload", what);
    match raw.get_ref() {
        RawPayload::Words(words) if words == "unknown but the same" => Ok(Payload::UnknownButTheSame),
        RawPayload::Words(words) => Err(wrong(format!(
            "`{words}` is not understood; write \"unknown but the same\", or {{ link = \"tool0\", mass_kg = 2.0, com_m = [0.0, 0.0, 0.1] }}"
        ))),
        RawPayload::Known(known) if known.mass_kg > 0.0 && known.mass_kg.is_finite() => {
            Ok(Payload::Known { link: known.link.clone(), mass_kg: known.mass_kg, com_m: known.com_m })
        }
        RawPayload::Known(known) => {
            Err(wrong(format!("a mass of {} kg is none; write what was weighed", known.mass_kg)))
        }
    }
}

/// All entries that a log's name fits, the later ones added to the earlier.
pub(crate) fn of_log(entries: &[LogEntry], log: &Path) -> LogFacts {
    let name = log.file_name().unwrap_or_default().to_string_lossy();
    let mut all = LogFacts::default();
    for entry in entries {
        if entry.file.as_deref().is_none_or(|pattern| fits(pattern.as_bytes(), name.as_bytes())) {
            all.train.extend(&entry.facts.train);
            all.validate.extend(&entry.facts.validate);
            all.leave_out.extend(&entry.facts.leave_out);
            all.payload = entry.facts.payload.clone().or(all.payload);
        }
    }
    all
}

/// Whether a name fits a pattern with `*` for any letters and `?` for one.
fn fits(pattern: &[u8], name: &[u8]) -> bool {
    match pattern {
        [] => name.is_empty(),
        [b'*', rest @ ..] => (0..=name.len()).any(|skip| fits(rest, &name[skip..])),
        [b'?', rest @ ..] => !name.is_empty() && fits(rest, &name[1..]),
        [first, rest @ ..] => name.first() == Some(first) && fits(rest, &name[1..]),
    }
}
