//! Scalar products of columns: what is left of the rows of one torque.

use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::{Accum, MatMut, MatRef, Par};
use phiw_regressor::factor::{Factor, ROUNDING};

/// ΦᵀΦ of some columns, the right-hand side as the last of them.
///
/// Half the digits of a triangular factor are lost. To tell candidates apart the other half is enough; the
/// model that is chosen is fitted from factors.
#[derive(Clone, Debug)]
pub(crate) struct Products {
    size: usize,
    /// `[column × column]`, symmetric.
    values: Vec<f64>,
    /// Rows that it stands for.
    rows: f64,
}

impl Products {
    /// Of no rows.
    pub fn zero(size: usize) -> Self {
        Products { size, values: vec![0.0; size * size], rows: 0.0 }
    }

    /// Of some rows, the right-hand side as their last column.
    pub fn of_rows(rows: MatRef<'_, f64>) -> Self {
        let size = rows.ncols();
        let mut values = vec![0.0; size * size];
        matmul(
            MatMut::from_column_major_slice_mut(&mut values, size, size),
            BlockStructure::TriangularLower,
            Accum::Replace,
            rows.transpose(),
            BlockStructure::Rectangular,
            rows,
            BlockStructure::Rectangular,
            1.0,
            Par::Seq,
        );
        for column in 0..size {
            for row in 0..column {
                values[column * size + row] = values[row * size + column];
            }
        }
        Products { size, values, rows: rows.nrows() as f64 }
    }

    /// RᵀR. The factor of few rows has as few that are not zero.
    pub fn of_factor(factor: &Factor) -> Self {
        Products::of_factor_beside(factor, factor.columns().saturating_sub(1))
    }

    /// The same where the first `rigid_body` columns say what is rounding
    /// ([`without_rounding`](Self::without_rounding)).
    pub fn of_factor_beside(factor: &Factor, rigid_body: usize) -> Self {
        let rows = usize::try_from(factor.rows()).map_or(factor.columns(), |rows| rows.min(factor.columns()));
        let products = Products::of_rows(factor.as_mat().subrows(0, rows));
        Products { rows: factor.rows() as f64, ..products }.without_rounding(rigid_body)
    }

    /// The same where columns of which there is nothing but what rounding makes beside the largest of the
    /// rigid body's, which are the first, are zero; beside the largest of all where it has none. A candidate
    /// that is made of the torque of a model without sense is larger than any, and says nothing of the
    /// others.
    #[must_use]
    pub fn without_rounding(mut self, rigid_body: usize) -> Self {
        let size = self.size;
        let square = |column: usize| self.values[column * size + column];
        let parameters = 0..size.saturating_sub(1);
        let largest = |columns: std::ops::Range<usize>| columns.map(square).fold(0.0, f64::max);
        let largest = match largest(0..rigid_body) {
            0.0 => largest(parameters.clone()),
            largest => largest,
        };
        let least = ROUNDING * ROUNDING * largest;
        let rounded: Vec<usize> = parameters.filter(|&column| square(column) < least).collect();
        for column in rounded {
            for other in 0..size {
                self.values[column * size + other] = 0.0;
                self.values[other * size + column] = 0.0;
            }
        }
        self
    }

    /// The same with all columns but the right-hand side multiplied by a factor.
    pub fn times(&self, factor: f64) -> Self {
        let last = self.size - 1;
        let of = |column: usize| if column == last { 1.0 } else { factor };
        let value = |(at, value): (usize, &f64)| of(at / self.size) * of(at % self.size) * value;
        Products { values: self.values.iter().enumerate().map(value).collect(), ..*self }
    }

    /// Of all rows together.
    pub fn sum(parts: &[Products]) -> Self {
        let mut sum = Products::zero(parts.first().map_or(0, |part| part.size));
        parts.iter().for_each(|part| sum.add(part));
        sum
    }

    /// Adds the rows of another.
    pub fn add(&mut self, other: &Products) {
        self.values.iter_mut().zip(&other.values).for_each(|(sum, value)| *sum += value);
        self.rows += other.rows;
    }

    /// Rows that it stands for.
    pub fn rows(&self) -> f64 {
        self.rows
    }

    /// Whether all columns are finite: one that is not has no finite square.
    pub fn is_finite(&self) -> bool {
        (0..self.size).all(|column| self.values[column * self.size + column].is_finite())
    }

    /// The products of one column with all.
    pub fn column(&self, column: usize) -> &[f64] {
        &self.values[column * self.size..(column + 1) * self.size]
    }

    /// ‖f‖².
    pub fn right_hand_side(&self) -> f64 {
        self.values.last().copied().unwrap_or_default()
    }

    /// ‖Φw − f‖² for `w` as (column, value) pairs. What rounding leaves of an exact fit counts as 1e-12 of
    /// ‖f‖².
    pub fn residual(&self, w: &[(usize, f64)]) -> f64 {
        let last = self.size - 1;
        let mut sum = self.right_hand_side();
        for &(column, value) in w {
            let products = self.column(column);
            let along: f64 = w.iter().map(|&(other, value)| products[other] * value).sum();
            sum += value * (along - 2.0 * products[last]);
        }
        sum.max(1e-12 * self.right_hand_side()).max(f64::MIN_POSITIVE)
    }

    /// ‖Φw‖².
    pub fn size_of(&self, w: &[(usize, f64)]) -> f64 {
        let along =
            |products: &[f64]| -> f64 { w.iter().map(|&(other, value)| products[other] * value).sum() };
        w.iter().map(|&(column, value)| value * along(self.column(column))).sum::<f64>().max(0.0)
    }

