//! The logs of a session: which train, which are held out, and how they are conditioned.

use crate::checks::{check_excitation, check_logs};
use crate::known_payload::KnownPayload;
use crate::log_file::{Interruption, LogFile, Progress, reading};
use crate::{Fold, IdentificationError};
use phiw_dynamics::Tree;
use phiw_telemetry::{Conditioning, ConditioningOptions, LogError, LogSource, Survey, TorqueColumns};
use rayon::prelude::*;
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Stretches of time that the training logs are cut into: long against the residual's correlation, enough for
/// a standard deviation.
const TRAINING_FOLDS: usize = 10;
const HELD_OUT_FOLDS: usize = 8;
/// Speed of a joint at rest over its RMS speed.
const REST_SHARE: f64 = 0.01;

/// Logs, surveyed and with their conditioning chosen.
pub struct LogSet {
    surveys: Vec<Survey>,
    train: usize,
    conditioning: Conditioning,
    /// What the robot held in each log.
    payloads: Vec<Option<KnownPayload>>,
    /// What the torques of each log are off by, joint by joint \[N·m, N\]; empty where nothing is known.
    torque_zeros: Vec<Vec<f64>>,
    interruption: Interruption,
}

impl LogSet {
    /// Share of each training log that is held out when no log is given for validation.
    pub const HELD_OUT_SHARE: f64 = 0.3;

    /// Surveys the logs, checks them against the robot, and chooses from the training logs how to condition
    /// all of them.
    ///
    /// # Errors
    /// A log that cannot be read or does not fit the robot, or a joint that moves in none.
    pub fn open<S: Clone + Into<LogSource>>(
        tree: &Tree,
        train: &[S],
        validate: &[S],
        options: &ConditioningOptions,
        progress: Progress<'_>,
    ) -> Result<Self, IdentificationError> {
        let logs = Self::open_unexcited(tree, train, validate, options, progress)?;
        check_excitation(tree, logs.training())?;
        Ok(logs)
    }

    /// [`LogSet::open`] for a model that other knowledge completes: joints may stand still in all logs.
    ///
    /// # Errors
    /// A log that cannot be read or does not fit the robot.
    pub fn open_unexcited<S: Clone + Into<LogSource>>(
        tree: &Tree,
        train: &[S],
        validate: &[S],
        options: &ConditioningOptions,
        progress: Progress<'_>,
    ) -> Result<Self, IdentificationError> {
        let (logs, never) = ([sources(train), sources(validate)], Interruption::default());
        Self::surveyed(tree, logs, TorqueColumns::Required, options, never, progress)
    }

    /// The same of logs that a model is used on: they need no torques.
    ///
    /// # Errors
    /// A log that cannot be read or does not fit the robot.
    pub fn open_for_prediction<S: Clone + Into<LogSource>>(
        tree: &Tree,
        logs: &[S],
        options: &ConditioningOptions,
        progress: Progress<'_>,
    ) -> Result<Self, IdentificationError> {
        let (logs, never) = ([sources(logs), Vec::new()], Interruption::default());
        Self::surveyed(tree, logs, TorqueColumns::Optional, options, never, progress)
    }

