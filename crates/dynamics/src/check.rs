//! Checks of arguments against the robot: sizes and indices.

/// An argument that does not match the robot.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum DimensionError {
    /// A slice of another length.
    #[error("{what} has {found} elements, but this robot needs {expected}")]
    Length {
        /// Which argument.
        what: &'static str,
        /// Its length.
        found: usize,
        /// The length that it must have.
        expected: usize,
    },
    /// Something that is known for a robot on a fixed base only.
    #[error("{what} are those of a robot on a fixed base, but this base floats")]
    FloatingBase {
        /// What was asked for, in the plural.
        what: &'static str,
    },
    /// An index of something that the robot has not.
    #[error(transparent)]
    Index(#[from] IndexError),
}

/// An index that lies beyond what it indexes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{what} {index} does not exist: there are {count}, counted from 0")]
pub struct IndexError {
    /// What is indexed, in the singular.
    pub what: &'static str,
    /// The index.
    pub index: usize,
    /// How many of them there are.
    pub count: usize,
}

/// `Ok` if `index` is below `count`, else an error that names `what` it should index.
pub fn check_index(what: &'static str, index: usize, count: usize) -> Result<(), IndexError> {
    if index < count { Ok(()) } else { Err(IndexError { what, index, count }) }
}

/// `Ok` if `found` is `expected`, else an error that names `what`.
pub fn check_size(what: &'static str, found: usize, expected: usize) -> Result<(), DimensionError> {
    if found == expected { Ok(()) } else { Err(DimensionError::Length { what, found, expected }) }
}
