//! The filtered rows of a design as they are: where the same columns are asked for again and again, they need
//! to be evaluated once.

use crate::block_source::try_for_each_batch;
use crate::design::DesignScratch;
use crate::rests::moves;
use crate::{BlockSource, Design, IdentificationError};
use phiw_dynamics::DimensionError;
use phiw_telemetry::Block;
use phiw_telemetry::filter::FilterScratch;
use rayon::prelude::*;

/// The filtered rows of one block.
pub struct FilteredRows {
    /// Which log of the session.
    pub log: usize,
    /// The moment of each row \[s\], in the log's own time.
    pub t: Vec<f64>,
    /// Column by column: each number of an evaluation in all rows.
    values: Vec<f64>,
    /// The column of the first torque's share of time in which its joint moves; the others' follow.
    first_share: usize,
}

impl FilteredRows {
    /// For each row whether it counts for the torque `torque` ([`Design::counts`]).
    pub fn counts(&self, torque: usize) -> impl Iterator<Item = bool> + '_ {
        self.column(self.first_share + torque).iter().map(|share| moves(*share))
    }

    /// One number of an evaluation ([`DesignScratch::evaluate`]) in all rows.
    pub fn column(&self, place: usize) -> &[f64] {
        &self.values[place * self.t.len()..(place + 1) * self.t.len()]
    }
}

/// What `map` makes of the filtered rows of each block, in the order of the blocks; it also gets the block's
/// place among all. Blocks are evaluated in parallel, a few at a time.
///
/// # Errors
/// A log cannot be read, or a block has not the robot's joints.
pub fn map_filtered_rows<T: Send>(
    design: &Design,
    sources: &[&dyn BlockSource],
    map: impl Fn(usize, FilteredRows) -> T + Sync,
) -> Result<Vec<T>, IdentificationError> {
    let mut mapped = Vec::new();
    try_for_each_batch(sources, |batch| {
        let first = mapped.len();
        let of_batch: Result<Vec<T>, DimensionError> = batch
            .into_par_iter()
            .enumerate()
            .map_init(
                || (design.scratch(), FilterScratch::default()),
                |(scratch, filter), (place, block)| {
                    Ok(map(first + place, of_block(design, scratch, filter, block)?))
                },
            )
            .collect();
        mapped.extend(of_batch?);
        Ok::<(), IdentificationError>(())
    })?;
    Ok(mapped)
}

fn of_block(
    design: &Design,
    scratch: &mut DesignScratch<'_>,
    filter: &mut FilterScratch,
    mut block: Block,
) -> Result<FilteredRows, DimensionError> {
    design.correct(&mut block);
    scratch.begin(&block)?;
    let width = design.evaluation_width();
    let rows = block.outputs.len();
    let mut filtered = FilteredRows {
        log: block.log,
        t: Vec::with_capacity(rows),
        values: vec![0.0; width * rows],
        first_share: design.width(),
    };
    block.try_filter(
        width,
        filter,
        |sample, row| scratch.evaluate(&block, sample, row),
        |_, t, row| {
            let at = filtered.t.len();
            filtered.t.push(t);
            row.iter().enumerate().for_each(|(place, value)| filtered.values[place * rows + at] = *value);
            Ok(())
        },
    )?;
    Ok(filtered)
}
