//! Rows of zeros between rows that are far from zero: a driver missed a message, and logged what it had not
//! got.

use crate::LogError;
use crate::clock::lagrange;
use crate::columns::Layout;
use crate::gap::GapReason;
use crate::reader::{Row, Rows};
use crate::segments::RowCounts;
use phiw_spikes::{LONGEST, WINDOW};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::Range;
use std::path::Path;

/// By how much zeros must leave the line between the rows before and behind them, less what that line rises,
/// in multiples of what is usual (the median bend of the signal). Zeros that noise or a crossing brings about
/// are below.
const BEYOND_USUAL: f64 = 10.0;

/// Rows that were zeros, by what was zero in them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct ZeroRows {
    /// All positions; perhaps the torques, too.
    pub positions: u64,
    /// All torques, and not all positions.
    pub torques: u64,
}

/// The signals that are zero together: those of all joints of one kind that there are.
fn groups(layout: &Layout) -> Vec<Vec<usize>> {
    let places = |range: Range<usize>| range.collect::<Vec<usize>>();
    let torques = if layout.torque { places(layout.tau()..layout.tau() + layout.joints) } else { Vec::new() };
    let optional = [&layout.qd, &layout.qdd].map(|places| places.iter().flatten().copied().collect());
    let mut groups = vec![places(layout.q()..layout.q() + layout.joints), torques];
    groups.extend(optional);
    groups
}

fn all_zero(group: &[usize], values: &[f64]) -> bool {
    !group.is_empty() && group.iter().all(|place| values[*place] == 0.0)
}

/// By how much zeros are off the line from `before` to `behind`, less what that line rises.
fn excess(before: f64, behind: f64) -> f64 {
    if before * behind <= 0.0 {
        return f64::NEG_INFINITY;
    }
    before.abs().min(behind.abs()) - (behind - before).abs()
}

/// Finds out whether there are such rows.
pub(crate) struct ZeroRowFinder {
    /// Positions and torques.
    groups: Vec<Vec<usize>>,
    /// For each of these the rows of zeros that are under way, and the row before them.
    current: Vec<(usize, Option<Vec<f64>>)>,
    /// The largest excess at each place.
    most: Vec<f64>,
}

impl ZeroRowFinder {
    pub fn new(layout: &Layout) -> Self {
        let groups: Vec<_> = groups(layout).into_iter().take(2).collect();
        ZeroRowFinder {
            current: vec![(0, None); groups.len()],
            most: vec![f64::NEG_INFINITY; layout.width],
            groups,
        }
    }

    /// The next sample of a segment, and the one before it.
    pub fn push(&mut self, before: Option<&[f64]>, values: &[f64]) {
        for (group, (zeros, last)) in self.groups.iter().zip(&mut self.current) {
            if all_zero(group, values) {
                if *zeros == 0 {
                    *last = before.map(<[f64]>::to_vec);
                }
                *zeros += 1;
            } else if *zeros > 0 {
                if let Some(last) = last.take().filter(|_| *zeros <= LONGEST) {
                    for &place in group {
                        self.most[place] = self.most[place].max(excess(last[place], values[place]));
                    }
                }
                *zeros = 0;
            }
        }
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.current.iter_mut().for_each(|current| *current = (0, None));
    }

    /// What an excess must be above at each place, where any is; `usual` is the median bend at a place.
    pub fn bounds(&self, usual: impl Fn(usize) -> f64) -> Option<Vec<f64>> {
        if self.most.iter().all(|most| *most == f64::NEG_INFINITY) {
            return None;
        }
        let bounds: Vec<f64> = (0..self.most.len()).map(|place| BEYOND_USUAL * usual(place)).collect();
        self.most.iter().zip(&bounds).any(|(most, bound)| most > bound).then_some(bounds)
    }
}

/// Rows in which such zeros are bridged: by the cubic through the two rows before and the two behind, as
/// where samples are interpolated to the clock's times. The stamps stay as they are, so that one message that
/// is missed neither parts the log nor shifts what follows.
pub(crate) struct WithoutZeroRows<R> {
    rows: R,
    /// As [`ZeroRowFinder::bounds`] gives them; nothing is bridged where there are none.
    bounds: Vec<f64>,
    /// Stamps that are further apart than this are not bridged \[s\].
    longest_step: f64,
    groups: Vec<Vec<usize>>,
    ahead: VecDeque<(Row, Vec<f64>)>,
    spare: Vec<Vec<f64>>,
    /// The last two rows of the segment, the later first.
    before: [Option<Vec<f64>>; 2],
    /// Rows at the front of those read ahead that have been bridged already.
    bridged: usize,
    counts: ZeroRows,
    first_line: u64,
}

