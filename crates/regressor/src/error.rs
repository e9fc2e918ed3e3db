//! What can go wrong in this crate.

use phiw_dynamics::DimensionError;
use phiw_dynamics::check::IndexError;

/// An input that this crate cannot work with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RegressorError {
    /// A slice of the wrong length.
    #[error(transparent)]
    Dimension(#[from] DimensionError),
    /// A column, parameter or group that does not exist.
    #[error(transparent)]
    Index(#[from] IndexError),
    /// Columns that the rows do not determine.
    #[error(
        "the rows do not determine {} of {columns} columns (the first is column {}): drop them or add motion that excites them",
        undetermined.len(), undetermined.first().copied().unwrap_or_default()
    )]
    RankDeficient {
        /// Number of columns of the factor, right-hand side left out.
        columns: usize,
        /// The columns that depend on those before them.
        undetermined: Vec<usize>,
    },
    /// A number that is not finite reached a factor.
    #[error("row {row} of the block holds a number that is not finite")]
    NotFinite {
        /// Index of the row in the block that was pushed.
        row: usize,
    },
    /// A singular value decomposition that did not converge.
    #[error("an iterative decomposition did not converge")]
    NoConvergence,
}
