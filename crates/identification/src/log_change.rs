//! Whether the training logs are of one robot.

use crate::accumulate::Fold;
use crate::fit::{Fit, fit};
use crate::{Design, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::{Factor, leave_one_out};
use phiw_regressor::least_squares::GroupedFactor;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// A torque that a log by itself tells otherwise than all training logs together.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogChange {
    /// The log.
    pub log: usize,
    /// The torque.
    pub row: usize,
    /// What the model of all logs leaves of this one, over what a model of this one alone leaves of its parts
    /// that are left out of the fit (RMS).
    pub ratio: f64,
}

/// From which ratio on a log is not of the robot of all.
///
/// Of 55 development cases of `cargo xtask undeclared`, right models and such as lack something, each through
/// `phiw identify`, none is above 1.8; of the two logs of an industrial arm none above 1.1. Tools of half the
/// mass of the last link in one of two logs give 2.7 to 20, of a tenth of it 1.1 to 13.
const LEAST_RATIO: f64 = 2.0;

/// Weight of all logs' rows in the model of one log (of its squares): what the log by itself hardly tells
/// stays as all tell it.
const WEIGHT_OF_ALL: f64 = 0.01;

/// The torques that some training log tells otherwise than all of them together: the logs are of robots that
/// differ, by a tool or a repair, or the model lacks what one of them shows. The largest ratio first; none
/// where there is one log, and of logs of one fold.
///
/// # Errors
/// The factors are not of the fitted design.
pub fn log_changes(
    common: &Fit,
    train: &[Fold],
    folds: &[GroupedFactor],
) -> Result<Vec<LogChange>, IdentificationError> {
    let mut logs: Vec<usize> = train.iter().map(|fold| fold.log).collect();
    logs.dedup();
    if logs.len() < 2 {
        return Ok(Vec::new());
    }
    let determined = common.determined();
    let weights: Vec<f64> = common.residual_std.iter().map(|std| 1.0 / std).collect();
    let all = common.factor.scaled(WEIGHT_OF_ALL.sqrt());
    let mut changes = Vec::new();
    for log in logs {
        let own = train.iter().zip(folds).filter(|(of, _)| of.log == log);
        let own: Vec<GroupedFactor> =
            own.map(|(_, fold)| fold.select(&determined)).collect::<Result<_, RegressorError>>()?;
        let weighted: Vec<Factor> =
            own.par_iter().map(|fold| fold.combine(&weights)).collect::<Result<_, RegressorError>>()?;
        if own.len() < 2 {
            continue;
        }
        let of_all: Vec<f64> = determined.iter().map(|&parameter| common.parameters[parameter]).collect();
        let left_of = |(fold, others): (&GroupedFactor, Factor)| {
            let alone = match others.merge(&all)?.solve() {
                Ok(solution) => solution.parameters,
                // Beside what the log tells of other parameters, what all logs tell of one is lost in
                // rounding.
                Err(RegressorError::RankDeficient { .. }) => of_all.clone(),
                Err(error) => return Err(error),
            };
            Ok((fold.residual_sums_of_squares(&of_all)?, fold.residual_sums_of_squares(&alone)?))
        };
        let of_folds = own.par_iter().zip(leave_one_out(&weighted)?).map(left_of);
        let mut squares = vec![(0.0, 0.0); weights.len()];
        for (left, left_alone) in of_folds.collect::<Result<Vec<_>, RegressorError>>()? {
            squares.iter_mut().zip(left.iter().zip(&left_alone)).for_each(|(sums, (all, alone))| {
                sums.0 += all;
                sums.1 += alone;
            });
        }
        let ratios = squares.iter().map(|(all, alone)| (all / alone).sqrt());
        let of_log = ratios.enumerate().filter(|(_, ratio)| *ratio > LEAST_RATIO);
        changes.extend(of_log.map(|(row, ratio)| LogChange { log, row, ratio }));
    }
    changes.sort_by(|a, b| b.ratio.total_cmp(&a.ratio));
    Ok(changes)
}

/// The training log that is not of the robot of all others: with it the logs are not of one robot, without it
/// they are, and that is so of no other log. None where there are fewer than three logs: of two that differ
/// nobody knows which is the robot's. `common` is the fit to all.
///
/// # Errors
/// The factors are not of the fitted design.
pub fn odd_log(
    design: &Design,
    common: &Fit,
    train: &[Fold],
    folds: &[GroupedFactor],
) -> Result<Option<usize>, IdentificationError> {
    let logs: BTreeSet<usize> = train.iter().map(|fold| fold.log).collect();
    if logs.len() < 3 {
        return Ok(None);
    }
    let differing = log_changes(common, train, folds)?;
    let differing: BTreeSet<usize> = differing.iter().map(|change| change.log).collect();
    let mut odd = Vec::new();
    for log in differing {
        let others = train.iter().zip(folds).filter(|(fold, _)| fold.log != log);
        let (train, folds): (Vec<Fold>, Vec<GroupedFactor>) =
            others.map(|(fold, factor)| (*fold, factor.clone())).unzip();
        // What the others do not tell without it may be the robot's.
        let Ok(of_others) = fit(design, &folds) else { continue };
        if log_changes(&of_others, &train, &folds)?.is_empty() {
            odd.push(log);
        }
    }
    Ok(if let [only] = odd[..] { Some(only) } else { None })
}
