//! From what a logger on a robot wrote down to motions at the controller's rate.
//!
//! A logger knows encoders and torques at its own rate, and perhaps what the controller commanded
//! (`tau_cmd`) or was asked for (`qref`). How long a command is held is seen in the signals themselves: a
//! command that is held does not change. So is the step of an encoder: readings are whole numbers of it.

use crate::motion_log::Asked;
use crate::{EstimationError, MotionLog};
use phiw_telemetry::{LogColumns, LogError, LogWriter, Recording};
use std::path::Path;

/// A log as it was written down. A row with a number that is not finite is a gap.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Logged {
    /// Time, encoders and torques; perhaps speeds.
    pub recording: Recording,
    /// What was commanded in each row \[N·m, N\], `[row × joint]`; none if the log does not say.
    pub command: Option<Vec<f64>>,
    /// What the controller was asked for in each row \[rad, m\]; none if the log does not say.
    pub reference: Option<Vec<f64>>,
}

/// How logs are cut into motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoggedSettings {
    /// Time for which a command is held \[s\]; none: it is seen in the log.
    pub command_period_s: Option<f64>,
    /// Share of a logger's period by which a stamp may be late before rows are taken to be missing.
    /// Default: 0.5.
    pub late_stamp: f64,
    /// Periods that a stretch without gaps has at least; shorter ones are left out. Default: 20.
    pub shortest: usize,
    /// Error of the positions that the speeds of a log foretell, over what the speeds change by, up to which
    /// they are believed. Default: 0.15, the third that a joint behind a large gear loses of its acceleration
    /// within a period, times the half of 1/12 to 1/6 that it moves the position by, and as much again.
    /// Filtered speeds are late and miss it.
    pub speeds_miss: f64,
}

impl Default for LoggedSettings {
    fn default() -> Self {
        LoggedSettings { command_period_s: None, late_stamp: 0.5, shortest: 20, speeds_miss: 0.15 }
    }
}

impl Logged {
    /// Whether the log says what the controller did beside the torques.
    pub fn knows_controller(&self) -> bool {
        self.command.is_some() || self.reference.is_some()
    }

    /// Writes it as a log: `t`, `q`, `tau`, and `qd`, `qref` and `tau_cmd` where they are known.
    ///
    /// # Errors
    /// The file can not be written.
    pub fn write_csv(&self, path: &Path) -> Result<(), LogError> {
        let Recording { joints, t, q, tau, qd, .. } = &self.recording;
        let columns = LogColumns {
            torque: true,
            velocity: qd.is_some(),
            reference: self.reference.is_some(),
            command: self.command.is_some(),
            ..LogColumns::default()
        };
        let unwritable = |source| LogError::Unwritable { path: path.into(), source };
        let mut writer = LogWriter::create(path, joints, columns)?;
        let known = [qd.as_ref(), self.reference.as_ref(), self.command.as_ref()];
        for (row, t) in t.iter().enumerate() {
            let own = row * joints.len()..(row + 1) * joints.len();
            let mut signals = vec![&q[own.clone()], &tau[own.clone()]];
            signals.extend(known.into_iter().flatten().map(|signal| &signal[own.clone()]));
            writer.write(*t, &signals).map_err(unwritable)?;
        }
        writer.finish().map_err(unwritable)?;
        Ok(())
    }

    /// The stretches without gaps, each a motion with a row for every command.
    ///
    /// Where the reference is known and the commands are not, [`MotionLog::asked`] has positions and speeds,
    /// and torques of zero: those of the controller's model are the caller's to fill in.
    ///
    /// # Errors
    /// No stretch is long enough.
    pub fn motions(&self, settings: &LoggedSettings) -> Result<Vec<MotionLog>, EstimationError> {
        let too_short = EstimationError::Log(
            "no stretch without gaps is long enough: log at least a second at the controller's rate or faster",
        );
        let t = &self.recording.t;
        let mut between: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        between.retain(|step| step.is_finite() && *step > 0.0);
        between.sort_by(f64::total_cmp);
        let Some(&row_s) = between.get(between.len() / 2) else { return Err(too_short) };
        let (rows, first) = match settings.command_period_s {
            Some(period_s) => (((period_s / row_s).round() as usize).max(1), 0),
            None => self.rows_a_command(),
        };
        let steps = self.encoder_steps();
        let mut motions = Vec::new();
        for stretch in self.stretches((1.0 + settings.late_stamp) * row_s) {
            // Commands change at rows `first`, `first + rows`, …
            let start = stretch.start + (first + rows - stretch.start % rows) % rows;
            let count = stretch.end.saturating_sub(start);
            if count < rows * settings.shortest {
                continue;
            }
            let own = self.rows(start..stretch.end);
            let span = own.recording.t[count - 1] - own.recording.t[0];
            let period_s = settings.command_period_s.unwrap_or(rows as f64 * span / (count - 1) as f64);
            motions.push(own.motion(period_s, rows, &steps, settings)?);
        }
        if motions.is_empty() { Err(too_short) } else { Ok(motions) }
    }

