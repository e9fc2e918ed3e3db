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
/// What the decimals of a log may do to a difference of two positions, as a share of it.
const SAME_DIFFERENCE: f64 = 1e-3;

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
    /// Number of stretches of time whose means were compared.
    #[serde(with = "crate::any_number", default)]
    pub stretches: f64,
    /// Share of the rows in which the position changes whose velocity is its difference to the row before.
    #[serde(with = "crate::any_number", default)]
    pub differenced: f64,
}

impl Alignment {
    /// The lag over its standard error, if what is unexplained at the lag is white.
    pub fn lag_significance(&self) -> f64 {
        let cost = (self.unexplained - self.unexplained_at_lag).max(0.0);
        (cost * self.stretches / self.unexplained_at_lag).sqrt()
    }
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
    short: ShortLag,
    /// Rows in which the position changes, and those of them whose velocity is the difference.
    differences: [f64; 2],
}

/// Least squares of a velocity by the positions' derivative and its change from stretch to stretch: a lag
/// shorter than a stretch takes the lag's share of that change off.
#[derive(Default)]
struct ShortLag {
    /// Σ v², Σ v·Δv, Σ Δv².
    square: [f64; 3],
    /// Σ qd·v, Σ qd·Δv.
    product: [f64; 2],
}

impl ShortLag {
    /// A stretch's mean of `qd`, and those of the positions' derivative before, in and after it.
    fn push(&mut self, qd: f64, [before, v, after]: [f64; 3]) {
        let change = 0.5 * (after - before);
        for (sum, term) in self.square.iter_mut().zip([v * v, v * change, change * change]) {
            *sum += term;
        }
        self.product[0] += qd * v;
        self.product[1] += qd * change;
    }

    /// The lag in stretches, and what both explain of Σ qd². `None` where the velocity never changes.
    fn finish(&self) -> Option<(f64, f64)> {
        let ([vv, va, aa], [qv, qa]) = (self.square, self.product);
        let determinant = vv * aa - va * va;
        let (slope, change) = ((qv * aa - qa * va) / determinant, (qa * vv - qv * va) / determinant);
        let lag = -change / slope;
        lag.is_finite().then_some((lag, slope * qv + change * qa))
    }
}

struct Stretch {
    first: [f64; 2],
    /// Time, position and velocity of the latest row.
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
            short: ShortLag::default(),
            differences: [0.0; 2],
        }
    }

    /// The next sample of a segment.
    pub fn push(&mut self, t: f64, q: f64, qd: f64) {
        let Some(open) = &mut self.open else {
            self.open =
                Some(Stretch { first: [t, q], last: [t, q, qd], area: 0.0, rows: 0, zero: qd == 0.0 });
            return;
        };
        let step = q - open.last[1];
        if step != 0.0 {
            self.differences[0] += 1.0;
            let off = (qd * (t - open.last[0]) - step).abs();
            self.differences[1] += f64::from(off < SAME_DIFFERENCE * step.abs());
        }
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
        self.short.push(qd, [self.lags - 1, self.lags, self.lags + 1].map(|place| self.recent[place][1]));
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
        let mut lag = best as f64 + shift - self.lags as f64;
        let mut unexplained_at_lag = 1.0 - explained(best);
        if best == self.lags
            && let Some((short, explained)) = self.short.finish()
        {
            (lag, unexplained_at_lag) = (short, (1.0 - explained / self.square).max(0.0));
        }
        Some(Alignment {
            lag: lag * self.resolution,
            scale: self.sums[best][0] / self.square,
            unexplained: 1.0 - explained(self.lags),
            unexplained_at_lag,
            zero_share: self.zero[0] / self.all[0],
            motion_at_zero: (self.zero[1] / self.zero[0].max(1.0) / (self.all[1] / self.all[0])).sqrt(),
            resolution: self.resolution,
            stretches: self.count,
            differenced: self.differences[1] / self.differences[0].max(1.0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check_settings::CheckSettings;

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

    /// Velocities that were differences to the row before, 5 ms late at 100 Hz, were used, and a delay of
    /// -5.3 ms was named in torques that were not late.
    #[test]
    fn a_difference_to_the_row_before_is_late_by_half_a_row() {
        for (rate, step) in [(100.0, 0.0), (250.0, 0.0), (500.0, 0.0), (100.0, 7.7e-4), (500.0, 7.7e-4)] {
            let mut collector = AlignmentCollector::new(1.0 / rate);
            let position = |k: i32| {
                let t = f64::from(k) / rate;
                let q = (3.0 * t).sin() + 0.3 * (11.0 * t).sin();
                if step > 0.0 { (q / step).round() * step } else { q }
            };
            for k in 1..(20.0 * rate) as i32 {
                let qd = (position(k) - position(k - 1)) * rate;
                // As a log has them.
                let decimals = |x: f64| (x * 1e7).round() * 1e-7;
                collector.push(f64::from(k) / rate, position(k), decimals(qd));
            }
            let found = collector.finish().expect("enough to tell by");
            assert!(found.differenced > 0.95, "{rate} Hz, {step}: {found:?}");
            assert!((found.lag * rate - 0.5).abs() < 0.1, "{rate} Hz, {step}: {found:?}");
            assert!(CheckSettings::default().contradicts(&found), "{rate} Hz, {step}: {found:?}");
        }
        // A velocity that is measured by itself is not.
        for (lag, used) in [(0.0, true), (0.0005, true), (0.002, false), (-0.003, false)] {
            let found = alignment(lag, 1.0, 0.0, 1000.0);
            assert!((found.lag - lag).abs() < 2e-4, "{lag}: {found:?}");
            assert_eq!(CheckSettings::default().contradicts(&found), !used, "{lag}: {found:?}");
        }
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
