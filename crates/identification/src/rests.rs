//! Which filtered rows count for the torque of a joint that rests now and then.

/// Share of a filter's window in which a joint must move for the row to count. What a joint that sticks
/// carries comes before its motion: with half of a window at rest it had effects for names that are not there
/// (`cargo xtask undeclared --suite wide_right --situation sticking`).
const LEAST_MOVING: f64 = 0.9;

/// Whether a joint moves, given the filtered share of samples in which it does.
pub(crate) fn moves(share: f64) -> bool {
    share >= LEAST_MOVING
}
