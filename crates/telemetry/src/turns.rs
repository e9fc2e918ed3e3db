//! Angles that begin anew after a turn: an encoder of one turn, or a driver that keeps angles within ±π.

use crate::LogError;
use crate::columns::Layout;
use crate::reader::{Row, Rows};
use crate::segments::RowCounts;
use std::f64::consts::{PI, TAU};
use std::path::Path;

/// Steps of an angle up to which the next one is foreseen well enough to tell a turn from motion \[rad\]: a
/// robot moves less from row to row, and what is in degrees or millimetres moves more.
const SLOW: f64 = 0.5;
/// What a turn may differ from the step before, less what that step is \[rad\].
const NOISE: f64 = 0.1;

/// Rows whose positions run on where they jump by a turn. Across a gap nothing is known, and the turns so far
/// stay.
pub(crate) struct WithoutTurns<R> {
    rows: R,
    /// For each joint its position in the log in the row before, and the step that led there.
    before: Vec<Option<(f64, f64)>>,
    /// What is added to each joint's positions \[rad\].
    added: Vec<f64>,
    counts: Vec<u64>,
}

impl<R: Rows> WithoutTurns<R> {
    pub fn new(rows: R) -> Self {
        let joints = rows.layout().joints;
        WithoutTurns { rows, before: vec![None; joints], added: vec![0.0; joints], counts: vec![0; joints] }
    }

    /// The rows as they are.
    pub fn into_inner(self) -> R {
        self.rows
    }

    /// How often each joint's position jumped by a turn so far.
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }
}

/// The turn that a step is, if it is none of the motion: the step before was slow, and this one is like it
/// but for a turn.
fn turn(step: f64, before: f64) -> Option<f64> {
    if step.abs() < PI || before.abs() > SLOW {
        return None;
    }
    let turn = TAU.copysign(step);
    ((step - turn - before).abs() < NOISE + before.abs()).then_some(turn)
}

impl<R: Rows> Rows for WithoutTurns<R> {
    fn layout(&self) -> &Layout {
        self.rows.layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        let row = self.rows.next(values)?;
        if !matches!(row, Row::Sample { .. }) {
            self.before.fill(None);
            return Ok(row);
        }
        let first = self.rows.layout().q();
        for (joint, before) in self.before.iter_mut().enumerate() {
            let position = values[first + joint];
            let mut step = before.map_or(0.0, |(earlier, _)| position - earlier);
            if let Some(turn) = before.and_then(|(_, last)| turn(step, last)) {
                self.added[joint] -= turn;
                self.counts[joint] += 1;
                step -= turn;
            }
            *before = Some((position, step));
            values[first + joint] += self.added[joint];
        }
        Ok(row)
    }

    fn progress(&self) -> (u64, u64) {
        self.rows.progress()
    }

    fn path(&self) -> &Path {
        self.rows.path()
    }

    fn rows_are(&self) -> &'static str {
        self.rows.rows_are()
    }

    fn account(&self, counts: &mut RowCounts) {
        self.rows.account(counts);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_a_jump_out_of_slow_motion() {
        assert_eq!(turn(0.02 - TAU, 0.02), Some(-TAU));
        assert_eq!(turn(TAU - 0.3, -0.28), Some(TAU));
        // No step is known before the second row.
        assert_eq!(turn(TAU + 0.05, 0.0), Some(TAU));
        // Degrees, or millimetres, of a quick motion.
        assert_eq!(turn(6.3, 6.1), None);
        // A spike of another size.
        assert_eq!(turn(5.0, 0.01), None);
        assert_eq!(turn(2.0 * TAU, 0.01), None);
        assert_eq!(turn(0.4, 0.1), None);
    }
}
