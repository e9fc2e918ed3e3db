//! What should be known of a log before anything is fitted to it: what sensors, drives and loggers did to it, what follows, and how to mend it.

use crate::{Alignment, JointSurvey, SignalShape, Survey, TorqueSurvey};
use std::fmt;

/// From where on something is worth saying. What the real logs of the tests show lies below each of these unless it is truly there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CheckSettings {
    /// Share of the velocity's power that a lag costs; 0.0025 is an error of 5 % of its root mean square, which is that of good frictions.
    pub lag_cost: f64,
    /// Distance of a velocity's scale from 1; gear ratios and radii are known better than this.
    pub scale_error: f64,
    /// Share of a velocity's power that may be unexplained for its scale to be judged.
    pub scale_unexplained: f64,
    /// Share of time in which a velocity or a torque is exactly 0; zero crossings alone are below it.
    pub zero_share: f64,
    /// Root mean square of motion while a velocity is 0, as a share of that of all.
    pub motion_at_zero: f64,
    /// Smallest torque besides 0 in steps of the torque: 1 without a dead band, and 2 where one step is never met.
    pub steps_across_zero: f64,
    /// The same as a share of the torque's root mean square: values that come in no steps lie as near to 0 as there are rows.
    pub dead_band: f64,
    /// Steps of a torque over its root mean square: at 0.1 they add noise of 3 %.
    pub torque_step: f64,
    /// Steps of a position over its travel: at 1/500 a turn has 9 bits.
    pub position_step: f64,
    /// Length of a stretch of one value in mean lengths of such stretches: more than torque in steps brings about.
    pub still_runs: f64,
    /// Share of the rows near the top that are at exactly the top.
    pub flat_share: f64,
    /// Rows at exactly the top.
    pub flat_rows: u64,
    /// How often a torque of one sign must come near 0 to be taken for a magnitude; gravity alone may keep one sign, but does not bounce.
    pub touches: u64,
    /// Jitter of the stamps as a share of the period.
    pub jitter: f64,
    /// Slowest sampling \[Hz\]: five samples for a motion of 4 Hz.
    pub slowest_hz: f64,
    /// Travel in standard deviations of the position's noise below which a joint stands still.
    pub travel_to_noise: f64,
    /// Travel below which a joint stands still \[rad, m\].
    pub least_travel: f64,
}

impl Default for CheckSettings {
    fn default() -> Self {
        CheckSettings {
            lag_cost: 0.0025,
            scale_error: 0.05,
            scale_unexplained: 0.05,
            zero_share: 0.02,
            motion_at_zero: 0.03,
            steps_across_zero: 3.0,
            dead_band: 0.01,
            torque_step: 0.1,
            position_step: 0.002,
            still_runs: 20.0,
            flat_share: 0.5,
            flat_rows: 20,
            touches: 3,
            jitter: 0.3,
            slowest_hz: 20.0,
            travel_to_noise: 20.0,
            least_travel: 1e-3,
        }
    }
}

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
            FindingKind::TorqueUnit => "all parameters would be off by this factor",
            FindingKind::StandsStill => "nothing of what it moves can be told",
        }
    }

    /// What to do about it.
    pub fn mend(self) -> &'static str {
        match self {
            FindingKind::LateVelocity | FindingKind::VelocityScale | FindingKind::VelocityDeadBand => {
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
    for joint in &survey.joints {
        all.extend(of_joint(joint, settings));
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
    /// Whether a velocity is not the positions' derivative.
    pub fn contradicts(&self, alignment: &Alignment) -> bool {
        !self.velocity(alignment).is_empty()
    }

    fn velocity(&self, alignment: &Alignment) -> Found {
        let mut found = Vec::new();
        let cost = alignment.unexplained - alignment.unexplained_at_lag;
        let mended = alignment.unexplained_at_lag < 0.5 * alignment.unexplained;
        if cost > self.lag_cost && mended && alignment.lag.abs() > 0.5 * alignment.resolution {
            let which = if alignment.lag > 0.0 { "lags" } else { "leads" };
            found.push((
                FindingKind::LateVelocity,
                format!("{which} the positions by {:.3} s", alignment.lag.abs()),
            ));
        }
        let judged = alignment.unexplained_at_lag < self.scale_unexplained;
        if judged && (alignment.scale - 1.0).abs() > self.scale_error {
            found.push((
                FindingKind::VelocityScale,
                format!("is off: the positions' derivative is {:.4} times as large", alignment.scale),
            ));
        }
        if alignment.zero_share > self.zero_share && alignment.motion_at_zero > self.motion_at_zero {
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
        let still = shape.still.filter(|still| still.rows as f64 > self.still_runs * shape.mean_run);
        if let Some(still) = still {
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
        if let Some(measured) = self.flat_top(torque, shape) {
            found.push((FindingKind::FlatTop, measured));
        }
        let across = shape.smallest > (self.steps_across_zero * shape.step).max(self.dead_band * torque.rms);
        // Where it rests at 0 for seconds there is no need of a threshold.
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
        let fine = |&(end, _): &(f64, usize)| shape.step < self.torque_step * end.abs();
        let (end, side) = ends.into_iter().filter(fine).find(flat)?;
        Some(format!("has a flat top: {} rows at exactly {end:.4}", shape.at_ends[side]))
    }
}
