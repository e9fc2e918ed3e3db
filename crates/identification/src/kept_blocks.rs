//! Short logs are kept in memory between passes, long ones are read again, so memory is bounded.

use crate::{BlockSource, IdentificationError};
use phiw_telemetry::{Block, LogError};
use std::ops::ControlFlow;

/// Conditioned blocks of a source, kept if they are few.
pub struct KeptBlocks<'a> {
    source: &'a dyn BlockSource,
    kept: Option<Vec<Block>>,
}

impl<'a> KeptBlocks<'a> {
    /// Keeps the sources' blocks as long as they fit into `budget` bytes together; those that do not are read
    /// again at every pass.
    ///
    /// # Errors
    /// A log cannot be read.
    pub fn keep(sources: &[&'a dyn BlockSource], budget: usize) -> Result<Vec<Self>, IdentificationError> {
        Self::keep_parts(sources, budget, |block| vec![block])
    }

    /// The same for `parts` of each block: only they come again where they fit.
    ///
    /// # Errors
    /// A log cannot be read.
    pub fn keep_parts(
        sources: &[&'a dyn BlockSource],
        mut budget: usize,
        parts: impl Fn(Block) -> Vec<Block>,
    ) -> Result<Vec<Self>, IdentificationError> {
        let mut all = Vec::with_capacity(sources.len());
        for &source in sources {
            let mut kept = Some(Vec::new());
            let mut used = 0;
            source.blocks(&mut |block| {
                let parts = parts(block);
                used += parts.iter().map(size).sum::<usize>();
                match &mut kept {
                    Some(blocks) if used <= budget => blocks.extend(parts),
                    _ => kept = None,
                }
            })?;
            if kept.is_some() {
                budget -= used;
            }
            all.push(KeptBlocks { source, kept });
        }
        Ok(all)
    }
}

fn size(block: &Block) -> usize {
    let temperatures = block.temp.as_ref().map_or(0, Vec::len);
    let numbers = block.t.len() + 3 * block.q.len() + block.tau.len() + temperatures + block.outputs.len();
    numbers * size_of::<f64>()
}

impl BlockSource for KeptBlocks<'_> {
    fn stream(&self, sink: &mut dyn FnMut(Block) -> ControlFlow<()>) -> Result<(), LogError> {
        match &self.kept {
            Some(blocks) => blocks.stream(sink),
            None => self.source.stream(sink),
        }
    }
}
