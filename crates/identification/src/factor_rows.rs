//! A triangular factor as it is written down: in a model, and in a run that is to be gone on with.

use crate::IdentificationError;
use phiw_regressor::factor::Factor;
use serde::{Deserialize, Serialize};

/// An upper triangular factor, row by row from the diagonal on, to the last bit.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FactorRows {
    /// The parameters that its columns stand for; the right-hand side follows them.
    pub parameters: Vec<usize>,
    /// Number of rows of Φ.
    pub rows: u64,
    /// The entries. (Runs that were written earlier call them `triangle`.)
    #[serde(alias = "triangle")]
    pub entries: Vec<f64>,
}

impl FactorRows {
    /// Of a factor whose columns stand for `parameters`.
    pub fn of(factor: &Factor, parameters: Vec<usize>) -> Self {
        FactorRows { parameters, rows: factor.rows(), entries: factor.triangle() }
    }

    /// The factor itself.
    ///
    /// # Errors
    /// The number of entries is not that of a triangle.
    pub fn factor(&self) -> Result<Factor, IdentificationError> {
        let size = self.parameters.len() + 1;
        if self.entries.len() != size * (size + 1) / 2 {
            let message =
                format!("the model's factor has {} entries, but {} columns", self.entries.len(), size);
            return Err(IdentificationError::Model(message));
        }
        Ok(Factor::of_triangle(size, self.rows, &self.entries)?)
    }
}
