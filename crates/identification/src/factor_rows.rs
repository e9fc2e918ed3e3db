//! A triangular factor as it is written to files: to a model, and to a run that can be resumed.

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

#[cfg(test)]
mod tests {
    use super::FactorRows;
    use phiw_regressor::factor::Factor;

    /// A model's factor went through one more decomposition on its way back, which changed its last digits.
    #[test]
    fn a_factor_comes_back_to_the_last_bit_under_either_name_of_its_entries() {
        let rows: Vec<f64> = (0..30).map(|k| (1.7 * f64::from(k) + 0.3).sin()).collect();
        let factor = Factor::of_rows(3, &rows).unwrap();
        let written = serde_json::to_string(&FactorRows::of(&factor, vec![4, 7])).unwrap();
        for text in [written.clone(), written.replace("\"entries\"", "\"triangle\"")] {
            let read: FactorRows = serde_json::from_str(&text).unwrap();
            assert_eq!(read.parameters, [4, 7]);
            assert_eq!(read.factor().unwrap(), factor, "{text}");
        }
    }

    #[test]
    fn a_factor_with_an_entry_less_is_refused() {
        let rows = FactorRows { parameters: vec![0, 1], rows: 3, entries: vec![1.0; 5] };
        assert_eq!(rows.factor().unwrap_err().to_string(), "the model's factor has 5 entries, but 3 columns");
    }
}
