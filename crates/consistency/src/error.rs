//! What is wrong with a problem.

/// A problem that cannot be posed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConsistencyError {
    /// A list has the wrong length.
    #[error("{what}: {found} numbers where {expected} are needed")]
    Size {
        /// What was given.
        what: &'static str,
        /// How many are needed.
        expected: usize,
        /// How many there are.
        found: usize,
    },
    /// Something that does not exist was named.
    #[error("{what} {index} does not exist: there are {count}")]
    Index {
        /// What was named.
        what: &'static str,
        /// Its index.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A number is not finite, or is out of range.
    #[error("{what} is {value}, which is {wrong}")]
    Number {
        /// What was given.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What is wrong with it.
        wrong: &'static str,
    },
    /// A prior is no possible body.
    #[error("the prior of body {body} is no possible body; mend it with `possible_priors` first")]
    ImpossiblePrior {
        /// The body.
        body: usize,
    },
    /// Nothing lies strictly within the constraints.
    #[error("constraint {constraint} leaves nothing: {why}")]
    Empty {
        /// Its place among all that were added.
        constraint: usize,
        /// Why.
        why: &'static str,
    },
}
