//! Rows that a logger wrote down several times, once.

use crate::LogError;
use crate::columns::Layout;
use crate::gap::GapReason;
use crate::hold::compared;
use crate::reader::{Row, Rows};
use crate::segments::RowCounts;
use std::path::Path;

/// Rows of which those are left out that repeat the one before in all that is measured. The first row of a
/// run is the one that was just read, and is kept with its stamp.
///
/// A run of more than twice the usual rows is a robot at rest, whose new readings are the old ones: of these
/// one in the usual number is kept.
pub(crate) struct WithoutHeld<R> {
    rows: R,
    /// Rows for which a row is usually held; 1 where nothing is left out.
    usual: usize,
    places: Vec<usize>,
    /// The first row of the run, if there is one, and how many have repeated it.
    run: Vec<f64>,
    repeats: Option<usize>,
    /// Stamp and line of a row of the run that may turn out to be a new reading.
    perhaps: Option<(f64, u64)>,
    /// The same of one that has turned out to be one, and is next.
    next: Option<(f64, u64)>,
    left_out: u64,
    first_line: u64,
}

impl<R: Rows> WithoutHeld<R> {
    pub fn new(rows: R, usual: usize) -> Self {
        WithoutHeld {
            places: compared(rows.layout()),
            run: vec![f64::NAN; rows.layout().width],
            rows,
            usual: usual.max(1),
            repeats: None,
            perhaps: None,
            next: None,
            left_out: 0,
            first_line: 0,
        }
    }

    /// All rows.
    pub fn into_inner(self) -> R {
        self.rows
    }

    fn leave_out(&mut self, line: u64) {
        if self.left_out == 0 {
            self.first_line = line;
        }
        self.left_out += 1;
    }
}

impl<R: Rows> Rows for WithoutHeld<R> {
    fn layout(&self) -> &Layout {
        self.rows.layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        if self.usual == 1 {
            return self.rows.next(values);
        }
        if let Some((t, line)) = self.next.take() {
            values.copy_from_slice(&self.run);
            values[0] = t;
            return Ok(Row::Sample { line });
        }
        loop {
            let row = self.rows.next(values)?;
            let Row::Sample { line } = row else {
                self.repeats = None;
                return Ok(row);
            };
            let repeats = match self.repeats {
                Some(repeats) if self.places.iter().all(|&place| values[place] == self.run[place]) => {
                    repeats + 1
                }
                _ => 0,
            };
            self.repeats = Some(repeats);
            if repeats == 0 {
                self.run.copy_from_slice(values);
                return Ok(row);
            }
            if !repeats.is_multiple_of(self.usual) || repeats == self.usual {
                if repeats == self.usual {
                    self.perhaps = Some((values[0], line));
                }
                self.leave_out(line);
                continue;
            }
            if repeats == 2 * self.usual
                && let Some((t, before)) = self.perhaps.take()
            {
                self.left_out -= 1;
                self.run.copy_from_slice(values);
                self.next = Some((values[0], line));
                values[0] = t;
                return Ok(Row::Sample { line: before });
            }
            return Ok(row);
        }
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
        counts.rows += self.left_out;
        counts.add(GapReason::Held, self.left_out, self.first_line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Recording;
    use crate::recording::RecordingRows;

    /// Stamps that are kept of one joint's positions, a row a second.
    fn kept(q: &[f64], usual: usize) -> Vec<f64> {
        let t = (0..q.len()).map(|row| row as f64).collect();
        let recording = Recording { joints: vec!["a".into()], t, q: q.to_vec(), ..Recording::default() };
        let mut rows = WithoutHeld::new(RecordingRows::new(&recording), usual);
        let (mut values, mut stamps) = ([0.0; 2], Vec::new());
        while let Row::Sample { line } = rows.next(&mut values).unwrap() {
            assert_eq!((line as f64 - 2.0, q[line as usize - 2]), (values[0], values[1]));
            stamps.push(values[0]);
        }
        let mut counts = RowCounts::default();
        rows.account(&mut counts);
        assert_eq!(stamps.len() as u64 + counts.rows, q.len() as u64);
        stamps
    }

    #[test]
    fn the_first_of_each_run_is_kept_and_rests_go_on() {
        let of = |runs: &[usize]| -> Vec<f64> {
            runs.iter().enumerate().flat_map(|(run, rows)| vec![run as f64; *rows]).collect()
        };
        assert_eq!(kept(&of(&[3, 3, 3, 2]), 3), [0.0, 3.0, 6.0, 9.0]);
        assert_eq!(kept(&of(&[1, 4, 3]), 3), [0.0, 1.0, 5.0]);
        assert_eq!(kept(&of(&[2, 2, 2]), 1), [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
        // A run of twice the usual length is a message that was lost, a longer one a rest.
        assert_eq!(kept(&of(&[3, 6, 3]), 3), [0.0, 3.0, 9.0]);
        assert_eq!(kept(&of(&[3, 12, 3]), 3), [0.0, 3.0, 6.0, 9.0, 12.0, 15.0]);
        assert_eq!(kept(&of(&[8, 2]), 2), [0.0, 2.0, 4.0, 6.0, 8.0]);
    }
}
