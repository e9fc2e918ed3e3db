//! What can go wrong with a support polygon.

/// Why there is no support polygon.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SupportError {
    /// A contact is NaN or infinite.
    #[error("contact {0} has a coordinate that is not a finite number")]
    NotFinite(usize),
    /// No area.
    #[error(
        "the {contacts} contacts enclose {area} m²: a robot stands on at least three that are not in a line"
    )]
    NoArea {
        /// How many there are.
        contacts: usize,
        /// What they enclose \[m²\].
        area: f64,
    },
    /// A foot names a body that is not there.
    #[error("a foot is fixed to body {body}, but there are placements of {bodies} bodies")]
    NoSuchBody {
        /// The index.
        body: usize,
        /// How many there are.
        bodies: usize,
    },
    /// The reduction coefficient is none.
    #[error("the reduction coefficient alpha is {0}: it must be from 0 (the whole polygon) to 1 (a point)")]
    Alpha(f64),
    /// The polygon cannot shrink to a point outside it.
    #[error(
        "the polygon cannot shrink to {0:?} m, which is outside it: name a point inside, its centroid for one"
    )]
    ShrinksToOutside([f64; 2]),
}
