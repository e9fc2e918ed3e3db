//! What should be known of a log before anything is fitted to it: what sensors, drives and loggers did to it,
//! what follows, and how to mend it.

pub use crate::check_settings::CheckSettings;

use crate::Survey;
use crate::alignment::Alignment;
use crate::joint_survey::{JointSurvey, TorqueSurvey};
use crate::segments::GapReason;
use crate::signal_shape::SignalShape;
use crate::zero_rows::ZeroRows;
use std::fmt;

/// What is wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum FindingKind {
    /// `qd` lags or leads the positions.
    LateVelocity,
    /// `qd` is in another unit or direction.
    VelocityScale,
    /// `qd` is 0 where there is motion.
    VelocityDeadBand,
    /// A torque is 0 while the joint moves.
    ZeroTorque,
    /// A torque keeps another value while the joint moves.
    StillTorque,
    /// A torque without its sign.
    UnsignedTorque,
    /// A torque in coarse steps.
    TorqueSteps,
    /// A torque with a flat top.
    FlatTop,
    /// A torque that is 0 below some magnitude.
    TorqueDeadBand,
    /// A position in coarse steps.
    EncoderSteps,
    /// Stamps that jitter.
    Clock,
    /// Few samples.
    Sampling,
    /// Rows that stand in the log several times.
    HeldRows,
    /// A signal that keeps each value for several rows.
    HeldSignal,
    /// A position that did so, and is interpolated.
    HeldPosition,
    /// Rows of zeros, of messages that were missed.
    ZeroRows,
    /// An angle that begins anew after a turn.
    Turns,
    /// A torque in another unit.
    TorqueUnit,
    /// A joint that does not move.
    StandsStill,
}

impl FindingKind {
    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            FindingKind::LateVelocity => "late_velocity",
            FindingKind::VelocityScale => "velocity_scale",
            FindingKind::VelocityDeadBand => "velocity_dead_band",
            FindingKind::ZeroTorque => "zero_torque",
            FindingKind::StillTorque => "still_torque",
            FindingKind::UnsignedTorque => "unsigned_torque",
            FindingKind::TorqueSteps => "torque_steps",
            FindingKind::FlatTop => "flat_top",
            FindingKind::TorqueDeadBand => "torque_dead_band",
            FindingKind::EncoderSteps => "encoder_steps",
            FindingKind::Clock => "clock",
            FindingKind::Sampling => "sampling",
            FindingKind::HeldRows => "held_rows",
            FindingKind::HeldSignal => "held_signal",
            FindingKind::HeldPosition => "held_position",
            FindingKind::ZeroRows => "zero_rows",
            FindingKind::Turns => "turns",
            FindingKind::TorqueUnit => "torque_unit",
            FindingKind::StandsStill => "stands_still",
        }
    }

    /// What follows from it.
    pub fn consequence(self) -> &'static str {
        match self {
            FindingKind::LateVelocity => "friction would look like a delay, and inertia like friction",
            FindingKind::VelocityScale => "friction and Coriolis torques would be off by this factor",
            FindingKind::VelocityDeadBand => "what friction does near a reversal would be lost",
            FindingKind::ZeroTorque | FindingKind::StillTorque => {
                "these rows say nothing of the torque, and pull all parameters towards less"
            }
            FindingKind::UnsignedTorque => "no model of forces can follow it",
            FindingKind::TorqueSteps => "effects below half a step can't be seen",
            FindingKind::FlatTop => "the torque beyond it is missing, and masses come out too small",
            FindingKind::TorqueDeadBand => {
                "small torques are missing, and friction near a reversal with them"
            }
            FindingKind::EncoderSteps => "accelerations are noisy, and rotor inertias uncertain",
            FindingKind::Clock => "velocities and accelerations carry the stamps' error",
            FindingKind::Sampling => "accelerations can't be told",
            FindingKind::HeldRows => "read as they are, they would be steps in time, and look like delays",
            FindingKind::HeldSignal => "it is late by half of that on the mean, which looks like a delay",
            FindingKind::HeldPosition => {
                "read as it is, it would be late by half of that, and its accelerations those of steps"
            }
            FindingKind::ZeroRows => "as measurements they would be jumps that no model can follow",
            FindingKind::Turns => "as it stands it would be a motion at an impossible speed",
            FindingKind::TorqueUnit => "all parameters would be off by this factor",
            FindingKind::StandsStill => "nothing of what it moves can be told",
        }
    }

    /// What to do about it.
    pub fn mend(self) -> &'static str {
        match self {
            FindingKind::LateVelocity => "no velocity of this log is used, positions are differentiated",
            FindingKind::VelocityScale | FindingKind::VelocityDeadBand => {
                "it is not used, positions are differentiated"
            }
            FindingKind::ZeroTorque | FindingKind::StillTorque => {
                "leave those rows out, or find out why the drive stopped logging"
            }
            FindingKind::UnsignedTorque => "log the signed torque or current",
            FindingKind::TorqueSteps => "log the torque with more digits, or record more motion",
            FindingKind::FlatTop => "widen the sensor's or the logger's range, or leave those rows out",
            FindingKind::TorqueDeadBand => "turn the drive's or the logger's threshold off",
            FindingKind::EncoderSteps => "log the encoder's full resolution, or move further and slower",
            FindingKind::Clock => "stamp samples when they are taken",
            FindingKind::Sampling => "log faster: 100 Hz or more",
            FindingKind::HeldRows => {
                "the repeats are left out; log a reading when it comes, with the stamp of that time"
            }
            FindingKind::HeldSignal => {
                "log all signals of a joint when they are read, or all at the rate of the slowest"
            }
            FindingKind::HeldPosition => {
                "it is interpolated between its readings; log it as often as the torque"
            }
            FindingKind::ZeroRows => {
                "they are left out, and bridged from the rows beside; find out why messages are missed"
            }
            FindingKind::Turns => "it runs on there",
            FindingKind::TorqueUnit => {
                "convert it (mA by the torque constant and the gear), or mend the URDF's limit"
            }
            FindingKind::StandsStill => "record a motion of it, or hold it (--hold)",
        }
    }
}

