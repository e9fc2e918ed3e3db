//! Which axis of an array is the time.

/// What the time may be called; the first that is there says how many rows there are.
const TIMES: [&str; 6] = ["t", "time", "timestamp", "timestamps", "stamp", "times"];

/// Which index of an array goes through its bytes fastest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    /// The last: C.
    LastFastest,
    /// The first: Fortran.
    FirstFastest,
}

/// How many rows a log of these arrays (names without groups, and shapes) has: the time's entries, or as many
/// as the longest array has.
pub(crate) fn row_count<'a>(arrays: impl Iterator<Item = (&'a str, &'a [usize])> + Clone) -> usize {
    let is_line = |shape: &[usize]| shape.iter().filter(|&&size| size > 1).count() <= 1;
    let time =
        TIMES.iter().find_map(|time| arrays.clone().find(|(name, shape)| name == time && is_line(shape)));
    match time {
        Some((_, shape)) => shape.iter().fold(1, |rows: usize, &size| rows.saturating_mul(size)),
        None => arrays.map(|(_, shape)| shape.first().copied().unwrap_or(0)).max().unwrap_or(0),
    }
}

/// Numbers of a row, and whether a row's numbers lie side by side (else those of all rows for each number).
/// `None` where no axis is as long as the time. Axes of length 1 say nothing.
pub(crate) fn orientation(shape: &[usize], rows: usize, order: Order) -> Option<(usize, bool)> {
    let shape: Vec<usize> = shape.iter().copied().filter(|&size| size != 1).collect();
    match (shape.as_slice(), order) {
        ([], _) if rows == 1 => Some((1, true)),
        ([only], _) if *only == rows => Some((1, true)),
        ([first, width], Order::LastFastest) if *first == rows => Some((*width, true)),
        ([first, width], Order::FirstFastest) if *first == rows => Some((*width, false)),
        // The time goes along the other axis.
        ([width, second], Order::LastFastest) if *second == rows => Some((*width, false)),
        ([width, second], Order::FirstFastest) if *second == rows => Some((*width, true)),
        _ => None,
    }
}

/// The name of an entry of an array.
pub(crate) fn entry_name(name: &str, width: usize, entry: usize) -> String {
    if width == 1 { name.to_owned() } else { format!("{name}[{entry}]") }
}
