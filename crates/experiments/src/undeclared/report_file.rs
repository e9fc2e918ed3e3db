//! What the scorer reads of a `report.json`.

use serde::Deserialize;
use std::collections::BTreeMap;

/// A report of the tracer.
#[derive(Clone, Debug, Deserialize)]
pub struct Report {
    /// `sufficient`, `explained`, `partly_explained` or `unexplained`; empty where `identify` gives none.
    #[serde(deserialize_with = "text_or_nothing")]
    pub verdict: String,
    /// Joint by joint.
    pub noise_floor: BTreeMap<String, f64>,
    /// Errors of the declared model.
    pub before: Errors,
    /// What was named, in the order in which it was added.
    pub effects: Vec<Effect>,
    /// What only polishes the form of another effect.
    #[serde(default)]
    pub refinements: Vec<Effect>,
    /// Errors with all that was named.
    pub after: Errors,
}

fn text_or_nothing<'de, D: serde::Deserializer<'de>>(value: D) -> Result<String, D::Error> {
    Ok(Option::<String>::deserialize(value)?.unwrap_or_default())
}

/// Errors on training and validation logs.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Errors {
    /// On the validation logs.
    #[serde(default)]
    pub validate: Error,
}

/// Errors on one set of logs.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Error {
    /// Joint by joint.
    #[serde(default)]
    pub rmse: BTreeMap<String, f64>,
}

/// A named effect.
#[derive(Clone, Debug, Deserialize)]
pub struct Effect {
    /// Its name.
    pub kind: String,
    /// Its joints.
    pub joints: Vec<String>,
    /// How sure the tracer is.
    #[serde(default)]
    pub confidence: f64,
    /// What could not be told from it.
    #[serde(default)]
    pub rivals: Vec<Rival>,
}

/// An effect that could not be told from a named one.
#[derive(Clone, Debug, Deserialize)]
pub struct Rival {
    /// Its name.
    pub kind: String,
    /// Its joints.
    pub joints: Vec<String>,
    /// How sure the tracer is.
    #[serde(default)]
    pub confidence: f64,
}
