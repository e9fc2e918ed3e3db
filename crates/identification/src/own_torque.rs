//! A fit whose columns, where they are made of the model's torque, are made of its own.

use crate::accumulate::FoldFactors;
use crate::fit::{Fit, torque_error};
use crate::{Design, IdentificationError};
use phiw_regressor::least_squares::GroupedFactor;

/// Times that the columns are made anew, at most.
const FITS: usize = 5;
/// By how much the error of a torque may grow (RMS) once the columns are made of the fit's own torque.
pub(crate) const LARGEST_GROWTH: f64 = 1.02;

/// A fitted model with its own torque in the columns that need one.
pub struct OwnTorqueFit {
    /// The columns.
    pub design: Design,
    /// Their parameters.
    pub fit: Fit,
    /// The folds' factors with these columns.
    pub folds: FoldFactors,
}

/// Makes the columns of a fitted design of the fit's own torque, and fits again while that makes the error of
/// a torque larger than the fit left it: the fit was then one to another model's torque. Of all these fits
/// the best with its own torque is taken (the smallest geometric mean of the torques' errors).
///
/// `read` makes the factors of a design's folds, of which those in `train` come first; `fit_again` fits a
/// design to these. One pass over the logs where the first fit is as good with its own torque, none where no
/// column needs one.
///
/// # Errors
/// Those of `read` and `fit_again`.
pub fn fit_with_own_torque(
    design: Design,
    fit: Fit,
    folds: FoldFactors,
    train: usize,
    read: impl Fn(&Design) -> Result<FoldFactors, IdentificationError>,
    fit_again: impl Fn(&Design, &[GroupedFactor]) -> Result<Fit, IdentificationError>,
) -> Result<OwnTorqueFit, IdentificationError> {
    let of = |design: Design, fit: Fit| -> Result<OwnTorqueFit, IdentificationError> {
        let design = design.with_own_reference(&fit.parameters)?;
        Ok(OwnTorqueFit { folds: read(&design)?, design, fit })
    };
    if !design.needs().of_reference() {
        return Ok(OwnTorqueFit { design: design.with_own_reference(&fit.parameters)?, fit, folds });
    }
    let mut present = of(design, fit)?;
    let (mut error, mut growth) = present.errors(train)?;
    let mut best: Option<(f64, Fit)> = None;
    for _ in 1..FITS {
        if growth <= LARGEST_GROWTH {
            break;
        }
        let fit = fit_again(&present.design, &present.folds.moving[..train])?;
        if best.as_ref().is_none_or(|(least, _)| error < *least) {
            best = Some((error, present.fit));
        }
        present = of(present.design, fit)?;
        (error, growth) = present.errors(train)?;
    }
    match best {
        Some((least, fit)) if least < error => of(present.design, fit),
        _ => Ok(present),
    }
}

impl OwnTorqueFit {
    /// The sum of the logarithms of the torques' errors, and the largest ratio of one to what the fit left.
    fn errors(&self, train: usize) -> Result<(f64, f64), IdentificationError> {
        let rmse = torque_error(&self.folds.moving[..train], &self.fit.parameters)?.rmse;
        let growth = largest_growth(&rmse, &self.fit.residual_std);
        Ok((rmse.iter().map(|rmse| rmse.max(f64::MIN_POSITIVE).ln()).sum(), growth))
    }
}

/// The largest ratio of the torques' errors to what they were before.
pub(crate) fn largest_growth(rmse: &[f64], before: &[f64]) -> f64 {
    let ratios = rmse.iter().zip(before).filter(|(_, before)| **before > 0.0);
    ratios.map(|(rmse, before)| rmse / before).fold(0.0, f64::max)
}
