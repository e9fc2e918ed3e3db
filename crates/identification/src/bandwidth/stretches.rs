//! The training motion that cut-offs are compared on, in memory, to be filtered with any of them.

use crate::{BlockSource, Fold, IdentificationError, LogSet, Progress};
use phiw_telemetry::filter::ParallelFilter;
use phiw_telemetry::{Block, LogError, Survey};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Blocks of the training logs that touch the folds.
pub struct Stretches {
    folds: Vec<Fold>,
    /// For each log its sample period \[s\] and its blocks.
    logs: Vec<(f64, Vec<Block>)>,
}

impl Stretches {
    /// Reads training logs once. `lowest_hz` is the lowest cut-off that the blocks will be filtered with.
    pub fn read(
        folds: Vec<Fold>,
        surveys: &[Survey],
        logs: &LogSet,
        lowest_hz: f64,
        progress: Progress<'_>,
    ) -> Result<Self, IdentificationError> {
        let mut conditioning = logs.conditioning().clone();
        conditioning.parallel_cutoff_hz = lowest_hz;
        conditioning.options.parallel_cutoff_hz = Some(lowest_hz);
        let read = |survey: &Survey| {
            let source = logs.source_conditioned(survey.session.log, &conditioning, progress);
            let mut blocks = Vec::new();
            source.blocks(&mut |block| {
                let (Some(&first), Some(&last)) = (block.t.first(), block.t.last()) else { return };
                let touched = |fold: &Fold| fold.log == block.log && fold.start <= last && first < fold.end;
                if folds.iter().any(touched) {
                    blocks.push(block);
                }
            })?;
            Ok((survey.period, blocks))
        };
        let logs = surveys.iter().map(read).collect::<Result<_, IdentificationError>>()?;
        Ok(Stretches { folds, logs })
    }

    /// The stretches of time.
    pub fn folds(&self) -> &[Fold] {
        &self.folds
    }

    /// The logs with the parallel filter at `cutoff_hz`.
    pub fn at(&self, cutoff_hz: f64) -> Vec<Filtered<'_>> {
        let filter = |period: f64| Arc::new(ParallelFilter::new(cutoff_hz, period, None));
        self.logs.iter().map(|(period, blocks)| Filtered { blocks, filter: filter(*period) }).collect()
    }
}

/// Blocks with another filter.
pub struct Filtered<'a> {
    blocks: &'a [Block],
    filter: Arc<ParallelFilter>,
}

impl BlockSource for Filtered<'_> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        // A sink that stops early is not an error.
        let _ = self.blocks.iter().map(|block| block.with_filter(&self.filter)).try_for_each(sink);
        Ok(())
    }
}