    /// Rows for which a command is held, and the first row in which one begins. Where commands change in no
    /// regular way, one a row.
    fn rows_a_command(&self) -> (usize, usize) {
        let joints = self.recording.joints.len();
        let held = self.command.as_ref().unwrap_or(&self.recording.tau);
        let rows: Vec<&[f64]> = held.chunks_exact(joints.max(1)).collect();
        let changes: Vec<usize> = (1..rows.len()).filter(|&row| rows[row] != rows[row - 1]).collect();
        let Some(&first) = changes.first() else { return (1, 0) };
        let rows =
            changes.windows(2).fold(0, |known, pair| greatest_common_divisor(known, pair[1] - pair[0]));
        let rows = rows.max(1);
        (rows, first % rows)
    }

    /// The least that the readings of each joint change by, beside rounding.
    fn encoder_steps(&self) -> Vec<f64> {
        let joints = self.recording.joints.len();
        let of_joint = |joint: usize| {
            let readings: Vec<f64> = self.recording.q.iter().skip(joint).step_by(joints).copied().collect();
            let rounding =
                ROUNDING * readings.iter().map(|q| q.abs()).filter(|q| q.is_finite()).fold(1.0, f64::max);
            let changes = readings.windows(2).map(|pair| (pair[1] - pair[0]).abs());
            let least = changes.filter(|change| *change > rounding).fold(f64::INFINITY, f64::min);
            if least.is_finite() { least } else { rounding }
        };
        (0..joints).map(of_joint).collect()
    }

    /// Rows without a gap between them, a row being no later than `late_s` after the one before.
    fn stretches(&self, late_s: f64) -> Vec<std::ops::Range<usize>> {
        let (joints, t) = (self.recording.joints.len(), &self.recording.t);
        let others = [
            Some(&self.recording.q),
            Some(&self.recording.tau),
            self.command.as_ref(),
            self.reference.as_ref(),
        ];
        let whole = |row: usize| {
            let own =
                |values: &Vec<f64>| values[row * joints..(row + 1) * joints].iter().all(|x| x.is_finite());
            t[row].is_finite() && others.into_iter().flatten().all(own)
        };
        let mut stretches: Vec<std::ops::Range<usize>> = Vec::new();
        for row in (0..t.len()).filter(|&row| whole(row)) {
            match stretches.last_mut() {
                Some(last) if last.end == row && t[row] > t[row - 1] && t[row] - t[row - 1] <= late_s => {
                    last.end += 1;
                }
                _ => stretches.push(row..row + 1),
            }
        }
        stretches
    }

    fn rows(&self, rows: std::ops::Range<usize>) -> Logged {
        let joints = self.recording.joints.len();
        let cut = |values: &Vec<f64>| values[rows.start * joints..rows.end * joints].to_vec();
        let recording = Recording {
            joints: self.recording.joints.clone(),
            t: self.recording.t[rows.clone()].to_vec(),
            q: cut(&self.recording.q),
            tau: cut(&self.recording.tau),
            qd: self.recording.qd.as_ref().map(cut),
            ..Recording::default()
        };
        Logged {
            recording,
            command: self.command.as_ref().map(cut),
            reference: self.reference.as_ref().map(cut),
        }
    }

