//! Blocks of conditioned samples into factors, one for each torque and fold, in parallel and in constant
//! memory.

use crate::block_source::try_for_each_batch;
use crate::{BlockSource, Design, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::{Group, GroupedFactor};
use phiw_telemetry::Block;
use phiw_telemetry::filter::FilterScratch;
use rayon::prelude::*;

/// A stretch of time of one log whose rows are kept apart: to be left out, or held out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fold {
    /// Which log of the session.
    pub log: usize,
    /// Its first moment \[s\], in the log's own time.
    pub start: f64,
    /// Its end \[s\], not included.
    pub end: f64,
}

impl Fold {
    /// Whether it holds the moment `t` \[s\] of a log.
    pub fn contains(&self, log: usize, t: f64) -> bool {
        self.log == log && self.start <= t && t < self.end
    }
}

/// The factors of `design` over each fold: \[Φ f\] of each torque, after the parallel filter.
///
/// Every block is reduced by itself and the results are merged in the order of the blocks, so the outcome
/// does not depend on the number of threads. A fold that is named several times (a bootstrap draw) is read
/// once and comes out as often as it is named.
///
/// # Errors
/// A log cannot be read, or a block has not the robot's joints.
pub fn accumulate(
    design: &Design,
    folds: &[Fold],
    sources: &[&dyn BlockSource],
) -> Result<Vec<GroupedFactor>, IdentificationError> {
    Ok(accumulate_folds(design, folds, sources, Rests::Dropped)?.moving)
}

/// The factors of some folds.
#[derive(Clone, Debug, Default)]
pub struct FoldFactors {
    /// For each fold the rows that count: of each torque those in which its joint moves.
    pub moving: Vec<GroupedFactor>,
    /// For each fold the others, in which the joint rests; empty where they were not asked for. No fit takes
    /// them; they say what the error is with rests included.
    pub at_rest: Vec<GroupedFactor>,
}

impl FoldFactors {
    /// All restricted to `kept` parameters (see [`GroupedFactor::select`]).
    ///
    /// # Errors
    /// A parameter does not exist.
    pub fn select(&self, kept: &[usize]) -> Result<Self, RegressorError> {
        let select = |folds: &[GroupedFactor]| folds.par_iter().map(|fold| fold.select(kept)).collect();
        let (moving, at_rest): (Result<_, _>, Result<_, _>) = (select(&self.moving), select(&self.at_rest));
        Ok(FoldFactors { moving: moving?, at_rest: at_rest? })
    }
}

/// What becomes of rows at which a joint rests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rests {
    /// They are left out.
    Dropped,
    /// They have factors of their own.
    Kept,
}

/// [`accumulate`] with the rows that do not count beside those that do.
///
/// # Errors
/// The same.
pub fn accumulate_folds(
    design: &Design,
    folds: &[Fold],
    sources: &[&dyn BlockSource],
    rests: Rests,
) -> Result<FoldFactors, IdentificationError> {
    let named = folds;
    let mut folds: Vec<Fold> = Vec::with_capacity(named.len());
    named.iter().for_each(|fold| {
        if !folds.contains(fold) {
            folds.push(*fold);
        }
    });
    let torques = design.rows().len();
    let kinds = if rests == Rests::Kept { 2 } else { 1 };
    let mut merged: Vec<Vec<Option<Factor>>> = vec![vec![None; kinds * torques]; folds.len()];
    try_for_each_batch(sources, |batch| reduce(design, rests, &folds, batch, &mut merged))?;
    let mut read = FoldFactors::default();
    for mut moving in merged {
        let at_rest = moving.split_off(torques);
        read.moving.push(grouped(design, moving)?);
        if rests == Rests::Kept {
            read.at_rest.push(grouped(design, at_rest)?);
        }
    }
    let places: Vec<usize> =
        named.iter().filter_map(|fold| folds.iter().position(|other| other == fold)).collect();
    let named = |read: Vec<GroupedFactor>| match read.is_empty() {
        true => read,
        false => places.iter().map(|&place| read[place].clone()).collect(),
    };
    // Mostly each fold is named once: then nothing is copied.
    match places.iter().copied().eq(0..folds.len()) {
        true => Ok(read),
        false => Ok(FoldFactors { moving: named(read.moving), at_rest: named(read.at_rest) }),
    }
}

