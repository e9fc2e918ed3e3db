//! Why samples are missing.

use serde::{Deserialize, Serialize};
use std::fmt;

/// Why a log is interrupted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum GapReason {
    /// A cell that is needed is empty.
    EmptyCell,
    /// A NaN or an infinity.
    NotFinite,
    /// A magnitude above 1e100: memory that nobody wrote to, not a measurement.
    Huge,
    /// A position, velocity or torque that leaves where the signal is and comes back within a few samples.
    Spike,
    /// No torque changes for a while though the robot moves: the drives had stopped logging.
    StillTorques,
    /// Positions and torques are those of earlier rows, to the last digit: a copy, which says nothing new.
    Repeated,
    /// The row before, once more to the last digit: the log is faster than what it logs. No segment is split.
    Held,
    /// All torques or all positions are exactly 0 between rows in which they are far from it: a message was
    /// missed. The row is bridged; no segment is split.
    ZeroRow,
    /// The time stamp of the row before, once more.
    DuplicateStamp,
    /// The last row is cut short, or may be since its line feed is missing.
    TruncatedLastRow,
    /// A stretch that the map of the log leaves out.
    LeftOut,
    /// Something else acted on the robot: a push, a collision.
    Disturbed,
    /// Time jumps: samples are missing, though no row is.
    TimeJump,
}

impl GapReason {
    pub(crate) const ALL: [GapReason; 13] = [
        GapReason::EmptyCell,
        GapReason::NotFinite,
        GapReason::Huge,
        GapReason::Spike,
        GapReason::StillTorques,
        GapReason::Repeated,
        GapReason::Held,
        GapReason::ZeroRow,
        GapReason::DuplicateStamp,
        GapReason::TruncatedLastRow,
        GapReason::LeftOut,
        GapReason::Disturbed,
        GapReason::TimeJump,
    ];
}

impl fmt::Display for GapReason {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            GapReason::EmptyCell => "empty cell",
            GapReason::NotFinite => "NaN or infinity",
            GapReason::Huge => "value beyond 1e100",
            GapReason::Spike => "spike",
            GapReason::StillTorques => "no torque changes while the robot moves",
            GapReason::Repeated => "copy of earlier rows",
            GapReason::Held => "the row before, once more",
            GapReason::ZeroRow => "zeros of a message that was missed",
            GapReason::DuplicateStamp => "duplicate time stamp",
            GapReason::TruncatedLastRow => "truncated last row",
            GapReason::LeftOut => "left out by the map",
            GapReason::Disturbed => "something else acted on the robot",
            GapReason::TimeJump => "jump in time",
        })
    }
}