    /// What is left of ‖Φw‖² beside other columns, whatever their parameters.
    pub fn size_beside(&self, w: &[(usize, f64)], others: &[usize]) -> f64 {
        let mut columns: Vec<usize> =
            w.iter().map(|&(column, _)| column).chain(others.iter().copied()).collect();
        columns.sort_unstable();
        columns.dedup();
        // Sums of these columns, as their coefficients: none grows with the number of the others.
        let inner = |a: &[f64], b: &[f64]| -> f64 {
            let along = |column: usize| -> f64 {
                let products = self.column(column);
                columns.iter().zip(b).map(|(&other, value)| products[other] * value).sum()
            };
            columns.iter().zip(a).map(|(&column, value)| value * along(column)).sum()
        };
        let sum_of = |w: &[(usize, f64)]| -> Vec<f64> {
            let own =
                |column: usize| w.iter().filter(|(own, _)| *own == column).map(|(_, value)| value).sum();
            columns.iter().map(|&column| own(column)).collect()
        };
        // Gram and Schmidt, in the inner product of the rows.
        let mut basis: Vec<Vec<f64>> = Vec::new();
        let beside = |mut left: Vec<f64>, basis: &[Vec<f64>]| {
            for unit in basis {
                let along = inner(unit, &left);
                left.iter_mut().zip(unit).for_each(|(left, unit)| *left -= along * unit);
            }
            left
        };
        for &column in others {
            let own = sum_of(&[(column, 1.0)]);
            let whole = inner(&own, &own);
            let left = beside(own, &basis);
            let squares = inner(&left, &left);
            if squares > 1e-9 * whole {
                let length = squares.sqrt();
                basis.push(left.into_iter().map(|value| value / length).collect());
            }
        }
        let left = beside(sum_of(w), &basis);
        inner(&left, &left).max(0.0)
    }

    /// Φ_columnᵀ(f − Φw).
    pub fn score(&self, column: usize, w: &[(usize, f64)]) -> f64 {
        let products = self.column(column);
        products[self.size - 1] - w.iter().map(|&(other, value)| products[other] * value).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::Products;
    use faer::prelude::SolveLstsq;
    use phiw_regressor::factor::Factor;

    /// A spring and a balancer on a short arc are the same but for a cube: next to nothing is left of either.
    #[test]
    fn little_is_left_of_a_column_beside_one_that_is_nearly_parallel() {
        let q: Vec<f64> = (0..41).map(|row| -0.4 + 0.02 * f64::from(row)).collect();
        let rows = faer::Mat::from_fn(q.len(), 4, |row, column| match column {
            0 => q[row],
            1 => q[row].sin(),
            2 => q[row].cos(),
            _ => 0.0,
        });
        let products = Products::of_rows(rows.as_ref());
        let (own, whole) = ([(0, 50.0)], products.size_of(&[(0, 50.0)]));
        assert!((products.size_beside(&own, &[]) / whole - 1.0).abs() < 1e-12);
        let left = products.size_beside(&own, &[1, 2]) / whole;
        assert!(left > 0.0 && left < 1e-3, "{left}");
        // Cosines are even, and take nothing of what is odd.
        assert!((products.size_beside(&own, &[2, 2]) / whole - 1.0).abs() < 1e-12);
    }

    /// Forty effects that could do each other's work took longer than anyone waited: what was left of one had
    /// twice as many terms with each of the others.
    #[test]
    fn what_is_left_of_one_of_forty_columns_is_found_at_once() {
        let value =
            |row: usize, column: usize| (1.7 * (row * row) as f64 * (column as f64 + 2.0).sqrt()).sin();
        let rows = faer::Mat::from_fn(90, 41, value);
        let products = Products::of_rows(rows.as_ref());
        let others: Vec<usize> = (1..40).collect();
        // By least squares: the best combination of the others leaves as much.
        let (own, beside) = (rows.col(0).to_owned(), rows.subcols(1, 39).to_owned());
        let taken = &beside * beside.qr().solve_lstsq(own.as_mat());
        let left: f64 = (0..90).map(|row| (own[row] - taken[(row, 0)]).powi(2)).sum();
        assert!(left > 1.0, "{left}");
        assert!((products.size_beside(&[(0, 2.0)], &others) - 4.0 * left).abs() < 1e-9 * left);
    }

    /// An external force named a moment of 10¹⁷ N·m: its column was rounding, and followed the noise.
    #[test]
    fn a_column_of_rounding_alone_explains_nothing() {
        let row = |k: f64| [k.sin(), 1e-16 * (13.0 * k * k).sin(), (13.0 * k * k).sin()];
        let rows: Vec<f64> = (0..40).flat_map(|k| row(f64::from(k))).collect();
        let products = Products::of_factor(&Factor::of_rows(3, &rows).unwrap());
        assert_eq!(products.column(1), [0.0; 3]);
        assert!(products.column(0).iter().zip([1, 0, 1]).all(|(value, some)| (*value != 0.0) == (some == 1)));
        assert!(products.right_hand_side() > 1.0);
    }

    /// Logs in which joints move in turn gave parameters of 10⁸, and columns that are made of such a model's
    /// torque made a rounding of the rigid body's: nothing but the wrists was fitted any more.
    #[test]
    fn a_candidate_without_sense_leaves_the_rigid_body_as_it_is() {
        let row = |k: f64| [k.sin(), 1e15 * (3.0 * k).cos(), (2.0 * k).sin()];
        let rows: Vec<f64> = (0..40).flat_map(|k| row(f64::from(k))).collect();
        let factor = Factor::of_rows(3, &rows).unwrap();
        let left = |products: Products| products.column(0)[0] != 0.0;
        assert!(left(Products::of_factor_beside(&factor, 1)));
        // Without a rigid body the largest of all says what is rounding.
        assert!(!left(Products::of_factor_beside(&factor, 0)));
    }
}
