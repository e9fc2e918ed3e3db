//! Small triangles, fast: two merged into one, and the extreme singular values of the result.
//!
//! A selection asks for cond of the stack with each candidate. A full QR and a full singular value
//! decomposition of a 132-triangle cost 10 ms; both know nothing of the zeros, and all singular values but
//! two are thrown away. Here the QR of one triangle on top of another touches the non-zeros only (n³/3
//! multiplications), and Lanczos' method finds the two in some tens of products.

use super::lanczos::largest_eigenvalue;
use faer::Mat;
use phiw_dynamics::dense::dot;
use phiw_regressor::factor::{Factor, solve_lower, solve_upper};

/// An upper triangular matrix, column by column.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangle {
    size: usize,
    /// Column after column, each down to its diagonal.
    entries: Vec<f64>,
}

/// Where a column begins among the entries.
const fn begin(column: usize) -> usize {
    column * (column + 1) / 2
}

impl Triangle {
    /// Of no rows.
    pub fn empty(size: usize) -> Self {
        Triangle { size, entries: vec![0.0; begin(size)] }
    }

    /// The R of Φ alone, the right-hand side of the factor left out.
    pub fn of_factor(factor: &Factor) -> Self {
        let size = factor.parameters();
        let entries = (0..size).flat_map(|column| &factor.column(column)[..=column]).copied().collect();
        Triangle { size, entries }
    }

    /// Number of columns.
    pub fn size(&self) -> usize {
        self.size
    }

    /// The non-zero part of a column: rows up to the diagonal.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.entries[begin(column)..][..=column]
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
        pulp::Arch::new().dispatch(Absorb {
            size: self.size,
            above: &mut self.entries,
            below: &mut other.entries,
        });
    }

    /// The same with diagonal elements no nearer to zero than this share of the largest, so that it can be
    /// inverted.
    pub(super) fn with_least_diagonal(&self, share: f64) -> Self {
        let mut raised = self.clone();
        let diagonal = |column: usize| self.column(column)[column].abs();
        let least = share * (0..self.size).map(diagonal).fold(f64::MIN_POSITIVE, f64::max);
        for column in 0..self.size {
            let own = &mut raised.entries[begin(column) + column];
            *own = if own.abs() >= least { *own } else { least };
        }
        raised
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
                layers[layer].entries[begin(place) + first(row)] = self.column(columns[place])[row];
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
        pulp::Arch::new().dispatch(Multiply { triangle: self, x, product });
    }

    /// Rᵀ·x, in place: from the last element, as each needs those before it.
    pub(super) fn multiply_transposed(&self, x: &mut [f64]) {
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
        let sum = pulp::Arch::new().dispatch(VarianceAlong { of, inverted: self });
        if sum.is_finite() { sum } else { f64::INFINITY }
    }
}

/// The reflections of [`Triangle::absorb`]; a type and no closure, so that all of it is compiled for the
/// widest registers there are.
struct Absorb<'a> {
    size: usize,
    above: &'a mut [f64],
    below: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Absorb<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Absorb { size, above, below } = self;
        for pivot in 0..size {
            let (head, mut rest) = below.split_at_mut(begin(pivot + 1));
            let below = &mut head[begin(pivot)..];
            let top = above[begin(pivot) + pivot];
            let norm = (top * top + dot(below, below)).sqrt();
            if norm == 0.0 {
                continue;
            }
            // The reflection that sends (top, below) to (∓norm, 0), scaled so that its vector begins with 1.
            let signed = if top < 0.0 { -norm } else { norm };
            let first = top + signed;
            let factor = first / signed;
            below.iter_mut().for_each(|value| *value /= first);
            above[begin(pivot) + pivot] = -signed;
            for column in pivot + 1..size {
                let (own, after) = std::mem::take(&mut rest).split_at_mut(column + 1);
                rest = after;
                let under = &mut own[..=pivot];
                let over = &mut above[begin(column) + pivot];
                let along = factor * (*over + dot(below, under));
                *over -= along;
                under.iter_mut().zip(&*below).for_each(|(value, direction)| *value -= along * direction);
            }
        }
    }
}

/// [`Triangle::multiply`], for the widest registers.
struct Multiply<'a> {
    triangle: &'a Triangle,
    x: &'a [f64],
    product: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Multiply<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Multiply { triangle, x, product } = self;
        product.fill(0.0);
        for (column, &value) in x.iter().enumerate() {
            product.iter_mut().zip(triangle.column(column)).for_each(|(sum, entry)| *sum += value * entry);
        }
    }
}

/// [`Triangle::variance_along`], for the widest registers: the sum of the squares of R⁻ᵀXᵀ.
struct VarianceAlong<'a> {
    of: &'a Triangle,
    inverted: &'a Triangle,
}

impl pulp::NullaryFnOnce for VarianceAlong<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let size = self.inverted.size;
        let mut sum = 0.0;
        let mut row = vec![0.0; size];
        for first in 0..size {
            // A row of X has nothing before its diagonal, and neither has what is solved for.
            for column in first..size {
                let entries = self.inverted.column(column);
                let own = self.of.column(column)[first];
                row[column] = (own - dot(&entries[first..column], &row[first..column])) / entries[column];
            }
            sum += dot(&row[first..], &row[first..]);
        }
        sum
    }
}

/// Part of a column's length that must be new for it not to depend on those before it.
const INDEPENDENT: f64 = 1e-8;

#[cfg(test)]
mod tests {
    use super::{Triangle, begin};

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
                one.entries[begin(column) + row] = *value;
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
