//! Small triangles, fast: two merged into one, and the extreme singular values of the result.
//!
//! A selection asks for cond of the stack with each candidate. A full QR and a full singular value
//! decomposition of a 132-triangle cost 10 ms; both know nothing of the zeros, and all singular values but
//! two are thrown away. Here the QR of one triangle on top of another touches the non-zeros only (n³/3
//! multiplications), and Lanczos' method finds the two in some tens of products.

use faer::Mat;
use phiw_dynamics::dense::dot;
use phiw_regressor::factor::{Factor, solve_lower, solve_upper};

/// An upper triangular matrix, column by column.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangle {
    size: usize,
    /// `size` × `size`, column-major; zeros below the diagonal.
    entries: Vec<f64>,
}

impl Triangle {
    /// Of no rows.
    pub fn empty(size: usize) -> Self {
        Triangle { size, entries: vec![0.0; size * size] }
    }

    /// The R of Φ alone, the right-hand side of the factor left out.
    pub fn of_factor(factor: &Factor) -> Self {
        let size = factor.parameters();
        let entries = (0..size).flat_map(|column| &factor.column(column)[..size]).copied().collect();
        Triangle { size, entries }
    }

    /// Number of columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The non-zero part of a column: rows up to the diagonal.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.entries[column * self.size..][..=column]
    }

    /// Takes in the rows of another triangle: R of \[this; other\] by Householder reflections that keep to
    /// the non-zeros.
    ///
    /// `other` is used up as scratch.
    ///
    /// # Panics
    /// For triangles of different sizes.
    pub fn absorb(&mut self, other: &mut Triangle) {
        assert_eq!(self.size, other.size, "triangles of different sizes");
        let size = self.size;
        for pivot in 0..size {
            let (head, rest) = other.entries.split_at_mut((pivot + 1) * size);
            let below = &mut head[pivot * size..][..=pivot];
            let top = self.entries[pivot * size + pivot];
            let norm = (top * top + dot(below, below)).sqrt();
            if norm == 0.0 {
                continue;
            }
            // The reflection that sends (top, below) to (∓norm, 0), scaled so that its vector begins with 1.
            let signed = if top < 0.0 { -norm } else { norm };
            let first = top + signed;
            let factor = first / signed;
            below.iter_mut().for_each(|value| *value /= first);
            self.entries[pivot * size + pivot] = -signed;
            for column in pivot + 1..size {
                let under = &mut rest[(column - pivot - 1) * size..][..=pivot];
                let over = &mut self.entries[column * size + pivot];
                let along = factor * (*over + dot(below, under));
                *over -= along;
                under.iter_mut().zip(&*below).for_each(|(value, direction)| *value -= along * direction);
            }
        }
    }

    /// R of some of the columns, which are ascending.
    ///
    /// # Panics
    /// For a column that there is not.
    pub fn select(&self, columns: &[usize]) -> Self {
        let mut selected = Triangle::empty(columns.len());
        // Row k has nothing before column k. Rows whose first column is the same go into triangles of their
        // own.
        let first = |row: usize| columns.partition_point(|&column| column < row);
        let mut layers: Vec<Triangle> = Vec::new();
        let mut layer = 0;
        for row in 0..columns.last().map_or(0, |last| last + 1) {
            layer = if row > 0 && first(row) == first(row - 1) { layer + 1 } else { 0 };
            if layer == layers.len() {
                layers.push(Triangle::empty(columns.len()));
            }
            for place in first(row)..columns.len() {
                layers[layer].entries[place * columns.len() + first(row)] =
                    self.entries[columns[place] * self.size + row];
            }
        }
        layers.iter_mut().for_each(|layer| selected.absorb(layer));
        selected
    }

    /// The columns that do not depend on those before them, ascending.
    pub fn independent_columns(&self) -> Vec<usize> {
        let is_independent = |&column: &usize| {
            let own = self.column(column);
            own[column].abs() > INDEPENDENT * dot(own, own).sqrt()
        };
        (0..self.size).filter(is_independent).collect()
    }

    /// ‖R·x‖².
    pub fn product_squared(&self, x: &[f64]) -> f64 {
        let mut product = vec![0.0; self.size];
        self.multiply(x, &mut product);
        dot(&product, &product)
    }

    /// R·x.
    pub(crate) fn multiply(&self, x: &[f64], product: &mut [f64]) {
        product.fill(0.0);
        for (column, &value) in x.iter().enumerate() {
            product.iter_mut().zip(self.column(column)).for_each(|(sum, entry)| *sum += value * entry);
        }
    }

    /// Rᵀ·x, in place: from the last element, as each needs those before it.
    fn multiply_transposed(&self, x: &mut [f64]) {
        for column in (0..self.size).rev() {
            x[column] = dot(self.column(column), &x[..=column]);
        }
    }

    /// R⁻¹·x, in place.
    pub(crate) fn solve(&self, x: &mut [f64]) {
        solve_upper(|column| self.column(column), x);
    }

    /// R⁻ᵀ·x, in place.
    pub(crate) fn solve_transposed(&self, x: &mut [f64]) {
        solve_lower(|column| self.column(column), x);
    }

    /// The largest and the smallest singular value; the smallest is 0 where a diagonal element is.
    pub fn extreme_singular_values(&self) -> [f64; 2] {
        if self.size == 0 {
            return [1.0, 1.0];
        }
        let mut product = vec![0.0; self.size];
        let largest = largest_eigenvalue(self.size, |x| {
            self.multiply(x, &mut product);
            x.copy_from_slice(&product);
            self.multiply_transposed(x);
        });
        if (0..self.size).any(|row| self.column(row)[row] == 0.0) {
            return [largest.sqrt(), 0.0];
        }
        let inverse = largest_eigenvalue(self.size, |x| {
            self.solve_transposed(x);
            self.solve(x);
        });
        [largest.sqrt(), if inverse.is_finite() { 1.0 / inverse.sqrt() } else { 0.0 }]
    }

    /// cond(Φ) = σ_max/σ_min, equation (5); infinite for a Φ without full rank.
    pub fn condition_number(&self) -> f64 {
        let [largest, smallest] = self.extreme_singular_values();
        if smallest > 0.0 { largest / smallest } else { f64::INFINITY }
    }

    /// log det(ΦᵀΦ): what D-optimal designs make large.
    pub fn log_determinant(&self) -> f64 {
        (0..self.size).map(|row| 2.0 * self.column(row)[row].abs().ln()).sum()
    }

    /// trace((ΦᵀΦ)⁻¹): what A-optimal designs make small.
    pub fn inverse_trace(&self) -> f64 {
        let mut sum = 0.0;
        let mut column = vec![0.0; self.size];
        for index in 0..self.size {
            column.fill(0.0);
            column[index] = 1.0;
            self.solve(&mut column);
            sum += dot(&column, &column);
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }

    /// √(tr(R·C·Rᵀ)/rows): RMS of the standard deviation of Φ·w over the `rows` rows that this R stands for,
    /// where C is the covariance of w. Directions of w that these rows do not feel do not count, however
    /// little is known of them. None if the covariance is of other parameters.
    pub(crate) fn uncertainty_of(&self, covariance: &Mat<f64>, rows: usize) -> Option<f64> {
        let size = self.size;
        if covariance.nrows() != size {
            return None;
        }
        let r = Mat::from_fn(size, size, |row, column| self.column(column).get(row).copied().unwrap_or(0.0));
        let spread = &r * covariance;
        let trace: f64 =
            (0..size).map(|row| (row..size).map(|k| spread[(row, k)] * r[(row, k)]).sum::<f64>()).sum();
        Some((trace.max(0.0) / rows.max(1) as f64).sqrt()).filter(|uncertainty| uncertainty.is_finite())
    }

    /// trace(X·(ΦᵀΦ)⁻¹·Xᵀ), where `of` is R of X: the variance that unit noise leaves in X·w, summed over the
    /// rows of X; infinite for a Φ without full rank.
    ///
    /// # Panics
    /// For triangles of different sizes.
    pub fn variance_along(&self, of: &Triangle) -> f64 {
        assert_eq!(self.size, of.size, "triangles of different sizes");
        let mut sum = 0.0;
        let mut row = vec![0.0; self.size];
        for index in 0..self.size {
            row.iter_mut()
                .enumerate()
                .for_each(|(column, value)| *value = of.entries[column * of.size + index]);
            self.solve_transposed(&mut row);
            sum += dot(&row, &row);
        }
        if sum.is_finite() { sum } else { f64::INFINITY }
    }
}

