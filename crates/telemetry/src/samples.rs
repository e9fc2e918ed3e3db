//! The usable rows of a log as they were measured: nothing filtered, resampled or differentiated.

use crate::columns::Layout;
use crate::log_rows::open_log;
use crate::reader::Rows;
use crate::segments::{Segment, SegmentSink};
use crate::stream::usable_rows;
use crate::{LogError, Survey};

/// One usable row of a log.
#[derive(Debug, Clone, Copy)]
pub struct Sample<'a> {
    /// Stamp, in seconds.
    pub t: f64,
    /// Which segment it belongs to, counted from 0, those too short to use among them.
    pub segment: usize,
    layout: &'a Layout,
    values: &'a [f64],
}

impl Sample<'_> {
    /// Position of a joint, in rad or m.
    pub fn q(&self, joint: usize) -> f64 {
        self.values[self.layout.q() + joint]
    }

    /// Velocity of a joint, in rad/s or m/s, where the log has it.
    pub fn qd(&self, joint: usize) -> Option<f64> {
        self.layout.qd[joint].map(|place| self.values[place])
    }

    /// Torque of a joint, in N·m or N, where the log has it.
    pub fn tau(&self, joint: usize) -> Option<f64> {
        self.layout.torque.then(|| self.values[self.layout.tau() + joint])
    }
}

/// Reads a surveyed log again and hands its usable rows to `sink`, in order and in constant memory; joints
/// are numbered as in the survey. `progress` is called with the bytes done and the bytes in total now and
/// then.
///
/// # Errors
/// What [`survey`](crate::survey()) finds, and [`LogError::Changed`] if the file has changed since.
pub fn samples(
    survey: &Survey,
    progress: &mut dyn FnMut(u64, u64),
    sink: &mut dyn FnMut(Sample<'_>),
) -> Result<(), LogError> {
    let joints: Vec<String> = survey.joints.iter().map(|joint| joint.name.clone()).collect();
    let mut rows = open_log(&survey.source, &joints, survey.torque)?;
    let layout = rows.layout().clone();
    usable_rows(&mut rows, survey, &mut Samples { layout, segment: 0, sink, progress })?;
    if rows.content_hash() != survey.content_hash {
        return Err(LogError::Changed { path: survey.path.clone() });
    }
    Ok(())
}

struct Samples<'a> {
    layout: Layout,
    segment: usize,
    sink: &'a mut dyn FnMut(Sample<'_>),
    progress: &'a mut dyn FnMut(u64, u64),
}

impl SegmentSink for Samples<'_> {
    fn sample(&mut self, values: &[f64]) -> bool {
        let Samples { layout, segment, sink, .. } = self;
        sink(Sample { t: values[0], segment: *segment, layout, values });
        true
    }

    fn end(&mut self, _: Segment) -> bool {
        self.segment += 1;
        true
    }

    fn progress(&mut self, done: u64, total: u64) {
        (self.progress)(done, total);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Recording, TorqueColumns, survey};

    #[test]
    fn rows_come_as_they_were_measured_and_gaps_part_them() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let t: Vec<f64> = (0..200).map(|row| 0.01 * f64::from(row)).collect();
        let q: Vec<f64> = t.iter().map(|t| (3.0 * t).sin()).collect();
        let mut tau: Vec<f64> = t.iter().map(|t| (5.0 * t).cos()).collect();
        tau[120] = f64::NAN;
        let recording = Recording { joints: vec!["a".into()], t, q, tau, ..Recording::default() };
        recording.write_csv(&path).unwrap();
        let survey = survey(&path, &recording.joints, TorqueColumns::Optional, &mut |_, _| {}).unwrap();
        let mut seen = Vec::new();
        samples(&survey, &mut |_, _| {}, &mut |sample| {
            assert_eq!(sample.qd(0), None);
            seen.push((sample.segment, sample.t, sample.q(0), sample.tau(0)));
        })
        .unwrap();
        let expected: Vec<_> = (0..200)
            .filter(|row| *row != 120)
            .map(|row| (usize::from(row > 120), recording.t[row], recording.q[row], Some(recording.tau[row])))
            .collect();
        assert_eq!(seen, expected);
    }
}
