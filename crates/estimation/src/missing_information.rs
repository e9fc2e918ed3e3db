//! What encoders that leave a motion open take from what its log tells of the parameters.
//!
//! The curvature of the likelihood of a motion is that of a motion that is known. Where it is not, the
//! information of the readings is less by what is missing (Louis 1982; Dempster, Laird & Rubin 1977): by
//! the covariance, over all motions that the readings leave possible, of the slope of that likelihood in
//! the parameters. To first order the slope changes with a motion by Σ φ·δε/σ², φ the columns of a row and
//! δε what the change of the motion asks for beside as noise, which is linear in it.

use super::smoothing::{Belief, noise_shares};
use crate::{EstimationError, MotionLog, foresight};
use faer::linalg::solvers::SelfAdjointEigen;
use faer::{Mat, Side};
use phiw_identification::Design;

/// Largest share of a direction's information that counts as missing: something is always left, and the
/// first order may say that more is missing than there is.
const MOST_MISSING: f64 = 0.99;

impl Belief<'_> {
    /// The information of the design's parameters that a log lacks whose encoders' motion is `most_likely`;
    /// none where it has no readings. It takes 16 bytes for each command, joint and parameter.
    pub fn missing_information(&self, most_likely: &MotionLog) -> Result<Option<Mat<f64>>, EstimationError> {
        let Some(readings) = &most_likely.readings else { return Ok(None) };
        let (n, periods) = (most_likely.joints, most_likely.rows().saturating_sub(1));
        if periods == 0 || !readings.fits(periods, n) {
            return Ok(None);
        }
        let (stretches, asked) = (self.stretches(most_likely)?, self.asked(most_likely)?);
        let (factor, _) = self.system(most_likely, readings, (&stretches, &asked)).solve();
        let rows = self.rows(most_likely)?;
        let width = rows.len() / periods;
        let unknowns = 2 * n * (periods + 1);
        // Of each parameter, how its slope changes with the unknowns of the motion.
        let mut slopes = Mat::<f64>::zeros(unknowns, self.w.len());
        let mut shares = vec![0.0; 6 * n];
        for stretch in &stretches {
            for period in stretch.periods.clone() {
                let row = &rows[period * width..(period + 1) * width];
                let before = period.checked_sub(1).map(|period| &rows[period * width..(period + 1) * width]);
                // The first period has no knots before its own.
                let (first, skipped) = if period == 0 { (0, 2 * n) } else { (2 * n * (period - 1), 0) };
                for (torque, layout) in self.design.rows().iter().enumerate() {
                    let of_torque = torque * n..(torque + 1) * n;
                    let matrices = (&stretch.inertia[of_torque.clone()], &stretch.damping[of_torque]);
                    let correlation = self.correlation(torque, period);
                    noise_shares((matrices.0, matrices.1, most_likely.period_s), correlation, &mut shares);
                    let weight = self.weight(torque, period);
                    for (&parameter, place) in layout.parameters.iter().zip(layout.range.clone()) {
                        let column = row[place] - before.map_or(0.0, |before| correlation * before[place]);
                        let scaled = weight * column;
                        let slope = &mut slopes.col_as_slice_mut(parameter)[first..];
                        slope
                            .iter_mut()
                            .zip(&shares[skipped..])
                            .for_each(|(slope, share)| *slope += scaled * share);
                    }
                }
            }
        }
        for parameter in 0..slopes.ncols() {
            factor.solve_lower(slopes.col_as_slice_mut(parameter));
        }
        Ok(Some(slopes.transpose() * &slopes))
    }

    /// The rows of all periods, `[period × evaluation width]`.
    fn rows(&self, measured: &MotionLog) -> Result<Vec<f64>, EstimationError> {
        let nothing = vec![false; self.w.len()];
        let foreseen = if self.foreseen.is_empty() { &nothing } else { self.foreseen };
        let design: &Design = self.design;
        let mut rows = Vec::with_capacity(measured.rows() * design.evaluation_width());
        foresight::rows(design, foreseen, (measured, Some(&self.believed())), |row| {
            rows.extend_from_slice(row);
            Ok(())
        })?;
        Ok(rows)
    }
}

/// The covariance without the `missing` information of what has the inverse `covariance` as its own; that
/// covariance where it has no square root.
pub(super) fn without(covariance: &Mat<f64>, missing: &Mat<f64>) -> Mat<f64> {
    let Ok(root) = covariance.llt(Side::Lower) else { return covariance.clone() };
    let root = root.L();
    // Shares of the information that are missing, each along a direction of its own.
    let shares = root.transpose() * missing * root;
    let Ok(directions) = SelfAdjointEigen::new(shares.as_ref(), Side::Lower) else {
        return covariance.clone();
    };
    let along = root * directions.U();
    let left = |k: usize| 1.0 - directions.S()[k].clamp(0.0, MOST_MISSING);
    let scaled = Mat::from_fn(along.nrows(), along.ncols(), |row, k| along[(row, k)] / left(k));
    scaled * along.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of two parameters that ten rows tell, each half known by a measurement that is missing.
    #[test]
    fn what_is_missing_is_taken_from_the_information() {
        let information = Mat::from_fn(2, 2, |row, column| if row == column { 10.0 } else { 3.0 });
        let missing = Mat::from_fn(2, 2, |row, column| if row == column { 4.0 } else { 1.0 });
        let inverse = |matrix: &Mat<f64>| {
            let [a, b, d] = [matrix[(0, 0)], matrix[(0, 1)], matrix[(1, 1)]];
            let determinant = a * d - b * b;
            Mat::from_fn(2, 2, |row, column| match (row, column) {
                (0, 0) => d / determinant,
                (1, 1) => a / determinant,
                _ => -b / determinant,
            })
        };
        let found = without(&inverse(&information), &missing);
        let expected = inverse(&(&information - &missing));
        assert!((&found - &expected).norm_max() < 1e-12, "{found:?} {expected:?}");
        // More than all is not missing.
        let little = without(&inverse(&information), &(&information * faer::Scale(2.0)));
        assert!((little - inverse(&information) * faer::Scale(1.0 / (1.0 - MOST_MISSING))).norm_max() < 1e-9);
    }
}
