//! Stretches of motion whose residuals have nothing to do with each other.

use super::stage::Fixed;
use phiw_identification::{Fold, IdentificationError};

/// Stretches that the training motion is cut into: enough for a tail probability of one in ten thousand.
const FOLDS: usize = 20;
/// Shortest stretch \[s\]: a residual's correlation must be short against it.
const LEAST_FOLD_S: f64 = 0.5;

/// Long stretches cut into equal parts, `least_parts` or more each, so that there are enough of them.
pub(super) fn split(folds: &[Fold], least_parts: usize) -> Vec<Fold> {
    cut(folds, FOLDS.div_ceil(folds.len().max(1)).max(least_parts))
}

/// The same cut shorter, until each joint moves in as many of them as one that always moves, or in
/// [`FOLDS`]; a joint that moves now and then would be seen in a few long ones only.
///
/// # Errors
/// A log cannot be read.
pub(super) fn split_by_motion(
    fixed: &Fixed<'_>,
    mut folds: Vec<Fold>,
) -> Result<Vec<Fold>, IdentificationError> {
    let enough = FOLDS.min(folds.len());
    let finest = cut(&folds, usize::MAX);
    if finest.len() == folds.len() {
        return Ok(folds);
    }
    let moves = fixed.has_rows(&finest)?;
    let whole = folds.clone();
    let mut parts = 1;
    while folds.len() < finest.len() && seen_least(&folds, &finest, &moves) < enough {
        parts *= 2;
        folds = cut(&whole, parts);
    }
    Ok(folds)
}

/// Each stretch cut into so many equal parts, or as many as are long enough.
fn cut(folds: &[Fold], parts: usize) -> Vec<Fold> {
    let cut = |fold: &Fold| {
        let length = fold.end - fold.start;
        let parts = parts.min((length / LEAST_FOLD_S) as usize).max(1);
        let edge = |part: usize| match part == parts {
            true => fold.end,
            false => fold.start + length * part as f64 / parts as f64,
        };
        (0..parts)
            .map(|part| Fold { log: fold.log, start: edge(part), end: edge(part + 1) })
            .collect::<Vec<Fold>>()
    };
    folds.iter().flat_map(cut).collect()
}

/// The smallest number of `folds` in which a torque has rows, of those that have any; `finest` are the parts
/// of which `moves` says it.
fn seen_least(folds: &[Fold], finest: &[Fold], moves: &[Vec<bool>]) -> usize {
    let torques = moves.first().map_or(0, Vec::len);
    let of_torque = |torque: usize| {
        let seen = |fold: &&Fold| {
            let mut parts = finest.iter().zip(moves).filter(|(part, _)| {
                let middle = 0.5 * (part.start + part.end);
                part.log == fold.log && fold.start <= middle && middle < fold.end
            });
            parts.any(|(_, moves)| moves[torque])
        };
        folds.iter().filter(seen).count()
    };
    (0..torques).map(of_torque).filter(|&count| count > 0).min().unwrap_or(usize::MAX)
}

#[cfg(test)]
mod tests {
    use super::{Fold, cut, seen_least, split};

    fn fold(start: f64, end: f64) -> Fold {
        Fold { log: 0, start, end }
    }

    #[test]
    fn stretches_are_cut_into_twenty_and_none_is_shorter_than_half_a_second() {
        assert_eq!(split(&[fold(0.0, 60.0)], 1).len(), 20);
        assert_eq!(split(&[fold(0.0, 60.0), fold(60.0, 90.0)], 1).len(), 20);
        assert_eq!(split(&[fold(0.0, 3.2)], 1).len(), 6);
        assert_eq!(cut(&[fold(0.0, 60.0)], usize::MAX).len(), 120);
        assert_eq!(cut(&[fold(0.0, 0.2)], usize::MAX).len(), 1);
    }

    #[test]
    fn the_torque_that_is_seen_least_counts_and_one_without_rows_does_not() {
        let finest = cut(&[fold(0.0, 4.0)], usize::MAX);
        let moves: Vec<Vec<bool>> = (0..finest.len()).map(|part| vec![true, part < 2, false]).collect();
        for (parts, seen) in [(1, 1), (2, 1), (4, 1), (8, 2)] {
            assert_eq!(seen_least(&cut(&[fold(0.0, 4.0)], parts), &finest, &moves), seen, "{parts} parts");
        }
    }
}
