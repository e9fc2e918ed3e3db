//! The triangular factor and what makes a new factor of it.

use super::FactorBuilder;
use crate::RegressorError;
use faer::{Mat, MatRef};
use phiw_dynamics::check::{check_index, check_size};

/// The upper triangular R with RᵀR = \[Φ f\]ᵀ\[Φ f\]; the last column is the right-hand side f.
///
/// The first non-zero entry of each row is positive, so that equal rows give equal factors in whatever order
/// they came.
#[derive(Clone, Debug, PartialEq)]
#[must_use = "merging makes a new factor, and leaves both as they are"]
pub struct Factor {
    columns: usize,
    rows: u64,
    /// Column-major, `columns` × `columns`.
    r: Mat<f64>,
}

impl Factor {
    /// The factor of no rows.
    pub fn empty(columns: usize) -> Self {
        Factor { columns, rows: 0, r: Mat::zeros(columns, columns) }
    }

    /// The factor of a row-major block of \[Φ f\].
    ///
    /// # Errors
    /// The block is not whole rows, or holds a number that is not finite.
    pub fn of_rows(columns: usize, rows: &[f64]) -> Result<Self, RegressorError> {
        let mut builder = FactorBuilder::new(columns);
        builder.push_rows(rows)?;
        Ok(builder.factor())
    }

    pub(super) fn from_upper_triangle(work: &Mat<f64>, columns: usize, rows: u64) -> Self {
        let mut r = Mat::zeros(columns, columns);
        for row in 0..columns {
            let leading = (row..columns).map(|column| work[(row, column)]).find(|value| *value != 0.0);
            let sign = if leading.is_some_and(|value| value < 0.0) { -1.0 } else { 1.0 };
            for column in row..columns {
                r[(row, column)] = sign * work[(row, column)];
            }
        }
        Factor { columns, rows, r }
    }

    /// The factor whose upper triangle is `entries`, row by row from the diagonal on, exactly as
    /// [`Self::triangle`] gave it; it stands for `rows` rows.
    ///
    /// # Errors
    /// There are not `columns`·(`columns` + 1)/2 entries.
    pub fn of_triangle(columns: usize, rows: u64, entries: &[f64]) -> Result<Self, RegressorError> {
        check_size("entries of a triangle", entries.len(), columns * (columns + 1) / 2)?;
        let mut r = Mat::zeros(columns, columns);
        let places = (0..columns).flat_map(|row| (row..columns).map(move |column| (row, column)));
        places.zip(entries).for_each(|(place, value)| r[place] = *value);
        Ok(Factor { columns, rows, r })
    }

    /// The entries of the upper triangle, row by row from the diagonal on.
    pub fn triangle(&self) -> Vec<f64> {
        (0..self.columns)
            .flat_map(|row| (row..self.columns).map(move |column| self.r[(row, column)]))
            .collect()
    }

    /// The same factor standing for `rows` rows: for one that was written down and is read back.
    pub fn standing_for(self, rows: u64) -> Self {
        Factor { rows, ..self }
    }

    /// Number of columns, the right-hand side included.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Number of columns of Φ: the right-hand side left out.
    pub fn parameters(&self) -> usize {
        self.columns.saturating_sub(1)
    }

    /// Number of rows of Φ that went in.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Entry of R.
    pub fn entry(&self, row: usize, column: usize) -> f64 {
        self.r[(row, column)]
    }

    /// A column of R, with the zeros below its diagonal.
    pub fn column(&self, column: usize) -> &[f64] {
        self.r.col_as_slice(column)
    }

    /// R as a matrix.
    pub fn as_mat(&self) -> MatRef<'_, f64> {
        self.r.as_ref()
    }

    /// Euclidean norm of a column of \[Φ f\].
    pub fn column_norm(&self, column: usize) -> f64 {
        self.column(column)[..=column].iter().map(|entry| entry * entry).sum::<f64>().sqrt()
    }

    /// The factor of the rows of both.
    ///
    /// # Errors
    /// They have different numbers of columns.
    pub fn merge(&self, other: &Factor) -> Result<Factor, RegressorError> {
        Self::merge_all([self, other])
    }

    /// The factor of the rows of all.
    ///
    /// # Errors
    /// They have different numbers of columns.
    pub fn merge_all<'a>(factors: impl IntoIterator<Item = &'a Factor>) -> Result<Factor, RegressorError> {
        let mut factors = factors.into_iter();
        let Some(first) = factors.next() else { return Ok(Factor::empty(0)) };
        let identity: Vec<usize> = (0..first.columns).collect();
        let mut builder = FactorBuilder::new(first.columns);
        for factor in std::iter::once(first).chain(factors) {
            check_size("the columns of a factor to be taken in", factor.columns, first.columns)?;
            builder.push_factor(factor, &identity, 1.0)?;
        }
        Ok(builder.factor())
    }

    /// The factor of `columns` of \[Φ f\], in that order: drops, keeps and reorders columns. The last one
    /// named is the new right-hand side.
    ///
    /// # Errors
    /// A column does not exist.
    pub fn select(&self, columns: &[usize]) -> Result<Factor, RegressorError> {
        let mut builder = FactorBuilder::new(columns.len());
        let Some(&last) = columns.iter().max() else {
            return Ok(Factor { rows: self.rows, ..builder.factor() });
        };
        check_index("column", last, self.columns)?;
        let mut row = vec![0.0; columns.len()];
        for index in 0..=last {
            for (value, &column) in row.iter_mut().zip(columns) {
                *value = if column >= index { self.r[(index, column)] } else { 0.0 };
            }
            builder.push_row(&row)?;
        }
        Ok(Factor { rows: self.rows, ..builder.factor() })
    }

    /// The factor of \[Φ f\] · `map`: columns replaced by linear combinations of them.
    ///
    /// # Errors
    /// `map` does not have one row for each column.
    pub fn combine(&self, map: MatRef<'_, f64>) -> Result<Factor, RegressorError> {
        check_size("rows of the column map", map.nrows(), self.columns)?;
        let product = &self.r * map;
        let mut builder = FactorBuilder::new(map.ncols());
        let mut row = vec![0.0; map.ncols()];
        for index in 0..product.nrows() {
            for (column, value) in row.iter_mut().enumerate() {
                *value = product[(index, column)];
            }
            builder.push_row(&row)?;
        }
        Ok(Factor { rows: self.rows, ..builder.factor() })
    }

    /// The factor of all rows times `weight`.
    pub fn scaled(&self, weight: f64) -> Factor {
        let r = Mat::from_fn(self.columns, self.columns, |row, column| weight.abs() * self.r[(row, column)]);
        Factor { columns: self.columns, rows: self.rows, r }
    }
}
