//! How far two answers are apart.

use super::answers::Answer;

/// Scale below which numbers are compared absolutely, so that a zero can be compared at all.
const SMALL: f64 = 1e-12;

/// Largest over all rows of |ours − theirs|max over |theirs|max; infinite if the sizes differ or a number is
/// not finite.
pub fn relative_difference(ours: &Answer, theirs: &[f64]) -> f64 {
    if ours.values.len() != theirs.len() {
        return f64::INFINITY;
    }
    let rows = ours.values.chunks(ours.row_length).zip(theirs.chunks(ours.row_length));
    rows.map(|(ours, theirs)| row_difference(ours, theirs)).fold(0.0, f64::max)
}

fn row_difference(ours: &[f64], theirs: &[f64]) -> f64 {
    // NaN would slip through a maximum.
    if !ours.iter().chain(theirs).all(|value| value.is_finite()) {
        return f64::INFINITY;
    }
    let scale = theirs.iter().fold(SMALL, |scale, value| scale.max(value.abs()));
    ours.iter().zip(theirs).fold(0.0, |largest: f64, (ours, theirs)| largest.max((ours - theirs).abs()))
        / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(ours: &[f64], theirs: &[f64], expected: f64) {
        let found = relative_difference(&Answer { row_length: 2, values: ours.to_vec() }, theirs);
        assert!(found == expected || (found - expected).abs() < 1e-12, "{found} instead of {expected}");
    }

    #[test]
    fn difference_is_relative_to_the_largest_of_a_row() {
        check(&[4.0, 1.0, 0.0, 8.0], &[4.0, 2.0, 0.0, 8.0], 0.25);
        check(&[0.0, 0.0], &[0.0, 0.0], 0.0);
    }

    #[test]
    fn what_is_not_a_number_or_not_there_is_a_difference() {
        check(&[f64::NAN, 1.0], &[1.0, 1.0], f64::INFINITY);
        check(&[1.0, 1.0], &[1.0, f64::NAN], f64::INFINITY);
        check(&[1.0, 1.0], &[1.0], f64::INFINITY);
    }
}
