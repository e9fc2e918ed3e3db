//! Solving with an upper triangular matrix that lies in memory column by column.

use phiw_dynamics::dense::dot;

/// `x` ← R⁻¹·x, R upper triangular with as many columns as `x` has elements; `column(k)` begins with the
/// elements of column k down to the diagonal.
pub fn solve_upper<'a>(column: impl Fn(usize) -> &'a [f64], x: &mut [f64]) {
    for k in (0..x.len()).rev() {
        let entries = column(k);
        let value = x[k] / entries[k];
        x[k] = value;
        x[..k].iter_mut().zip(entries).for_each(|(rest, entry)| *rest -= value * entry);
    }
}

/// `x` ← R⁻ᵀ·x with the same R.
pub fn solve_lower<'a>(column: impl Fn(usize) -> &'a [f64], x: &mut [f64]) {
    for k in 0..x.len() {
        let entries = column(k);
        x[k] = (x[k] - dot(&entries[..k], &x[..k])) / entries[k];
    }
}