/// Something that should be known of a log.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What it is.
    pub kind: FindingKind,
    /// The column that it is about, such as `tau.joint_1`; `t` for the stamps.
    pub column: String,
    /// What was measured.
    pub measured: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} {}: {}; {}", self.column, self.measured, self.kind.consequence(), self.kind.mend())
    }
}

/// What should be known of a log, joint by joint.
pub fn findings(survey: &Survey, settings: &CheckSettings) -> Vec<Finding> {
    let mut all = Vec::new();
    if survey.jitter > settings.jitter {
        all.push(Finding {
            kind: FindingKind::Clock,
            column: "t".to_owned(),
            measured: format!(
                "jitters by {:.0} % of its period (taken as a {} clock)",
                100.0 * survey.jitter,
                survey.clock
            ),
        });
    }
    if survey.rate_hz() < settings.slowest_hz {
        all.push(Finding {
            kind: FindingKind::Sampling,
            column: "t".to_owned(),
            measured: format!("has {:.1} samples a second", survey.rate_hz()),
        });
    }
    all.extend(mended(survey));
    all.extend(held(survey));
    for joint in &survey.joints {
        all.extend(of_joint(joint, settings));
    }
    all
}

/// Rows that were mended.
fn mended(survey: &Survey) -> Vec<Finding> {
    let mut all = Vec::new();
    let repeats = survey.gaps.iter().find(|gap| gap.reason == GapReason::Held);
    if let (Some(rows), Some(repeats)) = (survey.held_rows(), repeats) {
        all.push(Finding {
            kind: FindingKind::HeldRows,
            column: "t".to_owned(),
            measured: format!(
                "runs on while nothing is read: {} of {} rows repeat the one before to the last digit, {rows} rows to a \
                 reading",
                repeats.count, survey.rows
            ),
        });
    }
    let ZeroRows { positions, torques } = survey.zero_rows();
    for (column, rows) in [("q", positions), ("tau", torques)] {
        if rows > 0 {
            let rows_are = if rows == 1 { "row" } else { "rows" };
            all.push(Finding {
                kind: FindingKind::ZeroRows,
                column: column.to_owned(),
                measured: format!(
                    "of all joints is exactly 0 in {rows} {rows_are} between others that are far from it"
                ),
            });
        }
    }
    for (joint, turns) in survey.joints.iter().zip(survey.turns()).filter(|(_, turns)| **turns > 0) {
        let times = if *turns == 1 { "once".to_owned() } else { format!("{turns} times") };
        all.push(Finding {
            kind: FindingKind::Turns,
            column: format!("q.{}", joint.name),
            measured: format!("jumps by a whole turn, {times}"),
        });
    }
    all
}

