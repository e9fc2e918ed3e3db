//! Rows that repeat earlier ones to the last digit: a log that was put together from copies of a shorter one.
//!
//! Noise does not repeat itself, so such rows say nothing new. Counted again they would make all parameters
//! look better known than they are, and what is noise in one copy would be foretold by another.

use crate::columns::Layout;
use crate::signal_shape::LONG;
use std::collections::{HashMap, VecDeque};
use std::hash::{DefaultHasher, Hasher};

/// Rows in a row that must be the same, and those among them in which something changes.
const ROWS: usize = 64;
const CHANGES: usize = ROWS / 2;
/// Windows that are remembered; beyond, every second, every fourth, …: memory is bounded.
const MOST: usize = 1 << 18;
/// Multiplier of the rolling hash: odd, with bits in all places.
const BASE: u64 = 0x9E37_79B9_7F4A_7C15;

/// Finds stretches whose positions and torques are those of earlier rows of the log.
pub(crate) struct RepetitionFinder {
    /// Hash and stamp of the latest rows, and whether each differs from the one before.
    window: VecDeque<(u64, f64, bool)>,
    changes: usize,
    rolling: u64,
    /// `BASE` to the power of the window's length.
    leaving: u64,
    /// The last row of each remembered window, by the window's hash.
    seen: HashMap<u64, u64>,
    /// Windows whose hash has a remainder by this are not remembered.
    modulus: u64,
    row: u64,
    current: Option<Stretch>,
    found: Vec<[f64; 2]>,
}

/// Rows that are being repeated.
struct Stretch {
    /// How many rows later they come.
    later: u64,
    last_row: u64,
    from: f64,
    to: f64,
}

impl RepetitionFinder {
    pub fn new() -> Self {
        RepetitionFinder {
            window: VecDeque::with_capacity(ROWS + 1),
            changes: 0,
            rolling: 0,
            leaving: BASE.wrapping_pow(ROWS as u32),
            seen: HashMap::new(),
            modulus: 1,
            row: 0,
            current: None,
            found: Vec::new(),
        }
    }

    /// The next sample `[t, q…, …]` of a segment of a log with torques.
    pub fn push(&mut self, layout: &Layout, values: &[f64]) {
        let (joints, q, tau) = (layout.joints, layout.q(), layout.tau());
        let mut hasher = DefaultHasher::new();
        let signals = values[q..q + joints].iter().chain(&values[tau..tau + joints]);
        signals.for_each(|value| hasher.write_u64(value.to_bits()));
        self.push_hash(values[0], hasher.finish());
    }

    fn push_hash(&mut self, t: f64, hash: u64) {
        self.row += 1;
        let changes = self.window.back().is_some_and(|(before, ..)| *before != hash);
        self.window.push_back((hash, t, changes));
        self.changes += usize::from(changes);
        self.rolling = self.rolling.wrapping_mul(BASE).wrapping_add(hash);
        if self.window.len() > ROWS
            && let Some((hash, _, changes)) = self.window.pop_front()
        {
            self.rolling = self.rolling.wrapping_sub(hash.wrapping_mul(self.leaving));
            self.changes -= usize::from(changes);
        }
        // A product of odd numbers mixes upwards only: the high bits decide what is remembered.
        let decides = self.rolling >> 32;
        if self.window.len() == ROWS && self.changes >= CHANGES && decides.is_multiple_of(self.modulus) {
            self.compare();
        }
    }

    /// The latest window with those before.
    fn compare(&mut self) {
        let Some(&earlier) = self.seen.get(&self.rolling) else {
            self.seen.insert(self.rolling, self.row);
            if self.seen.len() >= MOST {
                self.modulus *= 2;
                let modulus = self.modulus;
                self.seen.retain(|window, _| (window >> 32).is_multiple_of(modulus));
            }
            return;
        };
        let (later, row) = (self.row - earlier, self.row);
        let (Some(&(_, first, _)), Some(&(_, last, _))) = (self.window.front(), self.window.back()) else {
            return;
        };
        match &mut self.current {
            Some(current) if current.later == later && row <= current.last_row + ROWS as u64 => {
                (current.last_row, current.to) = (row, last);
            }
            _ => {
                self.finish();
                self.current = Some(Stretch { later, last_row: row, from: first, to: last });
            }
        }
    }

    fn finish(&mut self) {
        let Some(Stretch { from, to, .. }) = self.current.take() else { return };
        match self.found.last_mut() {
            // The windows of two copies overlap where one follows the other.
            Some([_, end]) if from <= *end => *end = end.max(to),
            _ if to - from >= LONG => self.found.push([from, to]),
            _ => {}
        }
    }

    /// The segment is over.
    pub fn end(&mut self) {
        self.finish();
        self.window.clear();
        (self.changes, self.rolling) = (0, 0);
    }

    /// First and last stamp of each stretch \[s\], ascending.
    pub fn stretches(&self) -> Vec<[f64; 2]> {
        self.found.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::StdRng};

    /// Stretches of rows with these hashes, a thousandth of a second apart.
    fn found(hashes: &[u64]) -> Vec<[u64; 2]> {
        let mut finder = RepetitionFinder::new();
        hashes.iter().enumerate().for_each(|(row, hash)| finder.push_hash(row as f64 * 1e-3, *hash));
        finder.end();
        let rows = |t: f64| (t * 1e3).round() as u64;
        finder.stretches().into_iter().map(|[from, to]| [rows(from), rows(to)]).collect()
    }

    fn random(seed: u64, count: usize) -> Vec<u64> {
        let mut random = StdRng::seed_from_u64(seed);
        (0..count).map(|_| random.random()).collect()
    }

    /// `explain` of a log of 10⁵ rows that was one of 5850 over and over tried sixty effects, since the noise
    /// of one copy was foretold by the next.
    #[test]
    fn copies_are_found_whole_and_nothing_else() {
        let (once, other) = (random(1, 2000), random(2, 900));
        assert!(found(&once).is_empty());
        assert_eq!(found(&[once.clone(), once.clone(), once.clone()].concat()), [[2000, 5999]]);
        assert_eq!(found(&[once.clone(), other.clone(), once.clone()].concat()), [[2900, 4899]]);
        let part = &once[300..1100];
        assert_eq!(found(&[once.as_slice(), &other, part].concat()), [[2900, 3699]]);
        // Too short to be sure that it is a copy.
        assert!(found(&[once.as_slice(), &other, &once[..300]].concat()).is_empty());
    }

    /// A robot that stands still gives the same rows whenever it does.
    #[test]
    fn rests_are_no_copies() {
        let (a, b) = (random(3, 1000), random(4, 1000));
        let rest = vec![7; 3000];
        assert!(found(&[a.as_slice(), &rest, &b, &rest].concat()).is_empty());
    }

    /// Long logs are remembered by a share of their windows, which finds their copies as well.
    #[test]
    fn copies_of_long_logs_are_found_with_bounded_memory() {
        let once = random(5, 4 * MOST);
        let copies = found(&[once.clone(), once.clone()].concat());
        let rows: u64 = copies.iter().map(|[from, to]| to - from + 1).sum();
        assert!(rows as f64 > 0.999 * once.len() as f64, "{rows}");
        assert!(copies.iter().all(|[from, _]| *from >= once.len() as u64));
    }
}