/// Part of a column's length that must be new for it not to depend on those before it.
const INDEPENDENT: f64 = 1e-8;

/// Change of the eigenvalue over one step, as a share, at which it counts as found.
const SETTLED: f64 = 1e-14;

/// Largest eigenvalue of a symmetric positive definite operator, by Lanczos' method with full
/// reorthogonalisation.
///
/// It starts from a fixed vector with a part along every direction, so that the result is always the same.
fn largest_eigenvalue(size: usize, mut apply: impl FnMut(&mut [f64])) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::Triangle;

    /// Columns 2 and 4 depend on those before them.
    fn dependent() -> Triangle {
        let rows = [
            [1.0, 0.5, 2.0, -1.0, 0.3, 0.7],
            [0.0, 2.0, -1.0, 0.4, 1.0, 0.2],
            [0.0, 0.0, 0.0, 0.6, 0.9, -0.5],
            [0.0, 0.0, 0.0, 0.8, 1.2, 0.1],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.3],
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.9],
        ];
        let mut triangle = Triangle::empty(6);
        for (row, values) in rows.iter().enumerate() {
            // Each row by itself: what is absorbed is triangular.
            let mut one = Triangle::empty(6);
            values.iter().enumerate().skip(row).for_each(|(column, value)| {
                one.entries[column * 6 + row] = *value;
            });
            triangle.absorb(&mut one);
        }
        triangle
    }

    #[test]
    fn columns_that_depend_on_those_before_them_are_told() {
        assert_eq!(dependent().independent_columns(), [0, 1, 3, 5]);
        assert_eq!(dependent().condition_number(), f64::INFINITY);
        let kept = dependent().select(&[0, 1, 3, 5]);
        assert_eq!(kept.independent_columns(), [0, 1, 2, 3]);
        assert!(kept.condition_number() < 10.0, "{}", kept.condition_number());
    }

    #[test]
    fn a_selection_has_the_same_products() {
        let (whole, columns) = (dependent(), [1, 2, 4, 5]);
        let selected = whole.select(&columns);
        for trial in 0..5 {
            let x: Vec<f64> = (0..4).map(|k| (1.3 * f64::from(trial) + 0.9 * k as f64).sin()).collect();
            let mut all = vec![0.0; 6];
            columns.iter().zip(&x).for_each(|(&column, value)| all[column] = *value);
            let (own, expected) = (selected.product_squared(&x), whole.product_squared(&all));
            assert!((own - expected).abs() < 1e-12 * (1.0 + expected), "{own}, {expected}");
        }
    }
}
