//! Quantiles of a few numbers in memory, as plots and tables show them.

/// The quantile of `sorted` (ascending) below which `share` of it lies, from 0 to 1; NaN of nothing.
///
/// Between order statistics it is interpolated linearly (Hyndman and Fan's type 7, NumPy's default).
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let position = share.clamp(0.0, 1.0) * last as f64;
    let below = position as usize;
    match position - below as f64 {
        // Also where the next one is infinite.
        0.0 => sorted[below],
        weight => (1.0 - weight) * sorted[below] + weight * sorted[below + 1],
    }
}

/// The middle one, in any order; of an even number the mean of the two in the middle; NaN of nothing.
pub fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    quantile(&sorted, 0.5)
}

#[cfg(test)]
mod tests {
    use super::{median, quantile};

    #[test]
    fn medians_are_in_the_middle() {
        for (values, expected) in [
            (&[3.0][..], 3.0),
            (&[3.0, 1.0], 2.0),
            (&[9.0, 1.0, 2.0], 2.0),
            (&[4.0, 1.0, 2.0, 9.0], 3.0),
            (&[f64::INFINITY, 1.0, 2.0], 2.0),
        ] {
            assert_eq!(median(values), expected, "{values:?}");
        }
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn quantiles_are_between_their_neighbours() {
        let sorted = [0.0, 1.0, 10.0, 100.0, 1000.0];
        for (share, expected) in [(0.0, 0.0), (0.25, 1.0), (0.3, 2.8), (0.5, 10.0), (1.0, 1000.0)] {
            let found = quantile(&sorted, share);
            assert!((found - expected).abs() < 1e-9, "{share}: {found}");
        }
    }
}
