//! A log of a session as a source of blocks, and what calls work on it off.

use crate::BlockSource;
use crate::known_payload::KnownPayload;
use phiw_telemetry::{Block, Conditioning, LogError, Survey};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Reports how far a pass over the logs is: what is being done, bytes done, bytes in total.
pub type Progress<'a> = &'a (dyn Fn(&str, u64, u64) + Sync);

/// Calls work off: the next block of a log is then [`LogError::Interrupted`]. Clones are one.
#[derive(Clone, Debug, Default)]
pub struct Interruption(Arc<AtomicBool>);

impl Interruption {
    /// Has the work end.
    pub fn call_off(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the work is called off.
    pub fn is_called_off(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// # Errors
    /// [`LogError::Interrupted`].
    pub fn check(&self) -> Result<(), LogError> {
        if self.is_called_off() { Err(LogError::Interrupted) } else { Ok(()) }
    }
}

/// A log of a session, which is read again for every pass.
pub struct LogFile<'a> {
    pub(crate) survey: &'a Survey,
    pub(crate) conditioning: &'a Conditioning,
    pub(crate) payload: Option<&'a KnownPayload>,
    /// What its torques are off by, joint by joint \[N·m, N\]; empty where nothing is known.
    pub(crate) torque_zeros: &'a [f64],
    pub(crate) interruption: &'a Interruption,
    pub(crate) progress: Progress<'a>,
}

impl BlockSource for LogFile<'_> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        let LogFile { survey, conditioning, payload, torque_zeros, interruption, progress } = *self;
        let what = reading("reading", &survey.path);
        let mut report = |done: u64, total: u64| progress(&what, done, total);
        interruption.check()?;
        let mut goes_on = Ok(());
        let mut sink = |mut block: Block| {
            for row in block.tau.chunks_exact_mut(block.joints.max(1)) {
                row.iter_mut().zip(torque_zeros).for_each(|(torque, zero)| *torque -= zero);
            }
            goes_on = interruption.check();
            if goes_on.is_ok() { sink(block) } else { ControlFlow::Break(()) }
        };
        let Some(payload) = payload else {
            phiw_telemetry::stream(survey, conditioning, &mut report, &mut sink)?;
            return goes_on;
        };
        let (mut workspace, mut wrong) = (payload.workspace(), None);
        let mut without = |block: Block| match payload.taken_off(block, &mut workspace) {
            Ok(block) => sink(block),
            Err(error) => {
                wrong = Some(error);
                ControlFlow::Break(())
            }
        };
        phiw_telemetry::stream(survey, conditioning, &mut report, &mut without)?;
        goes_on?;
        match (wrong, &survey.source.map) {
            (Some(error), Some(map)) => Err(map.payload_error(error.to_string()).into()),
            _ => Ok(()),
        }
    }

    fn goes_on(&self) -> Result<(), LogError> {
        self.interruption.check()
    }
}

/// What is being done with a log, in words.
pub(crate) fn reading(what: &str, path: &Path) -> String {
    format!("{what} {}", path.file_name().unwrap_or(path.as_os_str()).to_string_lossy())
}
