//! The situations of the widened suites: what a logger, a drive or a motion does that a log made for an
//! experiment does not.

use serde::Serialize;

/// What is particular about a case's noise, drive or motion. Scores are kept apart for each.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum Situation {
    /// White noise.
    White,
    /// Noise with a correlation time of 5 to 50 ms.
    ShortColour,
    /// Of 50 to 300 ms.
    Colour,
    /// Of 0.3 to 1 s.
    LongColour,
    /// Noise with outliers: Student's t with three degrees of freedom, or one sample in fifty eight times as
    /// large.
    HeavyTails,
    /// Joints whose torque is mostly noise.
    NoiseJoints,
    /// The drive low-passes the torque that it logs, noise and all, at 4 to 20 Hz, and makes up for the
    /// filter's delay.
    DriveFilter,
    /// The same with a causal filter: the logged torque is late, so a delay is no false name.
    LateFilter,
    /// A velocity column that lags the position by 20 to 200 ms, in some cases in another unit.
    LateVelocity,
    /// The logger writes 0 for torques, or for velocities, below a threshold.
    DeadBand,
    /// Trained on slow motion, validated on motion three to five times as fast.
    SlowToFast,
    /// Short periods over and over: few frequencies.
    Periodic,
    /// From pose to pose with long rests, in half of the cases one joint at a time.
    Rests,
    /// Torque in coarse steps, coarse encoders.
    Quantised,
    /// Colour, tails, steps, a late velocity and rests together.
    Mixed,
}

impl Situation {
    /// All situations.
    pub const ALL: [Situation; 15] = [
        Situation::White,
        Situation::ShortColour,
        Situation::Colour,
        Situation::LongColour,
        Situation::HeavyTails,
        Situation::NoiseJoints,
        Situation::DriveFilter,
        Situation::LateFilter,
        Situation::LateVelocity,
        Situation::DeadBand,
        Situation::SlowToFast,
        Situation::Periodic,
        Situation::Rests,
        Situation::Quantised,
        Situation::Mixed,
    ];

    /// The name in tables.
    pub fn name(self) -> String {
        clap::ValueEnum::to_possible_value(&self)
            .map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Whether the joints rest for long.
    pub fn rests(self) -> bool {
        matches!(self, Situation::Rests | Situation::Mixed)
    }
}