    /// The motion of a stretch without gaps that begins with a command.
    fn motion(
        &self,
        period_s: f64,
        rows: usize,
        steps: &[f64],
        settings: &LoggedSettings,
    ) -> Result<MotionLog, EstimationError> {
        let exact = (rows == 1 && self.speeds_fit(period_s, settings.speeds_miss))
            .then(|| MotionLog::from_recording(&self.recording));
        let mut log = exact.unwrap_or_else(|| MotionLog::of_encoders(&self.recording, period_s, steps))?;
        log.qdd.clear();
        let joints = log.joints;
        let at_commands = |values: &Vec<f64>| -> Vec<f64> {
            let count = values.len() / joints;
            let of_row = |row: usize| (row * rows).min(count - 1) * joints;
            (0..log.rows())
                .flat_map(|row| values[of_row(row)..of_row(row) + joints].iter().copied())
                .collect()
        };
        if let Some(command) = &self.command {
            log.command = at_commands(command);
        } else if let Some(reference) = &self.reference {
            let q = at_commands(reference);
            let last = log.rows() - 1;
            let speed = |index: usize| {
                let (row, joint) = (index / joints, index % joints);
                let (before, after) = (row.saturating_sub(1), (row + 1).min(last));
                (q[after * joints + joint] - q[before * joints + joint])
                    / ((after - before) as f64 * period_s)
            };
            let qd = (0..q.len()).map(speed).collect();
            log.asked = Some(Asked { torque: vec![0.0; q.len()], q, qd });
        }
        Ok(log)
    }

    /// Whether there are speeds, and positions follow from them.
    fn speeds_fit(&self, period_s: f64, miss: f64) -> bool {
        let Some(qd) = &self.recording.qd else { return false };
        let joints = self.recording.joints.len();
        let (mut error, mut change) = (0.0, 0.0);
        for (q, v) in self.recording.q.windows(joints + 1).zip(qd.windows(joints + 1)) {
            let moved = (q[joints] - q[0]) / period_s - 0.5 * (v[0] + v[joints]);
            error += moved * moved;
            change += (v[joints] - v[0]).powi(2);
        }
        change > 0.0 && error <= miss * miss * change
    }
}

/// Rounding of an angle of some turns, over the larger of it and 1.
const ROUNDING: f64 = 1e-12;

fn greatest_common_divisor(a: usize, b: usize) -> usize {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint whose command is held for ten rows from row 3 on, with encoders of a thousandth.
    fn held() -> Logged {
        let rows = 1003;
        let command: Vec<f64> = (0..rows).map(|row: usize| ((row + 7) / 10) as f64).collect();
        let q = (0..rows).map(|row| (f64::sin(0.003 * row as f64) * 1e3).round() * 1e-3).collect();
        let t = (0..rows).map(|row| 1e-3 * row as f64).collect();
        let recording =
            Recording { joints: vec!["a".to_owned()], t, q, tau: vec![0.5; rows], ..Recording::default() };
        Logged { recording, command: Some(command), reference: None }
    }

    #[test]
    fn the_period_of_commands_and_the_steps_of_encoders_are_seen() -> Result<(), EstimationError> {
        let logged = held();
        let motions = logged.motions(&LoggedSettings::default())?;
        let [motion] = motions.as_slice() else { panic!("{} motions", motions.len()) };
        assert!((motion.period_s - 0.01).abs() < 1e-9, "{}", motion.period_s);
        assert!((logged.encoder_steps()[0] - 1e-3).abs() < 1e-9);
        // The first row is that of the first change.
        assert_eq!(motion.command[..3], [1.0, 2.0, 3.0]);
        let speed = motion.qd[motion.rows() / 2];
        let truth = 3.0 * f64::cos(3.0 * (3e-3 + 0.01 * (motion.rows() / 2) as f64));
        assert!((speed - truth).abs() < 0.05, "{speed}, {truth}");
        Ok(())
    }

    #[test]
    fn a_gap_parts_a_log_into_two_motions_whose_commands_stay_in_step() -> Result<(), EstimationError> {
        let mut logged = held();
        logged.recording.q[498] = f64::NAN;
        let motions = logged.motions(&LoggedSettings::default())?;
        let first: Vec<f64> = motions.iter().map(|motion| motion.command[0]).collect();
        assert_eq!(first, [1.0, 51.0]);
        Ok(())
    }

    #[test]
    fn a_log_of_gaps_is_refused() {
        let mut logged = held();
        logged.recording.q.iter_mut().step_by(7).for_each(|q| *q = f64::NAN);
        assert!(logged.motions(&LoggedSettings::default()).is_err());
    }
}
