//! Position, velocity and torque of each joint over the logs, thinned for pictures while they stream by.

use super::Checked;
use crate::Error;
use crate::console::Console;
use phiw_identification::Interruption;
use phiw_report::plot::{Decimator, Polyline};
use phiw_telemetry::{Sample, Survey, samples};
use std::collections::VecDeque;

/// Logs that are drawn, the first ones: with 30 joints a page of 8 logs has some 2.5 MB.
const LOGS_DRAWN: usize = 8;

/// Points of a line, nearly two for each pixel of a small picture's width.
const POINTS: usize = 600;

/// Steps over which a velocity is taken from positions where the log has none: as in the survey, so that an
/// encoder's steps do not drown it.
const STEPS: usize = 4;

/// One log's lines, for each joint.
pub(super) struct DrawnLog {
    /// Which log it is.
    pub log: usize,
    /// The lines of each joint.
    pub joints: Vec<DrawnJoint>,
}

/// Signals of one joint over time in seconds; NaN at a gap.
pub(super) struct DrawnJoint {
    /// Position, in rad or m.
    pub q: Polyline,
    /// Velocity, in rad/s or m/s.
    pub qd: Polyline,
    /// Whether the log has the velocity; else it is from differences of positions.
    pub velocity_in_log: bool,
    /// Torque, in N·m or N, where the log has it.
    pub tau: Option<Polyline>,
}

/// Reads the logs again, in constant memory.
///
/// # Errors
/// A log has changed since it was surveyed, or somebody wants an end.
pub(super) fn drawn(
    checked: &Checked<'_>,
    interruption: &Interruption,
    console: &Console,
) -> Result<Vec<DrawnLog>, Error> {
    let mut logs = Vec::new();
    for (log, survey) in checked.surveys.iter().enumerate().take(LOGS_DRAWN) {
        interruption.check()?;
        let mut lines = Lines::new(survey);
        let mut progress = |done, total| console.progress("drawing", done, total);
        samples(survey, &mut progress, &mut |sample| lines.push(&sample))?;
        logs.push(DrawnLog { log, joints: lines.finish(survey) });
    }
    console.finish();
    Ok(logs)
}

/// Lines that are being drawn.
struct Lines {
    segment: usize,
    /// The latest stamps of the segment, oldest first.
    stamps: VecDeque<f64>,
    joints: Vec<JointLines>,
}

struct JointLines {
    q: Decimator,
    qd: Decimator,
    tau: Decimator,
    /// The positions at the latest stamps.
    recent: VecDeque<f64>,
}

impl Lines {
    fn new(survey: &Survey) -> Self {
        let line = || Decimator::new(POINTS);
        let joint = |_| JointLines { q: line(), qd: line(), tau: line(), recent: VecDeque::new() };
        Lines { segment: 0, stamps: VecDeque::new(), joints: survey.joints.iter().map(joint).collect() }
    }

    fn push(&mut self, sample: &Sample<'_>) {
        let t = sample.t;
        if std::mem::replace(&mut self.segment, sample.segment) != sample.segment {
            self.stamps.clear();
            self.joints.iter_mut().for_each(JointLines::interrupt);
        }
        keep(&mut self.stamps, t);
        for (joint, lines) in self.joints.iter_mut().enumerate() {
            let q = sample.q(joint);
            keep(&mut lines.recent, q);
            lines.q.push(t, q);
            if let Some(qd) = sample.qd(joint) {
                lines.qd.push(t, qd);
            } else if let (Some(before), Some(first)) = (self.stamps.front(), lines.recent.front())
                && lines.recent.len() > STEPS
            {
                lines.qd.push(0.5 * (t + before), (q - first) / (t - before));
            }
            if let Some(tau) = sample.tau(joint) {
                lines.tau.push(t, tau);
            }
        }
    }

    fn finish(self, survey: &Survey) -> Vec<DrawnJoint> {
        let joint = |(lines, survey): (JointLines, &phiw_telemetry::joint_survey::JointSurvey)| DrawnJoint {
            q: lines.q.finish(),
            qd: lines.qd.finish(),
            velocity_in_log: survey.velocity.is_some(),
            tau: survey.torque.map(|_| lines.tau.finish()),
        };
        self.joints.into_iter().zip(&survey.joints).map(joint).collect()
    }
}

impl JointLines {
    fn interrupt(&mut self) {
        self.recent.clear();
        [&mut self.q, &mut self.qd, &mut self.tau].into_iter().for_each(Decimator::gap);
    }
}

/// Keeps the latest values.
fn keep(recent: &mut VecDeque<f64>, value: f64) {
    if recent.len() > STEPS {
        recent.pop_front();
    }
    recent.push_back(value);
}
