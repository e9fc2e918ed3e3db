//! How a caller of the library hands over logs that are in memory, and calls work off.

use crate::BlockSource;
use phiw_telemetry::{Block, Conditioning, LogError, NamedColumns, Survey, TorqueColumns};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Reports how far a pass over the logs is: what is being done, bytes done, bytes in total.
pub type Progress<'a> = &'a (dyn Fn(&str, u64, u64) + Sync);

/// Where logs are, by the names that are given for them: in memory, or else in files. By itself it knows
/// files only, and lets all work go to its end.
#[derive(Clone, Debug, Default)]
pub struct LogAccess {
    in_memory: BTreeMap<PathBuf, Arc<NamedColumns>>,
    interrupted: Arc<AtomicBool>,
}

impl LogAccess {
    /// Has a log in memory stand for its name.
    pub fn insert(&mut self, log: NamedColumns) {
        self.in_memory.insert(log.name().to_owned(), Arc::new(log));
    }

    /// The log of this name, if it is in memory.
    pub fn in_memory(&self, name: &Path) -> Option<&NamedColumns> {
        self.in_memory.get(name).map(|log| log.as_ref())
    }

    /// What calls the work off when it is set: the next block of a log is then
    /// [`LogError::Interrupted`].
    pub fn interruption(&self) -> Arc<AtomicBool> {
        self.interrupted.clone()
    }

    /// # Errors
    /// [`LogError::Interrupted`].
    fn check(&self) -> Result<(), LogError> {
        if self.interrupted.load(Ordering::Relaxed) { Err(LogError::Interrupted) } else { Ok(()) }
    }

    /// [`survey`](phiw_telemetry::survey()) of a log, wherever it is.
    ///
    /// # Errors
    /// A log that cannot be used; the work is called off.
    pub fn survey(
        &self,
        name: &Path,
        joints: &[String],
        torque: TorqueColumns,
        progress: &mut dyn FnMut(u64, u64),
    ) -> Result<Survey, LogError> {
        self.check()?;
        let survey = match self.in_memory(name) {
            Some(log) => log.survey(joints, torque, progress)?,
            None => phiw_telemetry::survey(name, joints, torque, progress)?,
        };
        self.check()?;
        Ok(survey)
    }
}

/// A log of a session, which is read again for every pass.
pub struct LogFile<'a> {
    survey: &'a Survey,
    conditioning: &'a Conditioning,
    access: &'a LogAccess,
    progress: Progress<'a>,
}

impl<'a> LogFile<'a> {
    pub(crate) fn new(
        survey: &'a Survey,
        conditioning: &'a Conditioning,
        access: &'a LogAccess,
        progress: Progress<'a>,
    ) -> Self {
        LogFile { survey, conditioning, access, progress }
    }
}

impl BlockSource for LogFile<'_> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        let LogFile { survey, conditioning, access, progress } = *self;
        let what = reading("reading", &survey.path);
        let mut report = |done: u64, total: u64| progress(&what, done, total);
        let mut goes_on = access.check();
        goes_on.as_ref().map_err(|_| LogError::Interrupted)?;
        let mut sink = |block| {
            goes_on = access.check();
            if goes_on.is_ok() { sink(block) } else { ControlFlow::Break(()) }
        };
        match access.in_memory(&survey.path) {
            Some(log) => log.stream(survey, conditioning, &mut report, &mut sink)?,
            None => phiw_telemetry::stream(survey, conditioning, &mut report, &mut sink)?,
        };
        goes_on
    }

    fn goes_on(&self) -> Result<(), LogError> {
        self.access.check()
    }
}

pub(crate) fn reading(what: &str, path: &Path) -> String {
    format!("{what} {}", path.file_name().unwrap_or(path.as_os_str()).to_string_lossy())
}