impl<R: Rows> WithoutZeroRows<R> {
    pub fn new(rows: R, bounds: Vec<f64>, longest_step: f64) -> Self {
        WithoutZeroRows {
            groups: groups(rows.layout()),
            rows,
            bounds,
            longest_step,
            ahead: VecDeque::new(),
            spare: Vec::new(),
            before: [None, None],
            bridged: 0,
            counts: ZeroRows::default(),
            first_line: 0,
        }
    }

    /// The rows as they are.
    pub fn into_inner(self) -> R {
        self.rows
    }

    /// What was bridged so far.
    pub fn counts(&self) -> ZeroRows {
        self.counts
    }

    fn fill(&mut self) -> Result<(), LogError> {
        let is_sample = |row: &Row| matches!(row, Row::Sample { .. });
        while self.ahead.len() < WINDOW && self.ahead.back().is_none_or(|(row, _)| is_sample(row)) {
            let mut values = self.spare.pop().unwrap_or_else(|| vec![0.0; self.bounds.len()]);
            let row = self.rows.next(&mut values)?;
            self.ahead.push_back((row, values));
        }
        Ok(())
    }

    /// The values of a sample read ahead.
    fn sample(&self, place: usize) -> Option<&[f64]> {
        let (row, values) = self.ahead.get(place)?;
        matches!(row, Row::Sample { .. }).then_some(values)
    }

    /// How many rows read ahead, from the first on, are zeros of this group that say nothing.
    fn zeros(&self, group: &[usize]) -> usize {
        let zeros = (0..self.ahead.len())
            .take_while(|&place| self.sample(place).is_some_and(|values| all_zero(group, values)))
            .count();
        let (Some(before), Some(behind)) = (&self.before[0], self.sample(zeros)) else { return 0 };
        let near = behind[0] - before[0] <= (zeros + 1) as f64 * self.longest_step;
        let off = |place: &usize| excess(before[*place], behind[*place]) > self.bounds[*place];
        if zeros <= LONGEST && near && group.iter().any(off) { zeros } else { 0 }
    }

    fn bridge(&mut self) {
        let Some(group) = (0..2).find(|&group| self.zeros(&self.groups[group]) > 0) else { return };
        let zeros = self.zeros(&self.groups[group]);
        let (Some(before), Some(behind)) = (self.before[0].clone(), self.sample(zeros).map(<[f64]>::to_vec))
        else {
            return;
        };
        let further = self.sample(zeros + 1).filter(|values| !all_zero(&self.groups[group], values));
        let outer = self.before[1].clone().zip(further.map(<[f64]>::to_vec));
        for (row, values) in self.ahead.iter_mut().take(zeros) {
            let Row::Sample { line } = *row else { continue };
            if self.counts == ZeroRows::default() {
                self.first_line = line;
            }
            if group == 0 {
                self.counts.positions += 1
            } else {
                self.counts.torques += 1
            }
            for places in
                self.groups.iter().filter(|places| all_zero(places, values)).cloned().collect::<Vec<_>>()
            {
                for place in places {
                    values[place] = match &outer {
                        Some((earlier, later)) => {
                            let four = [earlier, &before, &behind, later];
                            let weights = lagrange(four.map(|row| row[0]), values[0]);
                            weights.iter().zip(four).map(|(weight, row)| weight * row[place]).sum()
                        }
                        None => {
                            let share = (values[0] - before[0]) / (behind[0] - before[0]);
                            before[place] + share * (behind[place] - before[place])
                        }
                    };
                }
            }
        }
        self.bridged = zeros;
    }
}

impl<R: Rows> Rows for WithoutZeroRows<R> {
    fn layout(&self) -> &Layout {
        self.rows.layout()
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        if self.bounds.is_empty() {
            return self.rows.next(values);
        }
        self.fill()?;
        if self.bridged == 0 {
            self.bridge();
        }
        self.bridged = self.bridged.saturating_sub(1);
        let Some((row, next)) = self.ahead.pop_front() else { return Ok(Row::End) };
        values.copy_from_slice(&next);
        match row {
            Row::Sample { .. } => {
                self.before.swap(0, 1);
                self.spare.extend(self.before[0].replace(next));
            }
            _ => {
                self.spare.extend(self.before.iter_mut().filter_map(Option::take));
                self.spare.push(next);
            }
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
        let bridged = self.counts.positions + self.counts.torques;
        counts.used = counts.used.saturating_sub(bridged);
        counts.add(GapReason::ZeroRow, bridged, self.first_line);
    }
}
