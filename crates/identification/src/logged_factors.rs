//! Factors of logged torques, put in force.
//!
//! A gain is fitted as a multiple of the torque of an earlier fit. Where it is far from one, or where the
//! logs hardly tell it, the step that this fit asks for may lead away: the torque of a last joint that mostly
//! rubs fits any factor nearly alike. So a step is taken if the factor is certain to be another, before it
//! and after, and if the torques are explained better with it in force; otherwise a shorter one.

use crate::accumulate::FoldFactors;
use crate::fit::{Fit, merge, solve_determined, undetermined};
use crate::{Design, IdentificationError};
use phiw_regressor::RegressorError;
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// Largest change of a factor that is believed to first order. What is fitted beyond it and could not be put
/// in force is left out.
pub(crate) const FIRST_ORDER: f64 = 0.5;
/// Times that factors are put in force, at most.
const PASSES: usize = 5;
/// Times that a step is halved, at most.
const HALVINGS: usize = 3;
/// What is left of a factor is exact enough to first order.
pub(crate) const LEAST_STEP: f64 = 1e-3;

/// A fitted design with the factors of its logged torques in force, and the folds' factors with its columns.
///
/// `read` makes the factors of a design's folds, of which those in `train` come first; `fit_again` fits a
/// design to these. Nothing is read where the design has no factor that is certain.
///
/// # Errors
/// Those of `read` and `fit_again`.
pub(crate) fn in_force(
    mut design: Design,
    mut fit: Fit,
    mut folds: FoldFactors,
    train: usize,
    read: impl Fn(&Design) -> Result<FoldFactors, IdentificationError>,
    fit_again: impl Fn(&Design, &[GroupedFactor]) -> Result<Fit, IdentificationError>,
) -> Result<(Design, Fit, FoldFactors), IdentificationError> {
    let factors = design.logged_factor_parameters();
    for _ in 0..PASSES {
        let certain: Vec<usize> =
            factors.iter().copied().filter(|&factor| is_certain(&fit, factor, 0.0)).collect();
        if certain.is_empty() {
            break;
        }
        let present = left(&folds.moving[..train], &factors)?;
        let mut share = 1.0;
        let mut better = None;
        for _ in 0..=HALVINGS {
            let mut step = fit.parameters.clone();
            for &factor in &factors {
                step[factor] *= if certain.contains(&factor) { share } else { 0.0 };
            }
            let Some((moved, parameters)) = design.with_factors_in_force(&step, LEAST_STEP)? else { break };
            // A factor at the limit of what there can be is none.
            let is_at_limit = |&factor: &usize| {
                let way = moved.factor_in_force(factor) - design.factor_in_force(factor);
                (way - step[factor]).abs() > LEAST_STEP
            };
            if certain.iter().any(is_at_limit) {
                share *= 0.5;
                continue;
            }
            let moved = moved.with_own_reference(&parameters)?;
            let moved_folds = read(&moved)?;
            if left(&moved_folds.moving[..train], &factors)? < present {
                let moved_fit = fit_again(&moved, &moved_folds.moving[..train])?;
                let in_force = |factor: usize| moved.factor_in_force(factor) - 1.0;
                if certain.iter().all(|&factor| is_certain(&moved_fit, factor, in_force(factor))) {
                    better = Some((moved, moved_fit, moved_folds));
                    break;
                }
            }
            share *= 0.5;
        }
        match better {
            Some(better) => (design, fit, folds) = better,
            None => break,
        }
    }
    Ok((design, fit, folds))
}

/// Whether the 95 % interval of a factor, of which `in_force` is in force, does not hold nothing.
fn is_certain(fit: &Fit, factor: usize, in_force: f64) -> bool {
    let [low, high] = fit.intervals_95[factor];
    in_force + low > 0.0 || in_force + high < 0.0
}

/// Σ rows·log σ of what is left of the torques with all factors as they are in force, and all other
/// parameters at their best.
fn left(folds: &[GroupedFactor], factors: &[usize]) -> Result<f64, RegressorError> {
    let all = merge(folds)?;
    let others: Vec<usize> =
        (0..all.parameter_count()).filter(|parameter| !factors.contains(parameter)).collect();
    let all = all.select(&others)?;
    let (_, solution) = solve_determined(&all, &undetermined(&all)?)?;
    let of_torque =
        |(group, std): (&Group, &f64)| group.factor.rows() as f64 * std.max(f64::MIN_POSITIVE).ln();
    Ok(all.groups().iter().zip(&solution.group_std).map(of_torque).sum())
}
