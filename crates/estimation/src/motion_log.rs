//! What the robot did: the measured Qⁱ and fⁱ.

use crate::{EstimationError, Readings};
use phiw_telemetry::{Block, Recording};
use serde::{Deserialize, Serialize};

/// A log with velocities, evenly sampled. Arrays are row-major, `[row × joints]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotionLog {
    /// Number of joints.
    pub joints: usize,
    /// Time between two rows \[s\].
    pub period_s: f64,
    /// Positions \[rad, m\].
    pub q: Vec<f64>,
    /// Velocities \[rad/s, m/s\].
    pub qd: Vec<f64>,
    /// Accelerations; empty if they were not measured.
    pub qdd: Vec<f64>,
    /// Torques as they were logged \[N·m, N\]. Over a period the one at its beginning is held.
    pub tau: Vec<f64>,
    /// For each row, whether the base stood still from it to the next; empty if it is bolted down. Rows in
    /// which it did not are no rows of a robot on a fixed base, and do not count.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub still: Vec<bool>,
    /// Torques that were commanded \[N·m, N\], one for each of `tau`; empty where nobody wrote them down.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<f64>,
    /// What the controller was asked for at each row; none where the log does not say.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub asked: Option<Asked>,
    /// The encoders' readings that positions and velocities were made of; none where these were measured.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub readings: Option<Readings>,
}

/// What a controller was asked for. Arrays are row-major, `[row × joints]`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Asked {
    /// Positions \[rad, m\].
    pub q: Vec<f64>,
    /// Velocities \[rad/s, m/s\].
    pub qd: Vec<f64>,
    /// Torques of the controller's own model for the reference \[N·m, N\].
    pub torque: Vec<f64>,
}

impl MotionLog {
    /// From a recording.
    ///
    /// # Errors
    /// It has no velocities, or fewer than two rows.
    pub fn from_recording(recording: &Recording) -> Result<Self, EstimationError> {
        let [first, .., last] = recording.t.as_slice() else {
            return Err(EstimationError::Log("it has fewer than two rows"));
        };
        let period_s = (last - first) / (recording.t.len() - 1) as f64;
        let qd = recording
            .qd
            .clone()
            .ok_or(EstimationError::Log("it has no velocities: let the sensors measure them"))?;
        Ok(MotionLog {
            joints: recording.joints.len(),
            period_s,
            q: recording.q.clone(),
            qd,
            qdd: recording.qdd.clone().unwrap_or_default(),
            tau: recording.tau.clone(),
            still: Vec::new(),
            command: Vec::new(),
            asked: None,
            readings: None,
        })
    }

    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.q.len().checked_div(self.joints).unwrap_or(0)
    }

    /// How long it is \[s\].
    pub fn duration_s(&self) -> f64 {
        self.rows().saturating_sub(1) as f64 * self.period_s
    }

    /// Share of the rows in which the base stood still.
    pub fn still_share(&self) -> f64 {
        let still = self.still.iter().filter(|still| **still).count();
        if self.still.is_empty() { 1.0 } else { still as f64 / self.still.len() as f64 }
    }

    /// The rows as they are.
    ///
    /// # Errors
    /// Accelerations were not measured.
    pub(crate) fn at_stamps(&self) -> Result<Block, EstimationError> {
        if self.qdd.len() != self.q.len() {
            let problem = "it has no accelerations: take rows over periods, which need none";
            return Err(EstimationError::Log(problem));
        }
        let signals = [self.q.clone(), self.qd.clone(), self.qdd.clone()];
        Ok(self.counted(0.0, signals, self.tau.clone()))
    }

    /// A block of the rows that count, stamped `shift_s` after their own.
    fn counted(&self, shift_s: f64, mut signals: [Vec<f64>; 3], mut tau: Vec<f64>) -> Block {
        let rows = tau.len() / self.joints.max(1);
        let counts = |row: usize| self.still.get(row).copied().unwrap_or(true);
        let t =
            (0..rows).filter(|&row| counts(row)).map(|row| row as f64 * self.period_s + shift_s).collect();
        for values in signals.iter_mut().chain([&mut tau]) {
            let mut index = 0;
            values.retain(|_| {
                index += 1;
                counts((index - 1) / self.joints)
            });
        }
        Block::unfiltered(self.joints, t, signals, tau)
    }

    /// One row for each period as it was when it began, with the acceleration of the period before: nothing
    /// that the noise of a period has done to the motion is in its own row. The torques of the rows are
    /// `tau`, `[period × joint]` of those that count.
    pub fn before_noise(&self, tau: Vec<f64>) -> Block {
        let mut block = self.beginnings();
        block.tau = tau;
        block
    }

    /// One row for each period as it could be foreseen when it began: where the joints would be in its middle
    /// at the speed that they had, that speed, the acceleration of the period before, and the torque that was
    /// commanded.
    pub(crate) fn begun(&self) -> Block {
        let mut block = self.beginnings();
        let half_s = 0.5 * self.period_s;
        block.q.iter_mut().zip(&block.qd).for_each(|(position, speed)| *position += half_s * speed);
        block
    }

    /// The rows that count, of those that begin a period.
    pub(crate) fn counted_rows(&self) -> Vec<usize> {
        let counts = |row: &usize| self.still.get(*row).copied().unwrap_or(true);
        (0..self.rows().saturating_sub(1)).filter(counts).collect()
    }

    fn beginnings(&self) -> Block {
        let count = self.rows().saturating_sub(1) * self.joints;
        let acceleration = |index: usize| match index.checked_sub(self.joints) {
            Some(before) => (self.qd[index] - self.qd[before]) / self.period_s,
            None => 0.0,
        };
        let signals =
            [self.q[..count].to_vec(), self.qd[..count].to_vec(), (0..count).map(acceleration).collect()];
        self.counted(0.0, signals, self.tau[..count].to_vec())
    }

    /// One row for each period: the middle position of Hermite's cubic, and the means of velocity and
    /// acceleration.
    pub fn over_periods(&self) -> Block {
        let rows = self.rows().saturating_sub(1);
        let (count, period) = (rows * self.joints, self.period_s);
        let mut signals = [0; 3].map(|_| Vec::with_capacity(count));
        for index in 0..count {
            let next = index + self.joints;
            let ([q0, q1], [v0, v1]) = ([self.q[index], self.q[next]], [self.qd[index], self.qd[next]]);
            signals[0].push(0.5 * (q0 + q1) - 0.125 * period * (v1 - v0));
            signals[1].push((q1 - q0) / period);
            signals[2].push((v1 - v0) / period);
        }
        self.counted(0.5 * period, signals, self.tau[..count].to_vec())
    }
}