    /// [`LogSet::open_unexcited`], or with optional torques [`LogSet::open_for_prediction`], of logs for
    /// training and for validation, which `interruption` can call off.
    ///
    /// # Errors
    /// A log that cannot be read or does not fit the robot; the work is called off.
    pub fn surveyed(
        tree: &Tree,
        [train, validate]: [Vec<LogSource>; 2],
        torque: TorqueColumns,
        options: &ConditioningOptions,
        interruption: Interruption,
        progress: Progress<'_>,
    ) -> Result<Self, IdentificationError> {
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let payloads = train.iter().chain(&validate).map(|source| KnownPayload::of(tree, source));
        let payloads = payloads.collect::<Result<Vec<_>, LogError>>()?;
        let logs: Vec<&LogSource> = train.iter().chain(&validate).collect();
        let what = match logs.as_slice() {
            [source] => reading("surveying", &source.path),
            logs => format!("surveying {} logs", logs.len()),
        };
        // Bytes of each log: done, and in all.
        let bytes: Vec<[AtomicU64; 2]> = logs.iter().map(|_| Default::default()).collect();
        let sum = |which: usize| bytes.iter().map(|log| log[which].load(Ordering::Relaxed)).sum();
        let survey = |(log, source): (usize, &&LogSource)| {
            let mut report = |done: u64, total: u64| {
                bytes[log][0].store(done, Ordering::Relaxed);
                bytes[log][1].store(total, Ordering::Relaxed);
                progress(&what, sum(0), sum(1));
            };
            interruption.check()?;
            phiw_telemetry::survey(*source, &joints, torque, &mut report)
        };
        // Each log by itself; of several errors the first log's is told.
        let surveys: Vec<Result<Survey, LogError>> = logs.par_iter().enumerate().map(survey).collect();
        let mut surveys = surveys.into_iter().collect::<Result<Vec<Survey>, LogError>>()?;
        phiw_telemetry::arrange_session(&mut surveys);
        let (training, held_out) = surveys.split_at(train.len());
        check_logs(tree, training, held_out)?;
        let conditioning = Conditioning::choose(training, options)?;
        // Cut-offs that were told must fit the logs held out, too.
        held_out.iter().try_for_each(|survey| conditioning.plan(survey).map(drop))?;
        let torque_zeros = vec![Vec::new(); surveys.len()];
        Ok(LogSet { train: train.len(), conditioning, surveys, payloads, torque_zeros, interruption })
    }

    /// Logs that were surveyed and conditioned before, the first `train` of them to fit; they are read as
    /// the surveys' sources say.
    ///
    /// # Errors
    /// A map names a payload that the robot cannot hold.
    pub fn of_surveys(
        tree: &Tree,
        surveys: Vec<Survey>,
        train: usize,
        conditioning: Conditioning,
    ) -> Result<Self, IdentificationError> {
        let payloads = surveys.iter().map(|survey| KnownPayload::of(tree, &survey.source));
        let payloads = payloads.collect::<Result<Vec<_>, LogError>>()?;
        let interruption = Interruption::default();
        let torque_zeros = vec![Vec::new(); surveys.len()];
        let train = train.min(surveys.len());
        Ok(LogSet { train, surveys, conditioning, payloads, torque_zeros, interruption })
    }

    /// Reads a log from another place from now on; its content must be the same.
    pub fn set_path(&mut self, log: usize, path: &Path) {
        if let Some(survey) = self.surveys.get_mut(log) {
            survey.path = path.to_owned();
            survey.source = survey.source.clone().moved_to(path);
        }
    }

    /// The same logs, each row of which goes out.
    pub fn with_every_row(&self) -> Self {
        let mut conditioning = self.conditioning.clone();
        conditioning.options.decimation = Some(1);
        LogSet {
            surveys: self.surveys.clone(),
            train: self.train,
            conditioning,
            payloads: self.payloads.clone(),
            torque_zeros: self.torque_zeros.clone(),
            interruption: self.interruption.clone(),
        }
    }

    /// All surveys: training logs, then those for validation.
    pub fn surveys(&self) -> &[Survey] {
        &self.surveys
    }
    /// The training logs' surveys.
    pub fn training(&self) -> &[Survey] {
        &self.surveys[..self.train]
    }
    /// How the logs are conditioned.
    pub fn conditioning(&self) -> &Conditioning {
        &self.conditioning
    }
    /// Conditions all logs with another cut-off of the parallel filter \[Hz\], one that the training logs
    /// told (see [`bandwidth`](crate::bandwidth)).
    pub fn set_parallel_cutoff(&mut self, cutoff_hz: f64) {
        self.conditioning.parallel_cutoff_hz = cutoff_hz;
    }
    /// Takes these zeros off the torques of a log from now on, joint by joint \[N·m, N\].
    pub fn set_torque_zeros(&mut self, log: usize, zeros: Vec<f64>) {
        if let Some(own) = self.torque_zeros.get_mut(log) {
            *own = zeros;
        }
    }
    /// What calls work on the logs off.
    pub fn interruption(&self) -> &Interruption {
        &self.interruption
    }
    /// Whether the end of each training log is held out, since no other log is given.
    pub fn splits_training_logs(&self) -> bool {
        self.train == self.surveys.len()
    }
    /// Logs given for training and for validation that have the same content.
    pub fn same_files(&self) -> Vec<(&Path, &Path)> {
        let (training, held_out) = self.surveys.split_at(self.train);
        let pairs = training.iter().flat_map(|a| held_out.iter().map(move |b| (a, b)));
        pairs
            .filter(|(a, b)| a.content_hash == b.content_hash)
            .map(|(a, b)| (a.path.as_path(), b.path.as_path()))
            .collect()
    }