/// Signals that are held, though not all at once; one for all joints where they are alike.
fn held(survey: &Survey) -> Vec<Finding> {
    // What is between their readings is not held any more.
    let held = &survey.mending.held_positions;
    let position = |joint: usize| held.get(joint).copied().filter(|rows| *rows > 1.0);
    let torques = |joint: &JointSurvey| joint.torque.and_then(|torque| torque.shape.held);
    let signals: [(FindingKind, &str, Vec<Option<f64>>); 2] = [
        (FindingKind::HeldPosition, "q", (0..survey.joints.len()).map(position).collect()),
        (FindingKind::HeldSignal, "tau", survey.joints.iter().map(torques).collect()),
    ];
    let mut all = Vec::new();
    for (kind, signal, rows) in signals {
        let finding = |column: String, whose: &str, rows: f64| Finding {
            kind,
            column,
            measured: format!(
                "{whose}keeps each value for {rows:.1} rows ({:.1} ms), in which other columns change",
                1e3 * rows * survey.period
            ),
        };
        let first = rows.first().copied().flatten().filter(|_| rows.len() > 1);
        let alike = |first: &f64| rows.iter().all(|rows| rows.is_some_and(|rows| (rows - first).abs() < 0.5));
        if let Some(first) = first.filter(alike) {
            all.push(finding(signal.to_owned(), "of all joints ", first));
            continue;
        }
        let joints = survey.joints.iter().zip(&rows);
        let of_joint = |(joint, rows): (&JointSurvey, &Option<f64>)| {
            Some(finding(format!("{signal}.{}", joint.name), "", (*rows)?))
        };
        all.extend(joints.filter_map(of_joint));
    }
    all
}

/// What should be known of a joint's columns.
fn of_joint(joint: &JointSurvey, settings: &CheckSettings) -> Vec<Finding> {
    let finding = |column: &str, (kind, measured): (FindingKind, String)| Finding {
        kind,
        column: format!("{column}.{}", joint.name),
        measured,
    };
    let mut all: Vec<Finding> =
        settings.position(joint).into_iter().map(|found| finding("q", found)).collect();
    if let Some(alignment) = joint.velocity.and_then(|velocity| velocity.alignment) {
        all.extend(settings.velocity(&alignment).into_iter().map(|found| finding("qd", found)));
    }
    let stands_still = all.iter().any(|finding| finding.kind == FindingKind::StandsStill);
    if let Some(torque) = joint.torque.as_ref().filter(|torque| !torque.constant() && !stands_still) {
        all.extend(settings.torque(torque).into_iter().map(|found| finding("tau", found)));
    }
    all
}

type Found = Vec<(FindingKind, String)>;

