//! Rows in which the drives had stopped logging: no torque changes though the robot moves. They are left out.

use crate::check_settings::CheckSettings;
use crate::columns::Layout;
use crate::signal_shape::{LONG, MOVED};

/// Stretches that are remembered; a log with more is one of torques in steps.
const MOST: usize = 4096;

/// Finds stretches in which all torques keep their values while a joint moves.
pub(crate) struct StillFinder {
    torques: Vec<f64>,
    from: f64,
    last: f64,
    rows: u64,
    /// Positions at the beginning, and the largest way from there.
    start: Vec<f64>,
    way: Vec<f64>,
    /// Lowest and highest position so far.
    ranges: Vec<[f64; 2]>,
    runs: u64,
    all_rows: u64,
    /// First and last stamp, rows.
    found: Vec<(f64, f64, u64)>,
}

impl StillFinder {
    pub fn new(layout: &Layout) -> Self {
        StillFinder {
            torques: Vec::new(),
            from: 0.0,
            last: 0.0,
            rows: 0,
            start: vec![0.0; layout.joints],
            way: vec![0.0; layout.joints],
            ranges: vec![[f64::INFINITY, f64::NEG_INFINITY]; layout.joints],
            runs: 0,
            all_rows: 0,
            found: Vec::new(),
        }
    }

    /// The next sample of a segment.
    pub fn push(&mut self, t: f64, q: &[f64], torques: &[f64]) {
        self.all_rows += 1;
        if self.rows == 0 || self.torques != torques {
            self.end();
            self.torques.clear();
            self.torques.extend_from_slice(torques);
            self.start.copy_from_slice(q);
            self.way.fill(0.0);
            (self.from, self.rows) = (t, 0);
        }
        self.last = t;
        self.rows += 1;
        for (joint, &q) in q.iter().enumerate() {
            self.way[joint] = self.way[joint].max((q - self.start[joint]).abs());
            let [low, high] = self.ranges[joint];
            self.ranges[joint] = [low.min(q), high.max(q)];
        }
    }

    /// The run or the segment is over.
    pub fn end(&mut self) {
        if self.rows == 0 {
            return;
        }
        self.runs += 1;
        let moved = self.way.iter().zip(&self.ranges).any(|(way, [low, high])| *way > MOVED * (high - low));
        if self.last - self.from >= LONG && moved && self.found.len() < MOST {
            self.found.push((self.from, self.last, self.rows));
        }
        self.rows = 0;
    }

    /// First and last stamp of each stretch, ascending; none where most of the log is such, since then there
    /// is more wrong than a pause.
    pub fn stretches(&self, settings: &CheckSettings) -> Vec<[f64; 2]> {
        let mean = self.all_rows as f64 / self.runs.max(1) as f64;
        let long = self.found.iter().filter(|(_, _, rows)| *rows as f64 > settings.still_runs * mean);
        let (mut stretches, mut rows) = (Vec::new(), 0);
        for (from, to, count) in long {
            stretches.push([*from, *to]);
            rows += count;
        }
        if 2 * rows > self.all_rows { Vec::new() } else { stretches }
    }
}