    /// For each joint the speed below which it stands still: a hundredth of its RMS velocity in the training
    /// logs \[rad/s, m/s\].
    pub fn rest_speeds(&self) -> Vec<f64> {
        let joints = self.surveys.first().map_or(0, |survey| survey.joints.len());
        let rms = |joint: usize| {
            self.training().iter().map(|survey| survey.joints[joint].velocity_rms).fold(0.0, f64::max)
        };
        (0..joints).map(|joint| REST_SHARE * rms(joint)).collect()
    }

    /// Stretches of time to fit.
    pub fn training_folds(&self) -> Vec<Fold> {
        let share = if self.splits_training_logs() { 1.0 - Self::HELD_OUT_SHARE } else { 1.0 };
        cut(self.training().iter().enumerate().map(|(log, survey)| (log, survey, 0.0, share)), TRAINING_FOLDS)
    }

    /// Stretches of time to validate on.
    pub fn held_out_folds(&self) -> Vec<Fold> {
        if self.splits_training_logs() {
            let ends = self
                .training()
                .iter()
                .enumerate()
                .map(|(log, survey)| (log, survey, 1.0 - Self::HELD_OUT_SHARE, 1.0));
            cut(ends, HELD_OUT_FOLDS)
        } else {
            let logs = self.surveys.iter().enumerate().skip(self.train);
            cut(logs.map(|(log, survey)| (log, survey, 0.0, 1.0)), HELD_OUT_FOLDS)
        }
    }

    /// What is held out, in words: the logs for validation, or the ends of the training logs.
    pub fn held_out_in_words(&self) -> String {
        let names = |surveys: &[Survey]| {
            surveys.iter().map(|survey| survey.path.display().to_string()).collect::<Vec<_>>().join(", ")
        };
        match self.splits_training_logs() {
            true => {
                format!("the last {:.0} % of {}", 1e2 * Self::HELD_OUT_SHARE, names(self.training()))
            }
            false => names(&self.surveys[self.train..]),
        }
    }

    /// The logs as sources of blocks.
    pub fn sources<'a>(&'a self, progress: Progress<'a>) -> Vec<LogFile<'a>> {
        let source = |log| self.source_conditioned(log, &self.conditioning, progress);
        (0..self.surveys.len()).map(source).collect()
    }

    /// One log, conditioned in another way.
    pub(crate) fn source_conditioned<'a>(
        &'a self,
        log: usize,
        conditioning: &'a Conditioning,
        progress: Progress<'a>,
    ) -> LogFile<'a> {
        LogFile {
            survey: &self.surveys[log],
            conditioning,
            payload: self.payloads[log].as_ref(),
            torque_zeros: &self.torque_zeros[log],
            interruption: &self.interruption,
            progress,
        }
    }
}

fn sources<S: Clone + Into<LogSource>>(logs: &[S]) -> Vec<LogSource> {
    logs.iter().cloned().map(Into::into).collect()
}

/// Cuts a part of each log into stretches of about equal length, `count` or a few more in all.
fn cut<'a>(parts: impl Iterator<Item = (usize, &'a Survey, f64, f64)>, count: usize) -> Vec<Fold> {
    let spans: Vec<(usize, f64, f64)> = parts
        .map(|(log, survey, from, to)| {
            let (first, last) = survey.time_range();
            // A fold excludes its end, so the last fold of a log ends just after the last sample.
            let last_moment =
                if to >= 1.0 { last + 0.5 * survey.period } else { first + to * (last - first) };
            (log, first + from * (last - first), last_moment)
        })
        .collect();
    let total: f64 = spans.iter().map(|(_, start, end)| end - start).sum();
    let pieces = |start: f64, end: f64| ((count as f64 * (end - start) / total).round() as usize).max(1);
    let mut folds = Vec::new();
    for (log, start, end) in spans {
        let pieces = pieces(start, end);
        let edge = |piece: usize| start + (end - start) * piece as f64 / pieces as f64;
        folds.extend((0..pieces).map(|piece| Fold { log, start: edge(piece), end: edge(piece + 1) }));
    }
    folds
}
