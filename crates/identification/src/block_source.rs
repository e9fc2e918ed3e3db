//! Where blocks of conditioned samples come from.

use phiw_telemetry::{Block, LogError};
use std::ops::ControlFlow;

/// Where blocks come from: a log on disk, a recording in memory, a simulator. Each call brings the same
/// blocks again.
pub trait BlockSource: Sync {
    /// Hands the blocks to `sink`, in order, until it breaks.
    ///
    /// # Errors
    /// The log cannot be read.
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError>;

    /// Whether whoever asked for the work still wants it.
    ///
    /// # Errors
    /// [`LogError::Interrupted`].
    fn goes_on(&self) -> Result<(), LogError> {
        Ok(())
    }

    /// Hands every block to `sink`, in order.
    ///
    /// # Errors
    /// The log cannot be read.
    fn blocks(&self, sink: &mut dyn FnMut(Block)) -> Result<(), LogError> {
        self.stream(&mut |block| {
            sink(block);
            ControlFlow::Continue(())
        })
    }
}

/// Blocks in memory, such as those of a [`Recording`](phiw_telemetry::Recording::blocks).
impl BlockSource for Vec<Block> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        // A sink that stops early is not an error.
        let _ = self.iter().cloned().try_for_each(sink);
        Ok(())
    }
}

/// Every `n`-th block of a source: an even sample of a long log.
pub struct EveryNth<'a> {
    /// Where the blocks come from.
    pub source: &'a dyn BlockSource,
    /// One of so many is handed on, at least one.
    pub n: usize,
}

impl BlockSource for EveryNth<'_> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        let mut count = 0;
        self.source.stream(&mut |block| {
            let is_its_turn = count % self.n.max(1) == 0;
            count += 1;
            if is_its_turn { sink(block) } else { ControlFlow::Continue(()) }
        })
    }
}

/// Hands the blocks of all sources to `take`, in order, up to the first that it fails on.
///
/// # Errors
/// A log cannot be read; what `take` returns.
pub fn try_for_each_block<E: From<LogError>>(
    sources: &[&dyn BlockSource],
    mut take: impl FnMut(Block) -> Result<(), E>,
) -> Result<(), E> {
    for source in sources {
        let mut taken = Ok(());
        source.stream(&mut |block| {
            taken = take(block);
            if taken.is_ok() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        })?;
        taken?;
    }
    Ok(())
}

/// Blocks that wait for the processors; more would cost memory only.
const BLOCKS_PER_THREAD: usize = 2;

/// The same, but so many blocks at a time as the processors can work on, whatever source they come from: a
/// short log is one block.
///
/// # Errors
/// A log cannot be read; what `take` returns.
pub fn try_for_each_batch<E: From<LogError>>(
    sources: &[&dyn BlockSource],
    mut take: impl FnMut(Vec<Block>) -> Result<(), E>,
) -> Result<(), E> {
    let size = BLOCKS_PER_THREAD * rayon::current_num_threads();
    let mut batch = Vec::with_capacity(size);
    try_for_each_block(sources, |block| {
        batch.push(block);
        if batch.len() == size { take(std::mem::take(&mut batch)) } else { Ok(()) }
    })?;
    take(batch)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::IdentificationError;

    fn blocks(count: usize) -> Vec<Block> {
        (0..count)
            .map(|index| {
                Block::unfiltered(1, vec![index as f64], [vec![0.0], vec![0.0], vec![0.0]], vec![0.0])
            })
            .collect()
    }

    /// Each pass kept an error aside and read the log to its end.
    #[test]
    fn no_block_is_read_after_the_first_that_fails() {
        let (one, other) = (blocks(3), blocks(5));
        let mut seen = 0;
        let outcome = try_for_each_block(&[&one, &other], |block| {
            seen += 1;
            if seen == 5 { Err(IdentificationError::Model(block.t[0].to_string())) } else { Ok(()) }
        });
        // The second of the second source, which begins at 0 again.
        assert_eq!(outcome.unwrap_err().to_string(), "1");
        assert_eq!(seen, 5);
    }

    #[test]
    fn batches_hold_every_block_once_and_in_order() {
        let source = blocks(3 * BLOCKS_PER_THREAD * rayon::current_num_threads() + 1);
        let mut seen = Vec::new();
        try_for_each_batch(&[&source, &source], |batch| {
            seen.extend(batch.iter().map(|block| block.t[0]));
            Ok::<(), LogError>(())
        })
        .unwrap();
        let expected: Vec<f64> = source.iter().chain(&source).map(|block| block.t[0]).collect();
        assert_eq!(seen, expected);
    }
}
