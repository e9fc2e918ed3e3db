//! Parameters drawn to nothing where the logs hardly tell them.
//!
//! Least squares gives a direction of the parameters that the training motion hardly moves whatever value
//! fits its noise best. On motion that does move it the torque is then wrong by any factor. Joints that move
//! one after the other make such logs, and short ones. A prior that no parameter alone makes much more torque
//! than there is (ridge regression; Hoerl & Kennard 1970) keeps those directions small and leaves what is
//! told as it is. How strong it is, stretches of the training motion say that are left out (Golub, Heath &
//! Wahba 1979).

use crate::fit::merge;
use crate::jackknife::Jackknife;
use phiw_regressor::RegressorError;
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// Deviations of a parameter about nothing that are tried, in units of the value at which its column alone
/// would be as large (RMS) as a torque. Rows count as independent; small ones stand for rows of which many
/// are worth one.
const DEVIATIONS: [f64; 6] = [10.0, 3.0, 1.0, 0.3, 0.1, 0.03];

/// By how many times a torque must be foretold worse from the other stretches (RMS) than it is described
/// where all are fitted: else the model lacks something, and not the motion. Twice is what `log_change.rs`
/// takes for a difference that no noise makes.
const LEAST_RATIO: f64 = 2.0;

/// The folds with a prior that draws all parameters to nothing, each with its share of it; the first `base`
/// are those of the rigid body. `None` where the rows tell the parameters (every torque is foretold from the
/// other stretches better than by no model at all, or about as well as it is described), and where no prior
/// foretells them better.
///
/// # Errors
/// The folds are of different designs.
pub(crate) fn drawn_to_nothing(
    folds: &[GroupedFactor],
    base: usize,
    weights: &[f64],
    jackknife: Option<&Jackknife>,
) -> Result<Option<Vec<GroupedFactor>>, RegressorError> {
    if folds.len() < Jackknife::LEAST_FOLDS {
        return Ok(None);
    }
    let all = merge(folds)?;
    let error_of = |left: &[f64]| -> f64 {
        let of_torque = left.iter().zip(all.groups());
        of_torque.map(|(left, group)| group.factor.rows() as f64 * left.max(f64::MIN_POSITIVE).ln()).sum()
    };
    let mut least = f64::INFINITY;
    if let Some(jackknife) = jackknife {
        let fitted = all.residual_sums_of_squares(&all.combine(weights)?.solve()?.parameters)?;
        let left = jackknife.left_out_squares(folds)?;
        let is_told = |((left, fitted), group): ((&f64, f64), &Group)| {
            let torque = group.factor.right_hand_side_sum_of_squares();
            *left <= torque || *left <= LEAST_RATIO * LEAST_RATIO * fitted
        };
        if left.iter().zip(fitted).zip(all.groups()).all(is_told) {
            return Ok(None);
        }
        least = error_of(&left);
    }
    let scales: Vec<Option<(usize, f64)>> =
        (0..all.parameter_count()).map(|parameter| scale(&all, base, parameter)).collect();
    let mut best = None;
    for deviation in DEVIATIONS {
        let share = (1.0 / folds.len() as f64).sqrt() / deviation;
        let weight = |torque: usize, parameter: usize| {
            let (_, scale) = scales[parameter].filter(|(own, _)| *own == torque)?;
            Some(share / (weights[torque] * scale))
        };
        let drawn: Vec<GroupedFactor> =
            folds.iter().map(|fold| fold.drawn_to_nothing(weight)).collect::<Result<_, RegressorError>>()?;
        let Some(jackknife) = Jackknife::of(&drawn, weights)? else { continue };
        let error = error_of(&jackknife.left_out_squares(folds)?);
        if error < least {
            least = error;
            best = Some(drawn);
        }
    }
    Ok(best)
}

/// Of the torques that a parameter acts on the one for which it would be the largest, and the value at which
/// its column would be as large as that torque (RMS).
///
/// Of a base parameter that is the value at which the largest column of any would be: all are products of
/// masses and lengths, and one that the motion hardly moves is no larger for that.
fn scale(all: &GroupedFactor, base: usize, parameter: usize) -> Option<(usize, f64)> {
    let of_group = |(place, group): (usize, &Group)| {
        let own = group.parameters.iter().position(|own| *own == parameter)?;
        let of_base = group.parameters.iter().enumerate().filter(|(_, own)| **own < base);
        let norm = match parameter < base {
            true => of_base.map(|(column, _)| group.factor.column_norm(column)).fold(0.0, f64::max),
            false => group.factor.column_norm(own),
        };
        let torque = group.factor.right_hand_side_sum_of_squares().sqrt();
        (norm > 0.0 && torque > 0.0).then(|| (place, torque / norm))
    };
    all.groups().iter().enumerate().filter_map(of_group).min_by(|a, b| a.1.total_cmp(&b.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::random_tree::RandomNumbers;
    use phiw_regressor::factor::Factor;

    const PARAMETERS: usize = 6;

    /// Folds of one torque, all parameters being one; `moves` says how much a column moves in a fold.
    fn folds(moves: impl Fn(usize, usize) -> f64) -> Vec<GroupedFactor> {
        let mut random = RandomNumbers::new(5);
        let mut number = || random.uniform(-1.0, 1.0);
        (0..PARAMETERS)
            .map(|fold| {
                let mut rows = Vec::new();
                for _ in 0..60 {
                    let row: Vec<f64> =
                        (0..PARAMETERS).map(|column| moves(fold, column) * number()).collect();
                    rows.extend(&row);
                    rows.push(row.iter().sum::<f64>() + 0.1 * number());
                }
                let factor = Factor::of_rows(PARAMETERS + 1, &rows).unwrap();
                let group = Group { parameters: (0..PARAMETERS).collect(), factor };
                GroupedFactor::new(PARAMETERS, vec![group]).unwrap()
            })
            .collect()
    }

    fn drawn(folds: &[GroupedFactor]) -> Option<Vec<GroupedFactor>> {
        let weights = [1.0 / 0.06];
        let jackknife = Jackknife::of(folds, &weights).unwrap();
        drawn_to_nothing(folds, PARAMETERS, &weights, jackknife.as_ref()).unwrap()
    }

    fn solved(folds: &[GroupedFactor]) -> Vec<f64> {
        merge(folds).unwrap().combine(&[1.0]).unwrap().solve().unwrap().parameters
    }

    #[test]
    fn what_every_stretch_tells_is_left_alone() {
        assert!(drawn(&folds(|_, _| 1.0)).is_none());
    }

    /// Each column moves in one stretch, and hardly in the one before: without the one, that is all there is.
    #[test]
    fn what_one_stretch_tells_is_drawn_and_keeps_what_it_tells() {
        let folds = folds(|fold, column| match column {
            own if own == fold => 1.0,
            next if next == (fold + 1) % PARAMETERS => 1e-3,
            _ => 0.0,
        });
        let drawn = drawn(&folds).expect("a prior foretells better");
        for (with, without) in solved(&drawn).into_iter().zip(solved(&folds)) {
            assert!((with - 1.0).abs() < 0.1 && (with - without).abs() < 0.05, "{with} {without}");
        }
        // Without a stretch its parameter is next to nothing, and not anything.
        let left_out: Vec<GroupedFactor> = drawn.into_iter().skip(1).collect();
        let (without, least_squares) = (solved(&left_out)[0], solved(&folds[1..])[0]);
        assert!(without.abs() < 0.3 && least_squares.abs() > 2.0, "{without} {least_squares}");
    }
}
