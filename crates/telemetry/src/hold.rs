//! Values that a logger writes down several times: the log is faster than the bus that it reads.
//!
//! A coarse encoder repeats its value, too, but when it changes, it changes by one of its steps. What is held
//! jumps: it comes by all the motion since it was last read. So the runs of one value are counted that begin
//! and end with a jump of more than a step. A signal that is read anew in every row has runs of one row
//! there, however long it rests elsewhere and however coarse it is; one that is held for four rows has runs
//! of four.

use crate::columns::Layout;

/// Longest run that is told from longer ones, in rows.
const LONGEST: usize = 64;
/// A difference above this many smallest ones is a jump: it is not one step of a coarse signal, whatever the
/// digits of the log made of that.
const STEPS_OF_A_JUMP: f64 = 1.5;
/// Fewer runs between jumps than this tell nothing.
const FEWEST: u64 = 8;
/// The least share of all runs that lie between jumps: a coarse signal that noise moves changes by one step
/// nearly always, and its few jumps tell of the noise.
const LEAST_SHARE: f64 = 0.1;
/// By how much runs may be shorter than the usual one on the mean over all, as a share of it: what is held
/// changes at no other time, and a value that is read more often does.
const SHORTER: f64 = 0.125;
/// The same in rows: a ratio of rates that is no whole number gives runs of two lengths.
const ROUNDING: f64 = 0.5;

/// Runs of a value by their length in rows; the last entry has all longer ones.
type Runs = [u64; LONGEST + 1];

/// For how many rows a value is held.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hold {
    /// The usual number of rows, at least 2.
    pub rows: usize,
    /// Their mean number between jumps.
    pub mean: f64,
}

impl Hold {
    /// From the runs `between_jumps` and from `all` runs; `None` where a value is read anew in every row, or
    /// nothing tells.
    fn of(between_jumps: &Runs, all: &Runs) -> Option<Self> {
        let count: u64 = between_jumps.iter().sum();
        if count < FEWEST || (count as f64) < LEAST_SHARE * all.iter().sum::<u64>() as f64 {
            return None;
        }
        let mut below = 0;
        let usual = between_jumps.iter().position(|runs| {
            below += runs;
            2 * below >= count
        })?;
        if !(2..LONGEST).contains(&usual) {
            return None;
        }
        let mean = |runs: &Runs, longest: usize| {
            let sum: u64 = runs.iter().enumerate().map(|(rows, runs)| rows.min(longest) as u64 * runs).sum();
            sum as f64 / runs.iter().sum::<u64>() as f64
        };
        let shorter = usual as f64 - mean(all, usual);
        let regular = shorter <= ROUNDING.max(SHORTER * usual as f64);
        regular.then(|| Hold { rows: usual, mean: mean(between_jumps, LONGEST) })
    }
}

/// Counts the runs of a signal.
#[derive(Debug)]
pub(crate) struct RunCounter {
    between_jumps: Runs,
    all: Runs,
    /// Rows of the run that is under way, and whether it began with a jump; `None` before the first change of
    /// a segment, since nobody knows when that run began.
    current: Option<(usize, bool)>,
}

impl RunCounter {
    pub fn new() -> Self {
        RunCounter { between_jumps: [0; LONGEST + 1], all: [0; LONGEST + 1], current: None }
    }

    /// The next row has the value of the one before.
    pub fn repeat(&mut self) {
        if let Some((rows, _)) = &mut self.current {
            *rows += 1;
        }
    }

    /// The next row has another value.
    pub fn change(&mut self, jump: bool) {
        if let Some((rows, from_jump)) = self.current {
            let rows = rows.min(LONGEST);
            self.all[rows] += 1;
            self.between_jumps[rows] += u64::from(from_jump && jump);
        }
        self.current = Some((1, jump));
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.current = None;
    }

    pub fn hold(&self) -> Option<Hold> {
        Hold::of(&self.between_jumps, &self.all)
    }
}

