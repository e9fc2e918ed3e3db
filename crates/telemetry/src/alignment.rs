//! A measured velocity compared with the positions: its delay, its unit, and its dead band.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Length of a stretch over which both are averaged \[s\]; one sample where samples are further apart.
const STRETCH: f64 = 0.01;
/// Largest lag that is looked for, either way \[s\].
const LARGEST_LAG: f64 = 0.3;
/// Most stretches of lag, either way.
const MOST_LAGS: usize = 40;
/// Stretches from which on there is something to tell.
const FEWEST: f64 = 100.0;

/// How a velocity column relates to the positions' differences.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Alignment {
    /// How much later the column is than the positions, in seconds.
    #[serde(with = "crate::any_number")]
    pub lag: f64,
    /// What the column must be multiplied by, at this lag, to be the positions' derivative.
    #[serde(with = "crate::any_number")]
    pub scale: f64,
    /// Share of its power that the positions' derivative does not explain.
    #[serde(with = "crate::any_number")]
    pub unexplained: f64,
    /// The same at this lag.
    #[serde(with = "crate::any_number")]
    pub unexplained_at_lag: f64,
    /// Share of stretches in which the column is exactly 0 throughout.
    #[serde(with = "crate::any_number")]
    pub zero_share: f64,
    /// Root mean square of the positions' derivative in those, over that of all.
    #[serde(with = "crate::any_number")]
    pub motion_at_zero: f64,
    /// Distance of the lags that were tried, in seconds.
    #[serde(with = "crate::any_number")]
    pub resolution: f64,
}

/// Collects an [`Alignment`] in constant memory.
pub(crate) struct AlignmentCollector {
    rows_in_stretch: usize,
    resolution: f64,
    lags: usize,
    /// The stretch that is under way: its first sample, the latest, ∫qd dt, samples, whether qd is 0
    /// throughout.
    open: Option<Stretch>,
    /// Means of the latest stretches: `[qd, dq/dt]`, oldest first.
    recent: VecDeque<[f64; 2]>,
    /// For each lag from the most negative on: Σ qd·v, Σ v².
    sums: Vec<[f64; 2]>,
    square: f64,
    count: f64,
    all: [f64; 2],
    zero: [f64; 2],
}

struct Stretch {
    first: [f64; 2],
    last: [f64; 3],
    area: f64,
    rows: usize,
    zero: bool,
}

impl AlignmentCollector {
    /// For samples about `period` apart \[s\].
    pub fn new(period: f64) -> Self {
        let rows = (STRETCH / period).round().clamp(1.0, 1e6);
        let resolution = rows * period;
        let lags = ((LARGEST_LAG / resolution) as usize).clamp(1, MOST_LAGS);
        AlignmentCollector {
            rows_in_stretch: rows as usize,
            resolution,
            lags,
            open: None,
            recent: VecDeque::with_capacity(2 * lags + 1),
            sums: vec![[0.0; 2]; 2 * lags + 1],
            square: 0.0,
            count: 0.0,
            all: [0.0; 2],
            zero: [0.0; 2],
        }
    }

    /// The next sample of a segment.
    pub fn push(&mut self, t: f64, q: f64, qd: f64) {
        let Some(open) = &mut self.open else {
            self.open =
                Some(Stretch { first: [t, q], last: [t, q, qd], area: 0.0, rows: 0, zero: qd == 0.0 });
            return;
        };
        open.area += 0.5 * (open.last[2] + qd) * (t - open.last[0]);
        open.last = [t, q, qd];
        open.rows += 1;
        open.zero &= qd == 0.0;
        if open.rows < self.rows_in_stretch {
            return;
        }
        let time = t - open.first[0];
        let means = [open.area / time, (q - open.first[1]) / time];
        let zero = open.zero;
        self.open = Some(Stretch { first: [t, q], last: [t, q, qd], area: 0.0, rows: 0, zero: qd == 0.0 });
        if means.iter().all(|mean| mean.is_finite()) {
            self.stretch(means, zero);
        }
    }