impl CheckSettings {
    fn velocity(&self, alignment: &Alignment) -> Found {
        let mut found = Vec::new();
        if self.is_late(alignment) {
            let which = if alignment.lag > 0.0 { "lags" } else { "leads" };
            found.push((
                FindingKind::LateVelocity,
                format!("{which} the positions by {:.3} s", alignment.lag.abs()),
            ));
        }
        if self.is_scaled(alignment) {
            found.push((
                FindingKind::VelocityScale,
                format!("is off: the positions' derivative is {:.4} times as large", alignment.scale),
            ));
        }
        if self.has_dead_band(alignment) {
            found.push((
                FindingKind::VelocityDeadBand,
                format!(
                    "is exactly 0 in {:.0} % of the time while the joint moves",
                    100.0 * alignment.zero_share
                ),
            ));
        }
        found
    }

    fn position(&self, joint: &JointSurvey) -> Found {
        let travel = joint.travel();
        if travel < self.least_travel.max(self.travel_to_noise * joint.position_noise_std) {
            return vec![(FindingKind::StandsStill, format!("moves by {travel:.2e} only"))];
        }
        let step = joint.position_shape.step;
        if step > self.position_step * travel {
            return vec![(
                FindingKind::EncoderSteps,
                format!("comes in steps of {step:.2e}, 1/{:.0} of its travel", travel / step),
            )];
        }
        Vec::new()
    }

    fn torque(&self, torque: &TorqueSurvey) -> Found {
        let shape = &torque.shape;
        let mut found = Vec::new();
        let flat_top = self.flat_top(torque, shape);
        // A signal that stands still at its limit is reported as a flat top, not twice.
        let at_top = |value: f64| flat_top.is_some() && (value == torque.max || value == torque.min);
        let still = shape.still.filter(|still| still.rows as f64 > self.still_runs * shape.mean_run);
        if let Some(still) = still.filter(|still| !at_top(still.value)) {
            let (kind, value) = match still.value {
                0.0 => (FindingKind::ZeroTorque, "exactly 0".to_owned()),
                value => (FindingKind::StillTorque, format!("{value:.4} throughout")),
            };
            found.push((
                kind,
                format!(
                    "is {value} for {:.2} s from t = {:.2} s while the joint moves ({} rows in all such stretches)",
                    still.duration, still.from, shape.still_rows
                ),
            ));
        }
        let unsigned = torque.min >= 0.0 || torque.max <= 0.0;
        if unsigned && shape.touches >= self.touches {
            found.push((
                FindingKind::UnsignedTorque,
                format!(
                    "comes near 0 {} times and never changes its sign: it looks like a magnitude",
                    shape.touches
                ),
            ));
        }
        if shape.step > self.torque_step * torque.rms {
            found.push((
                FindingKind::TorqueSteps,
                format!("comes in steps of {:.3}, 1/{:.0} of its RMS", shape.step, torque.rms / shape.step),
            ));
        }
        if let Some(measured) = flat_top {
            found.push((FindingKind::FlatTop, measured));
        }
        let across = shape.smallest > (self.steps_across_zero * shape.step).max(self.dead_band * torque.rms);
        // Long stretches of zeros have been reported above; they are no dead band.
        if still.is_none_or(|still| still.value != 0.0) && shape.zero_share > self.zero_share && across {
            found.push((
                FindingKind::TorqueDeadBand,
                format!(
                    "is exactly 0 in {:.0} % of the rows and at least {:.3} in all others",
                    100.0 * shape.zero_share,
                    shape.smallest
                ),
            ));
        }
        found
    }

    fn flat_top(&self, torque: &TorqueSurvey, shape: &SignalShape) -> Option<String> {
        let ends = [(torque.max, 0), (torque.min, 1)];
        let flat = |&(_, side): &(f64, usize)| {
            let rows = shape.at_ends[side];
            rows >= self.flat_rows && rows as f64 > self.flat_share * shape.near_ends[side] as f64
        };
        let (end, side) =
            ends.into_iter().filter(|&(end, _)| shape.step < self.torque_step * end.abs()).find(flat)?;
        Some(format!("has a flat top: {} rows at exactly {end:.4}", shape.at_ends[side]))
    }
}