/// Whether a difference is a jump, by the smallest difference of the signal so far, which it makes smaller.
pub(crate) fn is_jump(difference: f64, least: &mut f64) -> bool {
    *least = least.min(difference);
    difference > STEPS_OF_A_JUMP * *least
}

/// Finds out whether whole rows are held: all positions, torques, velocities and accelerations at once.
pub(crate) struct HeldRowFinder {
    /// Places of a row that are compared.
    places: Vec<usize>,
    /// Values of the row before, and the smallest difference of each so far.
    before: Vec<(f64, f64)>,
    first: bool,
    runs: RunCounter,
}

impl HeldRowFinder {
    pub fn new(layout: &Layout) -> Self {
        let places = compared(layout);
        HeldRowFinder {
            before: vec![(f64::NAN, f64::INFINITY); places.len()],
            places,
            first: true,
            runs: RunCounter::new(),
        }
    }

    /// The next sample `[t, q…, …]` of a segment.
    pub fn push(&mut self, values: &[f64]) {
        let (mut change, mut jump) = (false, false);
        for (&place, (before, least)) in self.places.iter().zip(&mut self.before) {
            let difference = (values[place] - *before).abs();
            if difference > 0.0 {
                change = true;
                jump |= is_jump(difference, least);
            }
            *before = values[place];
        }
        match (std::mem::replace(&mut self.first, false), change) {
            (true, _) => {}
            (false, true) => self.runs.change(jump),
            (false, false) => self.runs.repeat(),
        }
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.first = true;
        self.before.iter_mut().for_each(|(before, _)| *before = f64::NAN);
        self.runs.end_segment();
    }

    pub fn hold(&self) -> Option<Hold> {
        self.runs.hold()
    }
}

