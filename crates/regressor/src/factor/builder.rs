//! Streaming rows into a triangular factor.

use super::Factor;
use crate::RegressorError;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor::{qr_in_place, qr_in_place_scratch, recommended_block_size};
use faer::{Mat, Par};
use phiw_dynamics::check::{check_index, check_size};

/// Collects rows of \[Φ f\] and folds them into R, a block at a time. Memory does not depend on the number of
/// rows, and nothing is allocated after [`FactorBuilder::new`].
pub struct FactorBuilder {
    columns: usize,
    rows: u64,
    /// R in the first `columns` rows, then the rows that wait; as long as there is no R, the rows that wait
    /// come first.
    work: Mat<f64>,
    /// Rows of `work` that R takes: `columns`, or none before the first QR.
    triangle: usize,
    waiting: usize,
    householder: Mat<f64>,
    stack: MemBuffer,
}

impl FactorBuilder {
    /// For rows of `columns` numbers, the right-hand side included (as the last).
    pub fn new(columns: usize) -> Self {
        // Twice a triangle's rows for each QR: the triangle that is factored again costs a third, and the
        // block stays in the second-level cache.
        let capacity = (2 * columns).max(64);
        let size = columns + capacity;
        let block = recommended_block_size::<f64>(size, columns.max(1)).max(1);
        FactorBuilder {
            columns,
            rows: 0,
            work: Mat::zeros(size, columns),
            triangle: 0,
            waiting: 0,
            householder: Mat::zeros(block, columns),
            stack: MemBuffer::new(qr_in_place_scratch::<f64>(
                size,
                columns,
                block,
                Par::Seq,
                Default::default(),
            )),
        }
    }

    /// Numbers in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Adds one row.
    ///
    /// # Errors
    /// The row has the wrong length, or holds a number that is not finite.
    pub fn push_row(&mut self, row: &[f64]) -> Result<(), RegressorError> {
        self.push_scaled_row(row, 1.0)
    }

    /// Adds one row times `weight` (a row of standard deviation σ has the weight 1/σ).
    ///
    /// # Errors
    /// The row has the wrong length, or holds a number that is not finite.
    pub fn push_scaled_row(&mut self, row: &[f64], weight: f64) -> Result<(), RegressorError> {
        check_size("row of the factor", row.len(), self.columns)?;
        if !(weight.is_finite() && row.iter().all(|value| value.is_finite())) {
            return Err(RegressorError::NotFinite { row: 0 });
        }
        if self.triangle + self.waiting == self.work.nrows() {
            self.fold();
        }
        let target = self.triangle + self.waiting;
        for (column, value) in row.iter().enumerate() {
            self.work[(target, column)] = value * weight;
        }
        self.waiting += 1;
        self.rows += 1;
        Ok(())
    }

    /// Adds a block of rows, row-major.
    ///
    /// # Errors
    /// The block is not whole rows, or holds a number that is not finite.
    pub fn push_rows(&mut self, rows: &[f64]) -> Result<(), RegressorError> {
        if self.columns == 0 {
            return Ok(());
        }
        check_size("block of rows", rows.len() / self.columns * self.columns, rows.len())?;
        for (index, row) in rows.chunks_exact(self.columns).enumerate() {
            self.push_row(row).map_err(|error| match error {
                RegressorError::NotFinite { .. } => RegressorError::NotFinite { row: index },
                other => other,
            })?;
        }
        Ok(())
    }

    /// Adds all the rows that a factor stands for, each times `weight`; its column k becomes column
    /// `columns[k]` here.
    ///
    /// # Errors
    /// `columns` does not name a column of this builder for each column of `factor`.
    pub fn push_factor(
        &mut self,
        factor: &Factor,
        columns: &[usize],
        weight: f64,
    ) -> Result<(), RegressorError> {
        check_size("the columns of a factor to be taken in", columns.len(), factor.columns())?;
        let rows = self.rows + factor.rows();
        let mut row = vec![0.0; self.columns];
        for index in 0..factor.columns() {
            row.fill(0.0);
            let mut says_something = false;
            for column in index..factor.columns() {
                let target = columns[column];
                check_index("column", target, self.columns)?;
                row[target] = factor.entry(index, column);
                says_something |= row[target] != 0.0;
            }
            // The factor of fewer rows than columns has empty ones.
            if says_something {
                self.push_scaled_row(&row, weight)?;
            }
        }
        self.rows = rows;
        Ok(())
    }

    /// The factor of all the rows so far; the builder can go on.
    pub fn factor(&mut self) -> Factor {
        self.fold();
        Factor::from_upper_triangle(&self.work, self.columns, self.rows)
    }

    /// Starts again with no rows.
    pub fn clear(&mut self) {
        self.work.fill(0.0);
        self.triangle = 0;
        self.waiting = 0;
        self.rows = 0;
    }

    fn fold(&mut self) {
        if self.waiting == 0 || self.columns == 0 {
            return;
        }
        // A first block of few rows costs little: what is not there yet is not factored.
        let rows = self.triangle + self.waiting;
        qr_in_place(
            self.work.as_mut().subrows_mut(0, rows),
            self.householder.as_mut().subcols_mut(0, rows.min(self.columns)),
            Par::Seq,
            MemStack::new(&mut self.stack),
            Default::default(),
        );
        // faer's kernels leave the upper halves of the vector registers in use, and on some processors all
        // scalar code after them runs at a third of its speed. A function for wide registers clears them when
        // it returns; a mere fill would not use them.
        let Self { columns, work, .. } = self;
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                for column in 0..*columns {
                    work.col_as_slice_mut(column)[column + 1..*columns]
                        .iter_mut()
                        .for_each(|value| *value *= 0.0);
                }
            },
        );
        self.triangle = self.columns;
        self.waiting = 0;
    }
}
