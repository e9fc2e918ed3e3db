//! What a model was made of, and how it maps to standard parameters: what lets a `model.json` be used by
//! itself.

use phiw_regressor::BaseParameters;
use serde::{Deserialize, Serialize};

/// The map from standard to base parameters, as numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct BaseMap {
    /// Standard parameters that it maps from: ten for each body, in the order of `bodies`.
    pub standard: usize,
    /// For each base parameter the standard parameters that it is the sum of, each with its factor.
    pub rows: Vec<Vec<(usize, f64)>>,
}

impl BaseMap {
    /// The map of a robot.
    pub fn of(base: &BaseParameters) -> Self {
        let map = base.map();
        let row = |row: usize| {
            let factors = (0..map.ncols()).map(|column| (column, map[(row, column)]));
            factors.filter(|(_, factor)| *factor != 0.0).collect()
        };
        BaseMap { standard: map.ncols(), rows: (0..map.nrows()).map(row).collect() }
    }

    /// The base parameters of standard ones; those that are missing count as zero.
    pub fn base_of(&self, standard: &[f64]) -> Vec<f64> {
        let term = |&(column, factor): &(usize, f64)| factor * standard.get(column).copied().unwrap_or(0.0);
        self.rows.iter().map(|row| row.iter().map(term).sum()).collect()
    }
}

/// What a log was used for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DataRole {
    /// The model was fitted to it (to its first part, where no log was given for validation).
    Train,
    /// Its error was measured on it.
    Validate,
}

/// A log that a model comes from: enough to recognise it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DataFingerprint {
    /// Name of the file, without folders.
    pub log: String,
    /// What it was used for.
    pub role: DataRole,
    /// SHA-256 of its bytes, in hexadecimal digits.
    pub sha256: String,
    /// Rows below its header.
    pub rows: u64,
    /// Rows that could be used.
    pub used_rows: u64,
}
