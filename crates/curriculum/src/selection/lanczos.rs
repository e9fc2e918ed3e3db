//! The largest eigenvalue of an operator that is known by its products.

use phiw_dynamics::dense::dot;

/// Change of the eigenvalue over one step, as a share, at which it counts as found.
const SETTLED: f64 = 1e-14;

/// Largest eigenvalue of a symmetric positive definite operator, by Lanczos' method with full
/// reorthogonalisation.
///
/// It starts from a fixed vector with a part along every direction, so that the result is always the same.
pub(super) fn largest_eigenvalue(size: usize, mut apply: impl FnMut(&mut [f64])) -> f64 {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let (mut diagonal, mut off) = (Vec::new(), Vec::new());
    let mut next: Vec<f64> = (0..size).map(|k| 1.0 + 0.7 * (1.7 * k as f64 + 0.3).sin()).collect();
    let mut before = 0.0;
    for _ in 0..size {
        let norm = dot(&next, &next).sqrt();
        if !norm.is_finite() {
            return f64::INFINITY;
        }
        if norm == 0.0 {
            break;
        }
        next.iter_mut().for_each(|value| *value /= norm);
        if !basis.is_empty() {
            off.push(norm);
        }
        basis.push(next.clone());
        apply(&mut next);
        diagonal.push(dot(&next, &basis[basis.len() - 1]));
        for _ in 0..2 {
            for direction in &basis {
                let along = dot(&next, direction);
                next.iter_mut().zip(direction).for_each(|(value, unit)| *value -= along * unit);
            }
        }
        let found = largest_of_tridiagonal(&diagonal, &off);
        if !found.is_finite() {
            return f64::INFINITY;
        }
        if (found - before).abs() <= SETTLED * found && diagonal.len() > 3 {
            return found;
        }
        before = found;
    }
    before
}

/// Largest eigenvalue of a symmetric tridiagonal matrix, by Sturm's count and bisection.
fn largest_of_tridiagonal(diagonal: &[f64], off: &[f64]) -> f64 {
    let reach = |row: usize| {
        let before = if row > 0 { off[row - 1].abs() } else { 0.0 };
        before + off.get(row).map_or(0.0, |value| value.abs())
    };
    let mut high =
        (0..diagonal.len()).map(|row| diagonal[row] + reach(row)).fold(f64::NEG_INFINITY, f64::max);
    let mut low = diagonal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !high.is_finite() {
        return f64::INFINITY;
    }
    // Whether no eigenvalue is larger than x: all pivots of x·1 − T are positive.
    let above = |x: f64| {
        let mut pivot = 1.0;
        for (row, value) in diagonal.iter().enumerate() {
            let square = if row > 0 { off[row - 1] * off[row - 1] } else { 0.0 };
            pivot = x - value - square / pivot;
            if pivot <= 0.0 {
                return false;
            }
        }
        true
    };
    while high - low > 1e-15 * high.abs() {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if above(middle) { high = middle } else { low = middle }
    }
    0.5 * (low + high)
}