    fn stretch(&mut self, means: [f64; 2], zero: bool) {
        let motion = [1.0, means[1] * means[1]];
        for (part, motion) in motion.into_iter().enumerate() {
            self.all[part] += motion;
            self.zero[part] += if zero { motion } else { 0.0 };
        }
        if self.recent.len() == self.sums.len() {
            self.recent.pop_front();
        }
        self.recent.push_back(means);
        if self.recent.len() < self.sums.len() {
            return;
        }
        let qd = self.recent[self.lags][0];
        self.square += qd * qd;
        self.count += 1.0;
        // A delayed column shows an earlier derivative of the positions.
        for (sums, [_, v]) in self.sums.iter_mut().rev().zip(&self.recent) {
            sums[0] += qd * v;
            sums[1] += v * v;
        }
    }

    /// The segment is over.
    pub fn end_segment(&mut self) {
        self.open = None;
        self.recent.clear();
    }

    /// `None` where there is too little to tell by, or nothing moves.
    pub fn finish(&self) -> Option<Alignment> {
        let explained = |index: usize| {
            let [product, square] = self.sums[index];
            product * product / (square * self.square)
        };
        let best =
            (0..self.sums.len()).max_by(|a, b| explained(*a).total_cmp(&explained(*b))).unwrap_or(self.lags);
        if self.count < FEWEST || !explained(best).is_finite() {
            return None;
        }
        // The best lag is interpolated by the parabola through the best tried lag and its neighbours.
        let shift = match best {
            0 => 0.0,
            best if best + 1 == self.sums.len() => 0.0,
            best => {
                let [before, at, after] = [best - 1, best, best + 1].map(explained);
                let bend = before - 2.0 * at + after;
                if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 }
            }
        };
        Some(Alignment {
            lag: (best as f64 + shift - self.lags as f64) * self.resolution,
            scale: self.sums[best][0] / self.square,
            unexplained: 1.0 - explained(self.lags),
            unexplained_at_lag: 1.0 - explained(best),
            zero_share: self.zero[0] / self.all[0],
            motion_at_zero: (self.zero[1] / self.zero[0].max(1.0) / (self.all[1] / self.all[0])).sqrt(),
            resolution: self.resolution,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A column of `q(t) = sin 3t + 0.3 sin 11t` that is `lag` late, times `unit`, and 0 where it is below
    /// `dead_band`.
    fn alignment(lag: f64, unit: f64, dead_band: f64, rate: f64) -> Alignment {
        let mut collector = AlignmentCollector::new(1.0 / rate);
        for k in 0..(20.0 * rate) as usize {
            let t = k as f64 / rate;
            let q = (3.0 * t).sin() + 0.3 * (11.0 * t).sin();
            let late = t - lag;
            let qd = 3.0 * (3.0 * late).cos() + 3.3 * (11.0 * late).cos();
            collector.push(t, q, if qd.abs() < dead_band { 0.0 } else { unit * qd });
        }
        collector.finish().expect("enough to tell by")
    }

    #[test]
    fn lags_units_and_dead_bands_are_measured() {
        for (lag, unit, rate) in [
            (0.0, 1.0, 500.0),
            (0.15, 1.0, 1000.0),
            (-0.05, 1.0, 250.0),
            (0.02, -1.0, 400.0),
            (0.1, 9.55, 50.0),
        ] {
            let found = alignment(lag, unit, 0.0, rate);
            assert!((found.lag - lag).abs() < 0.1 * found.resolution + 0.05 * lag.abs(), "{lag}: {found:?}");
            assert!((found.scale * unit - 1.0).abs() < 0.02, "{unit}: {found:?}");
            assert!(found.unexplained_at_lag < 0.02 && found.zero_share == 0.0, "{found:?}");
            assert_eq!(found.unexplained < 1e-3, lag == 0.0, "{found:?}");
        }
        let found = alignment(0.0, 1.0, 1.5, 500.0);
        assert!(found.zero_share > 0.1 && found.motion_at_zero > 0.2, "{found:?}");
    }

    #[test]
    fn little_and_nothing_tell_nothing() {
        let mut collector = AlignmentCollector::new(0.002);
        assert_eq!(collector.finish(), None);
        for k in 0..5000 {
            collector.push(0.002 * f64::from(k), 1.0, 0.0);
        }
        assert_eq!(collector.finish(), None);
    }
}
