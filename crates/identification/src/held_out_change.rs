//! Whether the robot of the motion held out is the one that the model was fitted to.

use crate::{IdentificationError, Identified};
use phiw_regressor::factor::Factor;

/// A torque whose error on motion held out is not what training motion lets expect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutChange {
    /// The torque.
    pub row: usize,
    /// Its error held out, less what uncertain parameters make of this motion, over what the model leaves of
    /// training motion that is left out of the fit.
    pub ratio: f64,
}

/// From which ratio on a torque's error is not what training motion lets expect.
///
/// A quadruped's logs reach 4.5. Of 119 development cases of the suites of `cargo xtask undeclared`, each
/// through `phiw identify`, three are beyond, all of which were trained slow and held out fast. A tool of
/// half the mass of an arm's last two links gives 20 to 90, one of a fiftieth of it stays below.
const LEAST_RATIO: f64 = 6.0;
/// Standard deviations of the parameters whose error is expected.
const EXPECTED_DEVIATIONS: f64 = 2.0;

/// The torques of which the motion held out is of another robot, or of a motion that training knows nothing
/// of.
///
/// # Errors
/// The factors are not of the fitted design.
pub fn held_out_change(identified: &Identified) -> Result<Vec<HeldOutChange>, IdentificationError> {
    let fit = &identified.fit;
    let deviations = fit.covariance.deviations(fit.parameters.len())?;
    let mut changes = Vec::new();
    for (row, rmse) in identified.held_out.rmse.iter().enumerate() {
        let groups = identified.held_out_folds.iter().filter_map(|fold| fold.groups().get(row));
        let groups: Vec<_> = groups.collect();
        let Some(first) = groups.first() else { continue };
        let factor = Factor::merge_all(groups.iter().map(|group| &group.factor))?;
        let mut squares = 0.0;
        for deviation in &deviations {
            let own: Vec<f64> = first.parameters.iter().map(|&parameter| deviation[parameter]).collect();
            squares += factor.product_sum_of_squares(&own)?;
        }
        let of_parameters = EXPECTED_DEVIATIONS.powi(2) * squares / factor.rows().max(1) as f64;
        let left = (rmse * rmse - of_parameters).max(0.0).sqrt();
        let expected = fit.left_out_std[row].max(identified.train.rmse[row]);
        let ratio = left / expected;
        if ratio > LEAST_RATIO {
            changes.push(HeldOutChange { row, ratio });
        }
    }
    Ok(changes)
}