/// One factor for each torque; none where there were no rows.
fn grouped(design: &Design, factors: Vec<Option<Factor>>) -> Result<GroupedFactor, RegressorError> {
    let groups = factors.into_iter().zip(design.rows()).map(|(factor, layout)| Group {
        factor: factor.unwrap_or_else(|| Factor::empty(layout.range.len())),
        parameters: layout.parameters.clone(),
    });
    GroupedFactor::new(design.parameter_count(), groups.collect())
}

fn reduce(
    design: &Design,
    rests: Rests,
    folds: &[Fold],
    batch: Vec<Block>,
    merged: &mut [Vec<Option<Factor>>],
) -> Result<(), IdentificationError> {
    let reduced: Result<Vec<Vec<Piece>>, RegressorError> = batch
        .into_par_iter()
        .map_init(|| Worker::new(design, rests), |worker, block| worker.reduce(folds, block))
        .collect();
    for piece in reduced?.into_iter().flatten() {
        let targets = merged[piece.fold].par_iter_mut().zip(piece.factors);
        targets.try_for_each(|(target, factor)| {
            *target = Some(match target.take() {
                Some(before) => before.merge(&factor)?,
                None => factor,
            });
            Ok::<(), RegressorError>(())
        })?;
    }
    Ok(())
}

/// What one block adds to one fold: a factor for each torque, then one for its rows at rest where they are
/// kept.
struct Piece {
    fold: usize,
    factors: Vec<Factor>,
}

struct Worker<'a> {
    design: &'a Design,
    scratch: crate::design::DesignScratch<'a>,
    filter: FilterScratch,
    builders: Vec<FactorBuilder>,
}

impl<'a> Worker<'a> {
    fn new(design: &'a Design, rests: Rests) -> Self {
        let widths = design.rows().iter().map(|layout| layout.range.len());
        let at_rest = widths.clone().filter(|_| rests == Rests::Kept);
        Worker {
            design,
            scratch: design.scratch(),
            filter: FilterScratch::default(),
            builders: widths.chain(at_rest).map(FactorBuilder::new).collect(),
        }
    }

    fn reduce(&mut self, folds: &[Fold], mut block: Block) -> Result<Vec<Piece>, RegressorError> {
        self.design.correct(&mut block);
        self.scratch.begin(&block)?;
        let design = self.design;
        let (scratch, builders, rows) = (&mut self.scratch, &mut self.builders, design.rows());
        let mut pieces = Vec::new();
        let mut current = None;
        block.try_filter(
            self.design.evaluation_width(),
            &mut self.filter,
            |sample, row| Ok(scratch.evaluate(&block, sample, row)?),
            |_, t, row| {
                let fold = folds.iter().position(|fold| fold.contains(block.log, t));
                if fold != current {
                    finish(current, builders, &mut pieces);
                    current = fold;
                }
                if fold.is_some() {
                    for (joint, layout) in rows.iter().enumerate() {
                        let place = if design.counts(row, joint) { joint } else { rows.len() + joint };
                        if let Some(builder) = builders.get_mut(place) {
                            builder.push_row(&row[layout.range.clone()])?;
                        }
                    }
                }
                Ok::<(), RegressorError>(())
            },
        )?;
        finish(current, builders, &mut pieces);
        Ok(pieces)
    }
}

fn finish(fold: Option<usize>, builders: &mut [FactorBuilder], pieces: &mut Vec<Piece>) {
    let Some(fold) = fold else { return };
    let factors = builders.iter_mut().map(FactorBuilder::factor).collect();
    builders.iter_mut().for_each(FactorBuilder::clear);
    pieces.push(Piece { fold, factors });
}
