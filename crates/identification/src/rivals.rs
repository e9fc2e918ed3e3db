//! What the choice of an effect's constants adds to the uncertainty.
//!
//! The constants of a declared effect are chosen from a list, and the factors hold the columns of the whole
//! list. Beside the chosen column c₀ stands that of the nearest rival, c₁: what the two span is, to first
//! order, what the effect looks like with its constant free. In the fit of both, β₀c₀ + β₁c₁ = (β₀ + β₁)c₀ +
//! β₁(c₁ − c₀), so that β₀ + β₁ is the effect's parameter with the constant free.

use crate::fit::{Fit, merge};
use crate::jackknife::Jackknife;
use phiw_regressor::RegressorError;
use phiw_regressor::least_squares::GroupedFactor;

/// Widens the covariance of a fit by what the choice among rivals leaves open: to the spread of the solutions
/// with all constants free, and by how far those are from the fit. Its intervals are then about those
/// solutions: the simplest constants are chosen that the data allow, and they bend the parameters.
///
/// `folds` have the columns of the fit's design, then one for each of `stands_for`, a rival's of that
/// parameter.
///
/// # Errors
/// The folds are of another design.
pub(crate) fn widen(
    fit: &mut Fit,
    folds: &[GroupedFactor],
    stands_for: &[usize],
) -> Result<(), RegressorError> {
    let mut columns = fit.determined();
    let own = columns.len();
    let places: Vec<Option<usize>> =
        stands_for.iter().map(|parameter| columns.iter().position(|column| column == parameter)).collect();
    let first = fit.parameters.len();
    columns.extend((0..places.len()).filter(|&rival| places[rival].is_some()).map(|rival| first + rival));
    let mut places: Vec<usize> = places.into_iter().flatten().collect();
    let weights: Vec<f64> = fit.residual_std.iter().map(|std| 1.0 / std).collect();
    let all = merge(folds)?.select(&columns)?.combine(&weights)?;
    // A rival whose column is no other.
    let undetermined = all.undetermined_columns();
    for column in (own..columns.len()).rev().filter(|column| undetermined.contains(column)) {
        columns.remove(column);
        places.remove(column - own);
    }
    if places.is_empty() {
        return Ok(());
    }
    let folds: Vec<GroupedFactor> =
        folds.iter().map(|fold| fold.select(&columns)).collect::<Result<_, _>>()?;
    let free = |solution: &[f64]| {
        let (own, rivals) = solution.split_at(own);
        let mut free = own.to_vec();
        places.iter().zip(rivals).for_each(|(&place, rival)| free[place] += rival);
        free
    };
    let Ok(solution) = merge(&folds)?.combine(&weights)?.solve() else { return Ok(()) };
    let Some(jackknife) = Jackknife::of(&folds, &weights)? else { return Ok(()) };
    let determined = fit.determined();
    let shift: Vec<f64> = (free(&solution.parameters).iter().zip(&determined))
        .map(|(value, &parameter)| value - fit.parameters[parameter])
        .collect();
    fit.take_deviations(&determined, &jackknife.map(free).deviations(), Some(&shift));
    Ok(())
}
