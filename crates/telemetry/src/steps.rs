//! How far apart the stamps of a log are, and from where on time has jumped.

use crate::LogError;
use crate::reader::{Row, Rows};

/// How far apart the stamps are.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Steps {
    /// Median \[s\].
    pub median: f64,
    /// The 99th percentile.
    pub high: f64,
}

/// Steps at the head of a log whose median is exact.
const HEAD: usize = 1 << 16;

impl Steps {
    pub fn of_head(rows: &mut dyn Rows) -> Result<Self, LogError> {
        let mut values = vec![0.0; rows.layout().width];
        let mut steps = Vec::new();
        let mut previous = None;
        while steps.len() < HEAD {
            match rows.next(&mut values)? {
                Row::Sample { .. } => {
                    // Time that stands still or runs backwards is reported by `split`.
                    steps.extend(previous.map(|previous| values[0] - previous).filter(|step| *step > 0.0));
                    previous = Some(values[0]);
                }
                Row::Gap { .. } => previous = None,
                Row::End => break,
            }
        }
        steps.sort_by(f64::total_cmp);
        let quantile = |p: f64| steps.get((p * steps.len() as f64) as usize).copied().unwrap_or(1.0);
        Ok(Steps { median: quantile(0.5), high: quantile(0.99) })
    }

    /// A lost sample doubles the step, jitter widens it: a split comes above 1.5 medians where stamps are
    /// even, above 2.5 where they are not.
    pub fn longest(self) -> f64 {
        (1.25 * self.high).clamp(1.5 * self.median, 2.5 * self.median)
    }

    pub fn holds_for(self, all: Steps) -> bool {
        (all.median / self.median - 1.0).abs() < 0.2
    }
}
