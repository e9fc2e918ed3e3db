//! A measured log: its motion, its torques, and the same file with another torque.

use anyhow::{Context, ensure};
use std::path::Path;

/// Half of the stretch that a line is laid through for a velocity \[s\].
const HALF_STRETCH_S: f64 = 0.03;

/// The cells of a log, and the motion of its joints.
pub struct MeasuredLog {
    header: csv::StringRecord,
    rows: Vec<csv::StringRecord>,
    joints: Vec<String>,
    /// Place of each joint's torque among the columns.
    torque_columns: Vec<usize>,
    /// Time \[s\].
    pub t: Vec<f64>,
    /// Position, velocity, acceleration and torque of each joint; a torque that is missing is NaN.
    pub signals: Vec<Signals>,
}

/// What a log has of one joint.
pub struct Signals {
    /// Position \[rad, m\].
    pub q: Vec<f64>,
    /// Velocity \[rad/s, m/s\].
    pub v: Vec<f64>,
    /// Acceleration \[rad/s², m/s²\].
    pub a: Vec<f64>,
    /// Torque or force \[N·m, N\].
    pub torque: Vec<f64>,
}

impl MeasuredLog {
    /// Reads a log in the form of `formats.md`.
    ///
    /// # Errors
    /// It cannot be read, or lacks a time, a position or a torque.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let mut reader = csv::Reader::from_path(path).with_context(|| path.display().to_string())?;
        let header = reader.headers()?.clone();
        let rows: Vec<csv::StringRecord> =
            reader.records().collect::<Result<_, _>>().with_context(|| path.display().to_string())?;
        let place = |name: &str| header.iter().position(|other| other == name);
        let values = |name: &str| -> anyhow::Result<Vec<f64>> {
            let column = place(name).with_context(|| format!("{}: no column {name}", path.display()))?;
            Ok(rows.iter().map(|row| row[column].parse().unwrap_or(f64::NAN)).collect())
        };
        let t = values("t")?;
        ensure!(t.len() > 2, "{}: no rows", path.display());
        let mut steps: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        steps.sort_by(f64::total_cmp);
        let period = steps[steps.len() / 2];
        let half = ((HALF_STRETCH_S / period).round() as usize).max(1);
        let joints: Vec<String> =
            header.iter().filter_map(|name| name.strip_prefix("tau.")).map(str::to_owned).collect();
        let mut signals = Vec::new();
        for joint in &joints {
            let q = bridged(values(&format!("q.{joint}"))?);
            let v = slopes(&q, half, period);
            let a = slopes(&v, half, period);
            signals.push(Signals { q, v, a, torque: values(&format!("tau.{joint}"))? });
        }
        let torque_columns = joints.iter().filter_map(|joint| place(&format!("tau.{joint}"))).collect();
        Ok(MeasuredLog { header, rows, joints, torque_columns, t, signals })
    }

    /// The joints that have a torque.
    pub fn joints(&self) -> Vec<String> {
        self.joints.clone()
    }

    /// Time from the first row to the last \[s\].
    pub fn duration(&self) -> f64 {
        self.t.last().unwrap_or(&0.0) - self.t[0]
    }

    /// Writes the log with something added to the torque of a joint.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_with(&self, joint: usize, added: &[f64], path: &Path) -> anyhow::Result<()> {
        let mut writer = csv::Writer::from_path(path).with_context(|| path.display().to_string())?;
        writer.write_record(&self.header)?;
        for ((row, added), torque) in self.rows.iter().zip(added).zip(&self.signals[joint].torque) {
            let changed = (torque + added).to_string();
            writer.write_record(row.iter().enumerate().map(|(column, cell)| {
                if column == self.torque_columns[joint] && torque.is_finite() {
                    changed.as_str()
                } else {
                    cell
                }
            }))?;
        }
        writer.flush().with_context(|| path.display().to_string())
    }
}

/// Missing values replaced by the one before (at the beginning by the first that is there).
fn bridged(mut values: Vec<f64>) -> Vec<f64> {
    let mut last = values.iter().copied().find(|value| value.is_finite()).unwrap_or(0.0);
    for value in &mut values {
        if value.is_finite() {
            last = *value;
        } else {
            *value = last;
        }
    }
    values
}

/// Slope of the line through the samples around each.
fn slopes(values: &[f64], half: usize, period: f64) -> Vec<f64> {
    let slope = |k: usize| {
        let (first, last) = (k.saturating_sub(half), (k + half).min(values.len() - 1));
        let middle = 0.5 * (first + last) as f64;
        let offset = |at: usize| at as f64 - middle;
        let spread: f64 = (first..=last).map(|at| offset(at).powi(2)).sum();
        let moment: f64 = (first..=last).map(|at| offset(at) * values[at]).sum();
        moment / (spread * period)
    };
    (0..values.len()).map(slope).collect()
}

#[cfg(test)]
mod tests {
    use super::MeasuredLog;

    const LOG: &str = "t,q.a,tau.a,note.a\n0.00,0.0,1.0,x\n0.01,0.02,,y\n0.02,0.04,3.0,z\n0.03,0.06,4.0,w\n";

    #[test]
    fn a_log_is_written_as_it_was_but_for_one_torque() -> anyhow::Result<()> {
        let folder = tempfile::tempdir()?;
        let (before, after) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
        std::fs::write(&before, LOG)?;
        let log = MeasuredLog::read(&before)?;
        assert_eq!((log.joints(), log.duration()), (vec!["a".to_owned()], 0.03));
        assert!(log.signals[0].v.iter().all(|v| (v - 2.0).abs() < 1e-9), "{:?}", log.signals[0].v);
        log.write_with(0, &[0.5; 4], &after)?;
        let expected = LOG.replace(",1.0,", ",1.5,").replace(",3.0,", ",3.5,").replace(",4.0,", ",4.5,");
        assert_eq!(std::fs::read_to_string(&after)?, expected);
        Ok(())
    }
}
