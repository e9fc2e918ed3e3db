//! Positions that are read less often than they are logged, between their readings.

use crate::LogError;
use crate::clock::lagrange;
use crate::columns::Layout;
use crate::reader::{Row, Rows};
use crate::segments::RowCounts;
use std::collections::VecDeque;
use std::path::Path;

/// A value that lasts longer than this many times the usual rows was read again and had not changed.
const LONGER: f64 = 1.5;
/// How far ahead readings are looked for, in usual numbers of rows: two readings of a position that moves,
/// and one that is late.
const AHEAD: f64 = 3.5;

/// Rows whose held positions are those of the cubic through the two readings before and the two behind, each
/// at the stamp of the row in which it first stands. A position that is held is late by half of its rows on
/// the mean, and its accelerations are those of steps.
///
/// Behind the last reading of a segment they go on as a parabola, for as many rows as a reading is held.
pub(crate) struct BetweenReadings<R> {
    rows: R,
    held: Vec<HeldPosition>,
    /// Rows that are read ahead.
    reach: usize,
    ahead: VecDeque<(Row, Vec<f64>)>,
    spare: Vec<Vec<f64>>,
}

struct HeldPosition {
    place: usize,
    /// Rows for which a reading is held, on the mean.
    usual: f64,
    /// The value that is under way in the rows read ahead, and for how many rows it has been.
    run: Option<(f64, f64)>,
    /// Stamps and values, from the last but two before the next row on.
    readings: VecDeque<(f64, f64)>,
}

impl HeldPosition {
    /// The next row that is read ahead.
    fn read(&mut self, values: &[f64]) {
        let (t, value) = (values[0], values[self.place]);
        let rows = match self.run {
            Some((last, rows)) if last == value => rows + 1.0,
            _ => 0.0,
        };
        self.run = Some((value, rows));
        let anew = rows >= LONGER * self.usual && rows % self.usual.round().max(1.0) == 0.0;
        if rows == 0.0 || anew {
            self.readings.push_back((t, value));
        }
    }

    /// The position at a stamp. Stamps are asked for in ascending order.
    fn at(&mut self, t: f64, value: f64) -> f64 {
        while self.readings.len() > 3 && self.readings[3].0 <= t {
            self.readings.pop_front();
        }
        let last = self.readings.iter().take_while(|(stamp, _)| *stamp <= t).count();
        let (Some(before), Some(behind)) = (last.checked_sub(1), self.readings.get(last)) else {
            return self.behind_the_last(t).unwrap_or(value);
        };
        let (before, behind) = (self.readings[before], *behind);
        if before.0 == t {
            return before.1;
        }
        let outer = last.checked_sub(2).map(|place| self.readings[place]).zip(self.readings.get(last + 1));
        let Some((earlier, &later)) = outer else {
            let share = (t - before.0) / (behind.0 - before.0);
            return before.1 + share * (behind.1 - before.1);
        };
        let four = [earlier, before, behind, later];
        lagrange(four.map(|(stamp, _)| stamp), t).iter().zip(four).map(|(weight, (_, q))| weight * q).sum()
    }

    /// On the parabola through the last three readings.
    fn behind_the_last(&self, t: f64) -> Option<f64> {
        let three = [self.readings.front()?, self.readings.get(1)?, self.readings.get(2)?];
        let weight = |one: usize| {
            let others = (0..3).filter(|&other| other != one);
            others.map(|other| (t - three[other].0) / (three[one].0 - three[other].0)).product::<f64>()
        };
        Some((0..3).map(|one| weight(one) * three[one].1).sum())
    }

    fn end_segment(&mut self) {
        self.run = None;
        self.readings.clear();
    }
}

impl<R: Rows> BetweenReadings<R> {
    /// `held` are the rows for which each joint's position is held on the mean; 1, or no entry, where it is
    /// read anew in every row.
    pub fn new(rows: R, held: &[f64]) -> Self {
        let first = rows.layout().q();
        let is_held = held.iter().enumerate().filter(|(_, rows)| **rows > 1.0);
        let of_joint = |(joint, &usual): (usize, &f64)| HeldPosition {
            place: first + joint,
            usual,
            run: None,
            readings: VecDeque::new(),
        };
        let held: Vec<HeldPosition> = is_held.map(of_joint).collect();
        let longest = held.iter().map(|held| held.usual).fold(0.0, f64::max);
        BetweenReadings {
            rows,
            held,
            reach: (AHEAD * longest).ceil() as usize,
            ahead: VecDeque::new(),
            spare: Vec::new(),
        }
    }