/// The places of a row in which repeats are looked for: all that are measured and may not be missing.
pub(crate) fn compared(layout: &Layout) -> Vec<usize> {
    (1..layout.width).filter(|place| !layout.may_be_missing(*place)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    /// For how many rows the rows are held of a robot of two joints: 4000 rows of time, in rows, to two
    /// positions and two torques, each read when `read` says for the row.
    fn held(read: impl Fn(usize) -> usize, signals: impl Fn(f64, usize) -> [f64; 4]) -> Option<usize> {
        let mut finder = HeldRowFinder::new(&Layout::new(2, true, |_, _| false));
        for row in 0..4000 {
            let [a, b, c, d] = signals(read(row) as f64, read(row));
            finder.push(&[row as f64, a, b, c, d]);
        }
        finder.hold().map(|hold| hold.rows)
    }

    fn every(rows: usize) -> impl Fn(usize) -> usize {
        move |row| row / rows * rows
    }

    /// The latest of these rows, over and over.
    fn at(pattern: &'static [usize]) -> impl Fn(usize) -> usize {
        let length: usize = pattern.iter().sum();
        move |row| {
            let mut start = row / length * length;
            for run in pattern {
                if row < start + run {
                    break;
                }
                start += run;
            }
            start
        }
    }

    fn in_steps(x: f64, step: f64) -> f64 {
        (x / step).round() * step
    }

    fn noise(row: usize, stream: u64) -> f64 {
        StdRng::seed_from_u64(row as u64 * 7 + stream).random_range(-1.0..1.0)
    }

    /// A motion with encoders of a ten-thousandth, and torques with noise.
    fn moving(t: f64, row: usize) -> [f64; 4] {
        let q = |t: f64| in_steps((0.01 * t).sin() + 0.3 * (0.037 * t).sin(), 1e-4);
        [q(t), q(t + 50.0), q(t - 9.0) + 0.02 * noise(row, 0), q(t + 20.0) + 0.02 * noise(row, 1)]
    }

    /// The same with rests, of which nothing is heard: a simulator has no noise.
    fn with_rests(t: f64, row: usize) -> [f64; 4] {
        let t = if t % 1000.0 < 700.0 { (t / 1000.0).floor() * 1000.0 } else { t };
        moving(t, if t == row as f64 { row } else { 0 })
    }

    /// `explain` named false delays and left 13 % of a log in which each row of its bus stood four times, and
    /// `check` found nothing.
    #[test]
    fn what_is_held_is_told_from_what_rests_or_is_coarse() {
        check("as it comes", held(every(1), moving), None);
        for rows in [2, 3, 4, 5, 16, 50] {
            check("held", held(every(rows), moving), Some(rows));
        }
        check("held unevenly", held(at(&[3, 4, 4, 5]), moving), Some(4));
        check("held very unevenly", held(at(&[8, 12, 10, 7, 10, 13]), moving), Some(10));
        check("rates of 2.5", held(at(&[2, 3]), moving), Some(2));
        check("a message is lost now and then", held(at(&[4, 4, 4, 4, 8, 4, 4, 4, 12]), moving), Some(4));
        check("a fifth of the rows twice", held(at(&[1, 1, 1, 2]), moving), None);
        check("a simulator's rests", held(every(1), with_rests), None);
        check("a simulator's rests, held", held(every(4), with_rests), Some(4));
        check("at rest all the time", held(every(1), |_, _| [0.1, 0.2, 3.0, 0.0]), None);
        // A robot at rest, whose readings go to and fro between two steps.
        let resting = |row: usize, stream| f64::from(u8::from(noise(row, stream) > 0.8));
        check(
            "coarse at rest",
            held(every(1), |_, row| [0.001 * resting(row, 0), 0.5, 0.1 * resting(row, 1), 2.0]),
            None,
        );
        // Five rows to each step of the encoder, and a torque that nothing moves.
        let constant = |t: f64, _: usize| [in_steps(0.0002 * t, 0.001), 0.5, 1.5, 2.0];
        check("constant speed, coarse", held(every(1), constant), None);
        let there_and_back = |t: f64, row: usize| constant((t % 1000.0 - 500.0).abs(), row);
        check("there and back, coarse", held(every(1), there_and_back), None);
        let coarse = |t: f64, row: usize| {
            let [a, b, c, d] = moving(0.1 * t, row / 100);
            [in_steps(a, 0.01), in_steps(b, 0.01), in_steps(c, 0.1), in_steps(d, 0.1)]
        };
        check("a slow motion, coarse all over", held(every(1), coarse), None);
        // Torques as they were commanded, four rows each, and coarse encoders that are read in every row.
        let commanded = |t: f64, row: usize| {
            let [a, b, ..] = moving(t, row);
            let [_, _, c, d] = moving((row / 4 * 4) as f64, row / 4 * 4);
            [in_steps(a, 0.05), in_steps(b, 0.05), c, d]
        };
        check("torques alone are held", held(every(1), commanded), None);
    }

    /// A torque in coarse steps, moved by noise that remembers: of 8595 changes 109 were no single step, and
    /// it was said to be held for two rows.
    #[test]
    fn a_coarse_torque_that_noise_moves_is_not_held() {
        let runs = |counts: &[(usize, u64)]| {
            let mut runs = [0; LONGEST + 1];
            counts.iter().for_each(|(rows, count)| runs[*rows] = *count);
            runs
        };
        let between_jumps = runs(&[(1, 15), (2, 70), (3, 17), (4, 4), (5, 1)]);
        let all = runs(&[(1, 4268), (2, 2769), (3, 908), (4, 312), (5, 153), (6, 73), (7, 38), (8, 26)]);
        assert_eq!(Hold::of(&between_jumps, &all), None);
        assert_eq!(Hold::of(&between_jumps, &between_jumps).map(|hold| hold.rows), Some(2));
    }

    fn check(case: &str, found: Option<usize>, expected: Option<usize>) {
        assert_eq!(found, expected, "{case}");
    }
}
