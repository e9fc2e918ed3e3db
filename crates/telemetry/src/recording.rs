//! A log in memory: for simulators and small files.

use crate::columns::{Layout, Optional};
use crate::log_rows::open_log;
use crate::reader::{Row, Rows, unusable};
use crate::stream::stream_rows;
use crate::survey::survey_rows;
use crate::turns::WithoutTurns;
use crate::{Block, Conditioning, LogColumns, LogError, LogSource, LogWriter, Survey, TorqueColumns};
use std::io::Write;
use std::ops::ControlFlow;
use std::path::Path;

/// A log in memory. Arrays of joints are row-major, `[row × joints]`; a value that is not finite is a gap.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Recording {
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Time stamps, in seconds.
    pub t: Vec<f64>,
    /// Positions, in rad or m.
    pub q: Vec<f64>,
    /// Torques, in N·m or N; empty if there are none.
    pub tau: Vec<f64>,
    /// Measured velocities, in rad/s or m/s, if any.
    pub qd: Option<Vec<f64>>,
    /// Measured accelerations, in rad/s² or m/s², if any.
    pub qdd: Option<Vec<f64>>,
    /// Temperatures, in °C, if any.
    pub temp: Option<Vec<f64>>,
}

impl Recording {
    /// Reads a whole log into memory. Rows that can't be used become rows of NaN, so that gaps stay gaps; a
    /// joint without a signal that others have gets NaN for it.
    ///
    /// # Errors
    /// What [`survey`](crate::survey()) finds but for time running backwards, which is seen when the
    /// recording is used.
    pub fn read(
        source: impl Into<LogSource>,
        joints: &[String],
        torque: TorqueColumns,
    ) -> Result<Self, LogError> {
        let mut reader = WithoutTurns::new(open_log(&source.into(), joints, torque)?);
        let layout = reader.layout().clone();
        let n = joints.len();
        let mut values = vec![0.0; layout.width];
        let has = |places: &[Option<usize>]| places.iter().any(Option::is_some).then(Vec::new);
        let mut recording = Recording {
            joints: joints.to_vec(),
            qd: has(&layout.qd),
            qdd: has(&layout.qdd),
            temp: has(&layout.temp),
            ..Recording::default()
        };
        loop {
            match reader.next(&mut values)? {
                Row::Sample { .. } => {}
                Row::Gap { t, .. } => {
                    values.fill(f64::NAN);
                    values[0] = t.unwrap_or(f64::NAN);
                }
                Row::End => return Ok(recording),
            }
            recording.t.push(values[0]);
            recording.q.extend_from_slice(&values[layout.q()..][..n]);
            if layout.torque {
                recording.tau.extend_from_slice(&values[layout.tau()..][..n]);
            }
            let optional = [
                (&mut recording.qd, &layout.qd),
                (&mut recording.qdd, &layout.qdd),
                (&mut recording.temp, &layout.temp),
            ];
            for (signal, places) in optional {
                if let Some(signal) = signal {
                    signal.extend(places.iter().map(|place| place.map_or(f64::NAN, |place| values[place])));
                }
            }
        }
    }

    /// [`Recording::read`] of a file.
    ///
    /// # Errors
    /// As there.
    pub fn from_csv(path: &Path, joints: &[String], torque: TorqueColumns) -> Result<Self, LogError> {
        Self::read(path, joints, torque)
    }

    /// Rows.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }

    /// Writes the recording as a log.
    ///
    /// # Errors
    /// [`LogError::Shape`], [`LogError::Unwritable`].
    pub fn write_csv(&self, path: &Path) -> Result<(), LogError> {
        self.check()?;
        let mut writer = LogWriter::create(path, &self.joints, self.columns())?;
        self.write_rows(&mut writer)
            .and_then(|()| writer.finish())
            .map_err(|source| LogError::Unwritable { path: path.into(), source })?;
        Ok(())
    }

    /// Writes the recording as a log to `out`.
    ///
    /// # Errors
    /// [`LogError::Shape`]; [`LogError::Unwritable`], with an empty path.
    pub fn write_to(&self, out: impl Write) -> Result<(), LogError> {
        self.check()?;
        let unwritable = |source| LogError::Unwritable { path: "output".into(), source };
        let mut writer = LogWriter::new(out, &self.joints, self.columns()).map_err(unwritable)?;
        self.write_rows(&mut writer).and_then(|()| writer.finish()).map_err(unwritable)?;
        Ok(())
    }

    /// [`survey`](crate::survey()) of the recording.
    ///
    /// # Errors
    /// [`LogError::Shape`], and what is wrong with the rows; their lines are counted as in the log that
    /// [`write_csv`](Recording::write_csv) writes.
    pub fn survey(&self) -> Result<Survey, LogError> {
        self.check()?;
        let (survey, _) = survey_rows(&mut || Ok(RecordingRows::new(self)), &self.joints, &mut |_, _| {})?;
        Ok(survey)
    }

