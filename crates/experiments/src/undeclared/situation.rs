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
    /// 20 to 125 samples a second.
    LowRate,
    /// Logs of 4 to 8 s.
    ShortLogs,
    /// Strokes of constant speed between short ramps, as industrial controllers make them.
    Strokes,
    /// The torque is renewed less often than the position, and held in between: on average it is late by half
    /// of that, so a delay is no false name.
    HeldTorque,
    /// Stamps rounded to milliseconds or more, rows lost one by one and in bursts.
    RoughClock,
    /// Some joints stay where they are, in all logs.
    StillJoints,
    /// Positions of a potentiometer: noise of 0.03 to 0.3 degrees.
    NoisyPositions,
    /// Whoever published the log smoothed the torque, without delay: by means over neighbouring samples, or
    /// by a Butterworth filter that runs forwards and backwards.
    SmoothedTorque,
    /// The zeros of some torques are others in each log: sensors that are zeroed anew, or drift overnight.
    /// What they have in common is an offset, so that is no false name.
    ShiftingZeros,
    /// Joints move one after the other, each two to four times in a log, while all others rest.
    InTurn,
    /// Positions of some joints, or of all, are read less often than the torques, and held in between.
    HeldPositions,
    /// Somebody pushes the robot once or a few times while the training logs are taken.
    Pushes,
    /// Dry friction of all joints turns over 0.1 to 1 mrad or mm after a reversal, on each over its own.
    SoftBristles,
    /// Dry friction of all joints is held by a soft constraint, as in MuJoCo: it leads the velocity by 3 to
    /// 20 ms, and turns in a straight line over a speed of its own for each joint.
    SoftConstraint,
    /// A velocity column that the logger makes of the positions it reads: their difference to the row before,
    /// low-passed at 20 to 80 Hz in half of the cases, of coarse encoders in half of them.
    DifferencedVelocity,
    /// Joints stick where they reverse: for a tenth of a second or more they creep by less than their coarse
    /// encoders show, while the dry friction goes from one end to the other.
    Sticking,
    /// All joints go forth and back together, each with little of its own motion: much of what one torque has
    /// could be of another joint's.
    MovingAlike,
}

impl Situation {
    /// All situations.
    pub const ALL: [Situation; 32] = [
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
        Situation::LowRate,
        Situation::ShortLogs,
        Situation::Strokes,
        Situation::HeldTorque,
        Situation::RoughClock,
        Situation::StillJoints,
        Situation::NoisyPositions,
        Situation::SmoothedTorque,
        Situation::ShiftingZeros,
        Situation::InTurn,
        Situation::HeldPositions,
        Situation::Pushes,
        Situation::SoftBristles,
        Situation::SoftConstraint,
        Situation::DifferencedVelocity,
        Situation::Sticking,
        Situation::MovingAlike,
    ];
    /// Those of the first cases of each suite: so many there were when these were drawn first.
    pub const FIRST: usize = Situation::BLOCKS[0].1;
    /// Situations that came together: the index of their first case, and how many they are.
    const BLOCKS: [(usize, usize); 11] = [
        (0, 15),
        (50_000, 7),
        (60_000, 1),
        (70_000, 1),
        (80_000, 1),
        (90_000, 2),
        (95_000, 1),
        (97_000, 1),
        (98_000, 1),
        (99_000, 1),
        (99_500, 1),
    ];

    /// The situation of the case of this index: those of its block in turn.
    pub fn of_index(index: usize) -> Self {
        let mut situations = Self::ALL.as_slice();
        let mut own = Self::ALL[0];
        for (first, count) in Self::BLOCKS {
            let (block, later) = situations.split_at(count);
            match index.checked_sub(first) {
                Some(index) => own = block[index % count],
                None => break,
            }
            situations = later;
        }
        own
    }

    /// Indices of the cases in situations that came later, so many of each.
    pub fn later_indices(each: usize) -> impl Iterator<Item = usize> {
        Self::BLOCKS.into_iter().skip(1).flat_map(move |(first, count)| first..first + each * count)
    }

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