    /// The rows as they are.
    pub fn into_inner(self) -> R {
        self.rows
    }
}

impl<R: Rows> Rows for BetweenReadings<R> {
    fn layout(&self) -> &Layout {
        self.rows.layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        if self.held.is_empty() {
            return self.rows.next(values);
        }
        let is_sample = |row: &Row| matches!(row, Row::Sample { .. });
        while self.ahead.len() < self.reach && self.ahead.back().is_none_or(|(row, _)| is_sample(row)) {
            let mut next = self.spare.pop().unwrap_or_else(|| vec![0.0; values.len()]);
            let row = self.rows.next(&mut next)?;
            if is_sample(&row) {
                self.held.iter_mut().for_each(|held| held.read(&next));
            }
            self.ahead.push_back((row, next));
        }
        let Some((row, next)) = self.ahead.pop_front() else { return Ok(Row::End) };
        values.copy_from_slice(&next);
        self.spare.push(next);
        if is_sample(&row) {
            let t = values[0];
            self.held.iter_mut().for_each(|held| values[held.place] = held.at(t, values[held.place]));
        } else {
            self.held.iter_mut().for_each(HeldPosition::end_segment);
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
    use crate::Recording;
    use crate::recording::RecordingRows;
    use proptest::prelude::*;

    /// Positions of one joint as they are read back, and the moments of the rows.
    fn read(position: impl Fn(f64) -> f64, pattern: &[usize], rows: usize, held: f64) -> Vec<(f64, f64)> {
        let t: Vec<f64> = (0..rows).map(|row| 0.005 * row as f64).collect();
        let (mut q, mut until, mut runs) = (Vec::new(), 0, pattern.iter().cycle());
        for (row, t) in t.iter().enumerate() {
            if row == until {
                until += runs.next().unwrap();
                q.push(position(*t));
            } else {
                q.push(q[row - 1]);
            }
        }
        let recording = Recording { joints: vec!["a".into()], t, q, ..Recording::default() };
        let mut rows = BetweenReadings::new(RecordingRows::new(&recording), &[held]);
        let (mut values, mut read) = ([0.0; 2], Vec::new());
        while let Row::Sample { .. } = rows.next(&mut values).unwrap() {
            read.push((values[0], values[1]));
        }
        read
    }

    #[test]
    fn a_cubic_is_read_as_it_was() {
        let position = |t: f64| 0.3 - t + 2.0 * t * t - 0.7 * t * t * t;
        for (pattern, held) in [(&[4][..], 4.0), (&[3, 4, 3][..], 10.0 / 3.0)] {
            let read = read(position, pattern, 400, held);
            assert_eq!(read.len(), 400);
            // The first reading has none before it, the last none behind.
            for (t, q) in &read[5..385] {
                assert!((q - position(*t)).abs() < 1e-12, "{t}: {q}, not {}", position(*t));
            }
        }
    }

    #[test]
    fn a_rest_stays_a_rest_and_the_motion_behind_it_begins_when_it_does() {
        let position = |t: f64| if t < 1.0 { 0.5 } else { 0.5 + (t - 1.0) * (t - 1.0) };
        let read = read(position, &[4], 400, 4.0);
        for (t, q) in read.iter().filter(|(t, _)| *t < 0.97) {
            assert!((q - 0.5).abs() < 1e-12, "{t}: {q}");
        }
        for (t, q) in &read[..385] {
            assert!((q - position(*t)).abs() < 1e-4, "{t}: {q}");
        }
    }

    proptest! {
        #[test]
        fn what_is_not_held_stays_as_it_is(values in prop::collection::vec(-1.0..1.0_f64, 1..40)) {
            let position = |t: f64| values[(t / 0.005).round() as usize];
            for (row, (_, q)) in read(position, &[1], values.len(), 1.0).into_iter().enumerate() {
                prop_assert_eq!(q, values[row]);
            }
        }
    }
}
