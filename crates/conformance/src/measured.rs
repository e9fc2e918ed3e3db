//! The result of a check.

use phiw_dynamics::BackendError;
use std::fmt;

/// A number that a check measured, and the largest that it may be.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// What was measured.
    pub quantity: &'static str,
    /// The number.
    pub value: f64,
    /// The largest number that passes.
    pub limit: f64,
    /// Its unit; `""` for a ratio.
    pub unit: &'static str,
}

/// Why a backend does not conform.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Failure {
    /// A number is too large, or not a number.
    #[error("too large: {0}")]
    TooLarge(Measured),
    /// The backend reported an error where it should not.
    #[error("the backend failed: {0}")]
    Backend(#[from] BackendError),
    /// Something other than a number is wrong.
    #[error("{0}")]
    Wrong(String),
}

impl From<phiw_dynamics::DimensionError> for Failure {
    fn from(error: phiw_dynamics::DimensionError) -> Self {
        Failure::Backend(error.into())
    }
}

impl Measured {
    /// The number, if it is not above the limit.
    pub(crate) fn check(
        quantity: &'static str,
        value: f64,
        limit: f64,
        unit: &'static str,
    ) -> Result<Self, Failure> {
        let measured = Measured { quantity, value, limit, unit };
        if value <= limit { Ok(measured) } else { Err(Failure::TooLarge(measured)) }
    }
}

impl fmt::Display for Measured {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Measured { quantity, value, limit, unit } = self;
        let space = if unit.is_empty() { "" } else { " " };
        write!(f, "{quantity}: {value:.3e}{space}{unit} (at most {limit:.0e}{space}{unit})")
    }
}

/// Largest difference between two slices over the largest element of the second (or over 1e-12, for zeros).
pub(crate) fn relative_difference(found: &[f64], expected: &[f64]) -> f64 {
    let scale = expected.iter().fold(1e-12_f64, |largest, x| largest.max(x.abs()));
    largest_difference(found, expected) / scale
}

/// Largest difference between two slices; not a number where one is.
pub(crate) fn largest_difference(found: &[f64], expected: &[f64]) -> f64 {
    found.iter().zip(expected).map(|(x, y)| (x - y).abs()).fold(0.0, worse)
}

/// The larger of two numbers; NaN wins, so that it fails every limit.
pub(crate) fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