    /// All blocks of the recording: those that [`stream`](crate::stream()) would give for its file.
    ///
    /// # Errors
    /// Those of [`survey`](Recording::survey); [`LogError::Cutoff`], [`LogError::NoLongSegment`].
    pub fn blocks(&self, conditioning: &Conditioning) -> Result<Vec<Block>, LogError> {
        let survey = self.survey()?;
        let mut blocks = Vec::new();
        let mut sink = |block| {
            blocks.push(block);
            ControlFlow::Continue(())
        };
        stream_rows(&mut RecordingRows::new(self), &survey, conditioning, &mut |_, _| {}, &mut sink)?;
        Ok(blocks)
    }

    fn columns(&self) -> LogColumns {
        LogColumns {
            torque: !self.tau.is_empty(),
            velocity: self.qd.is_some(),
            acceleration: self.qdd.is_some(),
            temperature: self.temp.is_some(),
            ..LogColumns::default()
        }
    }

    /// The signals that there are, in the order of [`LogWriter::write`].
    fn signals(&self) -> [(&'static str, Option<&[f64]>); 5] {
        [
            ("q", Some(&self.q)),
            ("tau", Some(self.tau.as_slice()).filter(|tau| !tau.is_empty())),
            ("qd", self.qd.as_deref()),
            ("qdd", self.qdd.as_deref()),
            ("temp", self.temp.as_deref()),
        ]
    }

    fn check(&self) -> Result<(), LogError> {
        let (rows, joints) = (self.t.len(), self.joints.len());
        for (array, signal) in self.signals() {
            let found = signal.map_or(rows * joints, <[f64]>::len);
            if found != rows * joints {
                return Err(LogError::Shape { array, rows, joints, found });
            }
        }
        Ok(())
    }

    fn write_rows<W: Write>(&self, writer: &mut LogWriter<W>) -> std::io::Result<()> {
        let n = self.joints.len();
        let signals: Vec<&[f64]> = self.signals().into_iter().filter_map(|(_, signal)| signal).collect();
        let mut row = Vec::with_capacity(signals.len());
        for (k, &t) in self.t.iter().enumerate() {
            row.clear();
            row.extend(signals.iter().map(|signal| &signal[k * n..(k + 1) * n]));
            writer.write(t, &row)?;
        }
        Ok(())
    }
}

/// The rows of a recording, as if they were read from a file.
pub(crate) struct RecordingRows<'a> {
    recording: &'a Recording,
    layout: Layout,
    next: usize,
}

impl<'a> RecordingRows<'a> {
    pub fn new(recording: &'a Recording) -> Self {
        let n = recording.joints.len();
        let has = |signal: Optional, joint: usize| {
            let values = match signal {
                Optional::Velocity => &recording.qd,
                Optional::Acceleration => &recording.qdd,
                Optional::Temperature => &recording.temp,
            };
            // A joint that never has a value does not have the signal.
            values.as_ref().is_some_and(|values| values.iter().skip(joint).step_by(n).any(|x| !x.is_nan()))
        };
        RecordingRows { recording, layout: Layout::new(n, !recording.tau.is_empty(), has), next: 0 }
    }
}

impl Rows for RecordingRows<'_> {
    fn layout(&self) -> &Layout {
        &self.layout
    }

    fn next(&mut self, values: &mut [f64]) -> Result<Row, LogError> {
        let (recording, row, n) = (self.recording, self.next, self.recording.joints.len());
        if row == recording.len() {
            return Ok(Row::End);
        }
        self.next += 1;
        values[0] = recording.t[row];
        values[1..1 + n].copy_from_slice(&recording.q[row * n..][..n]);
        if self.layout.torque {
            values[1 + n..1 + 2 * n].copy_from_slice(&recording.tau[row * n..][..n]);
        }
        let optional = [
            (&recording.qd, &self.layout.qd),
            (&recording.qdd, &self.layout.qdd),
            (&recording.temp, &self.layout.temp),
        ];
        for (signal, places) in optional {
            let Some(signal) = signal else { continue };
            for (joint, place) in places.iter().enumerate() {
                if let Some(place) = *place {
                    values[place] = signal[row * n + joint];
                }
            }
        }
        let line = row as u64 + 2;
        let needed = values.iter().enumerate().filter(|(place, _)| !self.layout.may_be_missing(*place));
        Ok(match needed.filter_map(|(_, &value)| unusable(value)).next() {
            None => Row::Sample { line },
            Some(reason) => Row::Gap { line, reason, t: Some(values[0]).filter(|t| unusable(*t).is_none()) },
        })
    }

    fn progress(&self) -> (u64, u64) {
        (self.next as u64, self.recording.len() as u64)
    }

    fn path(&self) -> &Path {
        Path::new("recording")
    }
}
