//! What the survey has found to mend in the rows of a log, and the rows so mended, for all passes that
//! follow.

use crate::gap::GapReason;
use crate::held_positions::BetweenReadings;
use crate::reader::Rows;
use crate::spike::WithoutSpikes;
use crate::turns::WithoutTurns;
use crate::without_held::WithoutHeld;
use crate::without_stretches::WithoutStretches;
use crate::zero_rows::{WithoutZeroRows, ZeroRows};
use serde::{Deserialize, Serialize};

/// Rows that are read once though they were written several times, zeros that are bridged, turns that are
/// undone, and positions between their readings.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Mending {
    /// Rows for which each is held; 1 where each is a new one.
    pub held: usize,
    /// From where on zeros are none of the signal, by place in a row; empty where there are no such rows.
    #[serde(with = "crate::any_number::list")]
    pub zero_bounds: Vec<f64>,
    /// Longest distance of stamps across which zeros are bridged, for each row of zeros and one more \[s\].
    #[serde(with = "crate::any_number")]
    pub longest_step: f64,
    /// Rows that were bridged.
    pub zero_rows: ZeroRows,
    /// How often each joint's position jumped by a turn; empty where nobody counted.
    #[serde(default)]
    pub turns: Vec<u64>,
    /// Rows for which each joint's position is held, on the mean, and 1 where it is read anew in every row;
    /// empty where that is so of all.
    #[serde(default)]
    pub held_positions: Vec<f64>,
}

impl Default for Mending {
    fn default() -> Self {
        Mending {
            held: 1,
            zero_bounds: Vec::new(),
            longest_step: 0.0,
            zero_rows: ZeroRows::default(),
            turns: Vec::new(),
            held_positions: Vec::new(),
        }
    }
}

/// Rows of which a [`Mending`] is made.
pub(crate) type Mended<R> = BetweenReadings<WithoutTurns<WithoutZeroRows<WithoutHeld<R>>>>;

impl Mending {
    pub fn is_none(&self) -> bool {
        self.held == 1
            && self.zero_bounds.is_empty()
            && self.held_positions.is_empty()
            && self.turns.iter().all(|turns| *turns == 0)
    }

    pub fn of<R: Rows>(&self, rows: R) -> Mended<R> {
        let once = WithoutHeld::new(rows, self.held);
        let bridged = WithoutZeroRows::new(once, self.zero_bounds.clone(), self.longest_step);
        BetweenReadings::new(WithoutTurns::new(bridged), &self.held_positions)
    }
}

/// Rows without spikes, and without stretches in which torques stand still or that repeat earlier ones.
pub(crate) fn without<R: Rows>(
    rows: R,
    spike_bounds: &[f64],
    still: &[[f64; 2]],
    repeated: &[[f64; 2]],
) -> WithoutStretches<WithoutStretches<WithoutSpikes<R>>> {
    let bounds = match spike_bounds {
        [] => vec![f64::INFINITY; rows.layout().width],
        bounds => bounds.to_vec(),
    };
    let without = WithoutSpikes::new(rows, bounds);
    let without = WithoutStretches::new(without, GapReason::StillTorques, still.to_vec());
    WithoutStretches::new(without, GapReason::Repeated, repeated.to_vec())
}
