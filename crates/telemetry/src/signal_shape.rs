//! Artefacts of a sensor or a logger in a signal: quantisation steps, flat tops, dead bands, constant
//! stretches.

use crate::histogram::Histogram;
use crate::hold::{RunCounter, is_jump};
use serde::{Deserialize, Serialize};

/// Stretches of one value from this length on are counted \[s\].
pub(crate) const LONG: f64 = 0.5;
/// Share of a joint's travel that it must move on meanwhile.
pub(crate) const MOVED: f64 = 0.05;
/// Level below which a signal counts as near 0, as a share of its largest magnitude so far.
const NEAR_ZERO: f64 = 0.05;
/// Where the band below the top begins, as a share of the top.
const NEAR_TOP: f64 = 0.94;
/// Share of differences that must be as small as the smallest for a signal to be in steps.
const SMALLEST_SHARE: f64 = 0.05;
/// How much larger than the smallest those may be.
const SMALLEST_TOLERANCE: f64 = 1.1;

/// The shape of a signal, over all usable rows.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct SignalShape {
    /// The step in which the signal comes; 0 if it comes in none that shows.
    #[serde(with = "crate::any_number")]
    pub step: f64,
    /// Share of rows in which it is exactly 0.
    #[serde(with = "crate::any_number")]
    pub zero_share: f64,
    /// Smallest magnitude besides 0; 0 where there is none.
    #[serde(with = "crate::any_number")]
    pub smallest: f64,
    /// How often it came near 0 and went away again.
    pub touches: u64,
    /// Rows at exactly the largest and the smallest value.
    pub at_ends: [u64; 2],
    /// Rows within 6 % of those, themselves included.
    pub near_ends: [u64; 2],
    /// Mean number of rows for which it keeps a value.
    #[serde(with = "crate::any_number")]
    pub mean_run: f64,
    /// The longest stretch of one value during which the joint moved on, if there is one.
    pub still: Option<Still>,
    /// Rows in all such stretches.
    pub still_rows: u64,
    /// Mean number of rows for which each value is held between jumps, where the log is faster than what it
    /// logs there.
    #[serde(default)]
    pub held: Option<f64>,
}

/// A stretch in which a signal kept one value while the joint moved.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Still {
    /// The value.
    #[serde(with = "crate::any_number")]
    pub value: f64,
    /// Its first time stamp, in seconds.
    #[serde(with = "crate::any_number")]
    pub from: f64,
    /// How long it lasts, in seconds.
    #[serde(with = "crate::any_number")]
    pub duration: f64,
    /// Its rows.
    pub rows: u64,
}

/// Collects a [`SignalShape`] in constant memory.
pub(crate) struct ShapeCollector {
    rows: u64,
    zeros: u64,
    smallest: f64,
    /// Magnitudes of differences that are not 0, and the smallest of them.
    differences: Histogram,
    least_difference: f64,
    /// Magnitudes of positive and of negative values.
    sides: [Histogram; 2],
    /// Largest and smallest value, and the rows at them.
    ends: [(f64, u64); 2],
    runs: u64,
    between_jumps: RunCounter,
    run: Option<Run>,
    still: Option<Still>,
    still_rows: u64,
    near_zero: bool,
    touches: u64,
    range: [f64; 2],
}

struct Run {
    value: f64,
    from: f64,
    last: f64,
    rows: u64,
    range: [f64; 2],
}

impl ShapeCollector {
    pub fn new() -> Self {
        ShapeCollector {
            rows: 0,
            zeros: 0,
            smallest: f64::INFINITY,
            differences: Histogram::new(),
            least_difference: f64::INFINITY,
            sides: [Histogram::new(), Histogram::new()],
            ends: [(f64::NEG_INFINITY, 0), (f64::INFINITY, 0)],
            runs: 0,
            between_jumps: RunCounter::new(),
            run: None,
            still: None,
            still_rows: 0,
            near_zero: false,
            touches: 0,
            range: [f64::INFINITY, f64::NEG_INFINITY],
        }
    }

    /// The next sample of a segment: its stamp, the joint's position, the signal.
    pub fn push(&mut self, t: f64, q: f64, x: f64) {
        self.rows += 1;
        self.range = [self.range[0].min(q), self.range[1].max(q)];
        if x == 0.0 {
            self.zeros += 1;
        } else {
            self.smallest = self.smallest.min(x.abs());
            self.sides[usize::from(x < 0.0)].push(x);
        }
        for (end, beyond) in
            self.ends.iter_mut().zip([|x: f64, end: f64| x > end, |x: f64, end: f64| x < end])
        {
            if beyond(x, end.0) {
                *end = (x, 1);
            } else if x == end.0 {
                end.1 += 1;
            }
        }
        let largest = self.ends[0].0.max(-self.ends[1].0);
        let near = x.abs() < NEAR_ZERO * largest;
        // Hysteresis: the signal leaves the level at twice the distance, so that noise is not counted as many
        // touches.
        if near && !self.near_zero {
            self.near_zero = true;
        } else if self.near_zero && x.abs() > 2.0 * NEAR_ZERO * largest {
            self.near_zero = false;
            self.touches += 1;
        }
        match &mut self.run {
            Some(run) if run.value == x => {
                run.last = t;
                run.rows += 1;
                self.between_jumps.repeat();
                run.range = [run.range[0].min(q), run.range[1].max(q)];
            }
            _ => {
                if let Some(run) = &self.run {
                    let difference = (x - run.value).abs();
                    self.differences.push(difference);
                    self.between_jumps.change(is_jump(difference, &mut self.least_difference));
                }
                self.end_run();
                self.run = Some(Run { value: x, from: t, last: t, rows: 1, range: [q, q] });
            }
        }
    }

    fn end_run(&mut self) {
        let Some(run) = self.run.take() else { return };
        self.runs += 1;
        let (duration, moved) = (run.last - run.from, run.range[1] - run.range[0]);
        if duration >= LONG && moved > MOVED * (self.range[1] - self.range[0]) {
            self.still_rows += run.rows;
            if self.still.is_none_or(|still| duration > still.duration) {
                self.still = Some(Still { value: run.value, from: run.from, duration, rows: run.rows });
            }
        }
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.end_run();
        self.between_jumps.end_segment();
        self.near_zero = false;
    }

    pub fn finish(&self) -> SignalShape {
        let least = self.least_difference;
        let in_steps = self.differences.quantile(SMALLEST_SHARE) <= SMALLEST_TOLERANCE * least;
        let rows = self.rows.max(1) as f64;
        let near = |side: usize| {
            let end = self.ends[side].0;
            // An end on the other side of 0 has no band of its own.
            if end == 0.0 || (end < 0.0) != (side == 1) {
                0
            } else {
                self.sides[side].from(NEAR_TOP * end.abs())
            }
        };
        SignalShape {
            step: if in_steps && least.is_finite() { least } else { 0.0 },
            zero_share: self.zeros as f64 / rows,
            smallest: if self.smallest.is_finite() { self.smallest } else { 0.0 },
            touches: self.touches,
            at_ends: [self.ends[0].1, self.ends[1].1],
            near_ends: [near(0), near(1)],
            mean_run: rows / self.runs.max(1) as f64,
            still: self.still,
            still_rows: self.still_rows,
            held: self.held(),
        }
    }

    /// [`SignalShape::held`] of what came so far.
    pub fn held(&self) -> Option<f64> {
        self.between_jumps.hold().map(|hold| hold.mean)
    }
}
