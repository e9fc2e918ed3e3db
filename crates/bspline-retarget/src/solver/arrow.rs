//! Block-tridiagonal matrices with a dense border: the normal equations of a spline, and their Cholesky factor in O(N).
//!
//! A spline of degree p makes a control point meet the p before it. With p control points to a block the matrix is
//! block-tridiagonal; parameters that all samples share are a dense border.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::{matmul::matmul, triangular_solve};
use faer::{Accum, MatMut, MatRef, Par, Spec};

/// A symmetric matrix \[H, B'; B, C\] with a right-hand side; only what lies on or below the diagonal is used.
#[derive(Clone)]
pub(crate) struct Arrow {
    /// Coordinates of a control point.
    point: usize,
    /// Control points.
    points: usize,
    /// Control points in a block.
    group: usize,
    border_size: usize,
    /// Column-major blocks: on the diagonal, below it, and of the border (border × block).
    diagonal: Vec<f64>,
    below: Vec<f64>,
    border: Vec<f64>,
    corner: Vec<f64>,
    /// Gradient: control points, then border.
    pub gradient: Vec<f64>,
}

impl Arrow {
    pub fn new(point: usize, points: usize, degree: usize, border_size: usize) -> Self {
        let group = degree.max(1);
        let (block, blocks) = (group * point, points.div_ceil(group));
        Arrow {
            point,
            points,
            group,
            border_size,
            diagonal: vec![0.0; blocks * block * block],
            below: vec![0.0; blocks.saturating_sub(1) * block * block],
            border: vec![0.0; blocks * block * border_size],
            corner: vec![0.0; border_size * border_size],
            gradient: vec![0.0; points * point + border_size],
        }
    }

    fn block(&self) -> usize {
        self.group * self.point
    }
    fn blocks(&self) -> usize {
        self.points.div_ceil(self.group)
    }

    pub fn clear(&mut self) {
        for values in
            [&mut self.diagonal, &mut self.below, &mut self.border, &mut self.corner, &mut self.gradient]
        {
            values.fill(0.0);
        }
    }

    /// Takes over another matrix of the same shape.
    pub fn copy_from(&mut self, other: &Arrow) {
        self.diagonal.copy_from_slice(&other.diagonal);
        self.below.copy_from_slice(&other.below);
        self.border.copy_from_slice(&other.border);
        self.corner.copy_from_slice(&other.corner);
        self.gradient.copy_from_slice(&other.gradient);
    }

    /// Adds a sample `count` times: `normal` is row by row, `size × size` with `size = point + border`; its first `point` rows are
    /// read. `gradient` has `size` elements. Both are with respect to the sample's own coordinates, which are `weights` times
    /// the control points `first ..`, and to the border's.
    pub fn add_sample(
        &mut self,
        first: usize,
        weights: &[f64],
        count: f64,
        normal: &[f64],
        gradient: &[f64],
    ) {
        // The same loops, compiled for the registers that this machine has.
        pulp::Arch::new().dispatch(AddSample { arrow: self, first, weights, count, normal, gradient });
        let tail = self.points * self.point;
        add_scaled(&mut self.gradient[tail..], count, &gradient[self.point..]);
    }

    #[inline(always)]
    fn add_points(&mut self, first: usize, weights: &[f64], count: f64, normal: &[f64], gradient: &[f64]) {
        let (n, size, block, border) =
            (self.point, self.point + self.border_size, self.block(), self.border_size);
        for (i, &wi) in weights.iter().enumerate() {
            let wi = count * wi;
            let (row_block, row) = ((first + i) / self.group, (first + i) % self.group * n);
            for (j, &wj) in weights[..=i].iter().enumerate() {
                let (column_block, column) = ((first + j) / self.group, (first + j) % self.group * n);
                let target = if row_block == column_block {
                    &mut self.diagonal[row_block * block * block..][..block * block]
                } else {
                    &mut self.below[column_block * block * block..][..block * block]
                };
                for c in 0..n {
                    add_scaled(
                        &mut target[(column + c) * block + row..][..n],
                        wi * wj,
                        &normal[c * size..][..n],
                    );
                }
            }
            let target = &mut self.border[row_block * block * border..][..block * border];
            for c in 0..n {
                add_scaled(
                    &mut target[(row + c) * border..][..border],
                    wi,
                    &normal[c * size + n..][..border],
                );
            }
            add_scaled(&mut self.gradient[(first + i) * n..][..n], wi, &gradient[..n]);
        }
    }

    /// Adds what parameters have with parameters: the upper triangle of the last rows of `normal`, `count` times.
    pub fn add_corner(&mut self, count: f64, normal: &[f64]) {
        let (n, border) = (self.point, self.border_size);
        let size = n + border;
        for c in 0..border {
            add_scaled(
                &mut self.corner[c * border..][..border],
                count,
                &normal[(n + c) * size + n..][..border],
            );
        }
    }

    /// Adds `value` where coordinate `coordinate` of two control points meet.
    pub fn add(&mut self, point: usize, other: usize, coordinate: usize, value: f64) {
        let (high, low, block) = (point.max(other), point.min(other), self.block());
        let row = high % self.group * self.point + coordinate;
        let column = low % self.group * self.point + coordinate;
        let (row_block, column_block) = (high / self.group, low / self.group);
        let target = if row_block == column_block { &mut self.diagonal } else { &mut self.below };
        target[column_block * block * block + column * block + row] += value;
    }

    /// Element on the diagonal, of all variables in a row.
    pub fn diagonal_mut(&mut self, variable: usize) -> &mut f64 {
        let (block, tail) = (self.block(), self.points * self.point);
        if variable < tail {
            let (index, inner) = (variable / block, variable % block);
            &mut self.diagonal[index * block * block + inner * (block + 1)]
        } else {
            &mut self.corner[(variable - tail) * (self.border_size + 1)]
        }
    }

    /// Replaces the matrix by its Cholesky factor and the gradient g by H⁻¹g; false if it is not positive definite.
    pub fn solve(&mut self) -> bool {
        self.factor() && {
            self.substitute();
            true
        }
    }

    fn factor(&mut self) -> bool {
        let (block, blocks, border) = (self.block(), self.blocks(), self.border_size);
        // The last block may have rows that no control point has.
        for unused in self.points * self.point..blocks * block {
            let (index, inner) = (unused / block, unused % block);
            self.diagonal[index * block * block + inner * (block + 1)] = 1.0;
        }
        for index in 0..blocks {
            let (done, next) = self.diagonal.split_at_mut((index + 1) * block * block);
            let diagonal = &mut done[index * block * block..];
            if !cholesky(diagonal, block) {
                return false;
            }
            let factor = MatRef::from_column_major_slice(diagonal, block, block);
            let (done, next_border) = self.border.split_at_mut((index + 1) * block * border);
            let this_border = &mut done[index * block * border..];
            right_solve(factor, MatMut::from_column_major_slice_mut(this_border, border, block));
            let this_border = MatRef::from_column_major_slice(this_border, border, block);
            subtract_square(
                MatMut::from_column_major_slice_mut(&mut self.corner, border, border),
                this_border,
            );
            if index + 1 < blocks {
                let below = &mut self.below[index * block * block..][..block * block];
                right_solve(factor, MatMut::from_column_major_slice_mut(below, block, block));
                let below = MatRef::from_column_major_slice(below, block, block);
                let next = &mut next[..block * block];
                subtract_square(MatMut::from_column_major_slice_mut(next, block, block), below);
                let next = &mut next_border[..block * border];
                let next = MatMut::from_column_major_slice_mut(next, border, block);
                matmul(next, Accum::Add, this_border, below.transpose(), -1.0, Par::Seq);
            }
        }
        cholesky(&mut self.corner, border)
    }

    fn substitute(&mut self) {
        let (block, blocks, border) = (self.block(), self.blocks(), self.border_size);
        let tail = self.points * self.point;
        let mut right = vec![0.0; blocks * block + border];
        right[..tail].copy_from_slice(&self.gradient[..tail]);
        right[blocks * block..].copy_from_slice(&self.gradient[tail..]);
        let (spline, parameters) = right.split_at_mut(blocks * block);
        let diagonal = |index: usize| &self.diagonal[index * block * block..][..block * block];
        let below = |index: usize| &self.below[index * block * block..][..block * block];
        let edge = |index: usize| &self.border[index * block * border..][..block * border];
        for index in 0..blocks {
            let (this, next) = spline[index * block..].split_at_mut(block);
            forward(diagonal(index), this);
            if index + 1 < blocks {
                subtract_product(below(index), this, &mut next[..block]);
            }
            subtract_product(edge(index), this, parameters);
        }
        forward(&self.corner, parameters);
        backward(&self.corner, parameters);
        for index in (0..blocks).rev() {
            let (this, next) = spline[index * block..].split_at_mut(block);
            subtract_transposed(edge(index), parameters, this);
            if index + 1 < blocks {
                subtract_transposed(below(index), &next[..block], this);
            }
            backward(diagonal(index), this);
        }
        self.gradient[..tail].copy_from_slice(&spline[..tail]);
        self.gradient[tail..].copy_from_slice(parameters);
    }
}

/// [`Arrow::add_points`] with its arguments: what a closure would be, but inlined where the registers are known.
struct AddSample<'a> {
    arrow: &'a mut Arrow,
    first: usize,
    weights: &'a [f64],
    count: f64,
    normal: &'a [f64],
    gradient: &'a [f64],
}

impl pulp::NullaryFnOnce for AddSample<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.arrow.add_points(self.first, self.weights, self.count, self.normal, self.gradient);
    }
}

/// `target` ← `target` + `factor` · `values`.
#[inline(always)]
fn add_scaled(target: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in target.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

fn cholesky(matrix: &mut [f64], size: usize) -> bool {
    let mut memory =
        MemBuffer::new(cholesky_in_place_scratch::<f64>(size, Par::Seq, Spec::<LltParams, f64>::default()));
    let matrix = MatMut::from_column_major_slice_mut(matrix, size, size);
    let stack = MemStack::new(&mut memory);
    cholesky_in_place(matrix, LltRegularization::default(), Par::Seq, stack, Spec::default()).is_ok()
}

/// `matrix` ← `matrix` · L⁻ᵀ.
fn right_solve(factor: MatRef<'_, f64>, matrix: MatMut<'_, f64>) {
    triangular_solve::solve_lower_triangular_in_place(factor, matrix.transpose_mut(), Par::Seq);
}

/// Lower triangle of `target` ← `target` − A·Aᵀ.
fn subtract_square(target: MatMut<'_, f64>, a: MatRef<'_, f64>) {
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    triangular::matmul(target, lower, Accum::Add, a, full, a.transpose(), full, -1.0, Par::Seq);
}

/// `target` ← `target` − A·x, A column-major.
fn subtract_product(a: &[f64], x: &[f64], target: &mut [f64]) {
    let rows = target.len();
    for (column, &x) in x.iter().enumerate() {
        for (sum, value) in target.iter_mut().zip(&a[column * rows..][..rows]) {
            *sum -= value * x;
        }
    }
}

/// `target` ← `target` − Aᵀ·x, A column-major.
fn subtract_transposed(a: &[f64], x: &[f64], target: &mut [f64]) {
    let rows = x.len();
    for (column, sum) in target.iter_mut().enumerate() {
        *sum -= a[column * rows..][..rows].iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
    }
}

/// x ← L⁻¹x.
fn forward(factor: &[f64], x: &mut [f64]) {
    let size = x.len();
    for column in 0..size {
        let values = &factor[column * size..][..size];
        x[column] /= values[column];
        let solved = x[column];
        for row in column + 1..size {
            x[row] -= values[row] * solved;
        }
    }
}

/// x ← L⁻ᵀx.
fn backward(factor: &[f64], x: &mut [f64]) {
    let size = x.len();
    for column in (0..size).rev() {
        let values = &factor[column * size..][..size];
        let known: f64 = (column + 1..size).map(|row| values[row] * x[row]).sum();
        x[column] = (x[column] - known) / values[column];
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Against the dense matrix put together sample by sample, solved by faer.
        #[test]
        fn arrow_solves_like_dense(
            point in 1usize..4, points in 2usize..12, degree in 1usize..4, border in 0usize..4, seed in 0u64..1000,
        ) {
            prop_assume!(points > degree);
            let mut state = seed;
            let mut random = move || {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            let (size, all) = (point + border, points * point + border);
            let mut arrow = Arrow::new(point, points, degree, border);
            let mut dense = faer::Mat::<f64>::zeros(all, all);
            let mut right = faer::Mat::<f64>::zeros(all, 1);
            for sample in 0..4 * points {
                let first = sample % (points - degree);
                let weights: Vec<f64> = (0..=degree).map(|_| random()).collect();
                let jacobian: Vec<f64> = (0..size).map(|_| random()).collect();
                let normal: Vec<f64> = (0..size * size).map(|i| jacobian[i / size] * jacobian[i % size]).collect();
                arrow.add_sample(first, &weights, 1.0, &normal, &jacobian);
                arrow.add_corner(1.0, &normal);
                let mut row = vec![0.0; all];
                for (i, weight) in weights.iter().enumerate() {
                    (0..point).for_each(|c| row[(first + i) * point + c] += weight * jacobian[c]);
                }
                (0..border).for_each(|c| row[points * point + c] += jacobian[point + c]);
                for i in 0..all {
                    right[(i, 0)] += row[i];
                    (0..all).for_each(|j| dense[(i, j)] += row[i] * row[j]);
                }
            }
            for i in 0..all {
                *arrow.diagonal_mut(i) += 0.5;
                dense[(i, i)] += 0.5;
            }
            arrow.add(1, 0, 0, 0.01);
            dense[(point, 0)] += 0.01;
            dense[(0, point)] += 0.01;
            prop_assert!(arrow.solve());
            let residual = &dense * faer::Mat::from_fn(all, 1, |i, _| arrow.gradient[i]) - &right;
            prop_assert!(residual.norm_max() < 1e-10);
        }
    }
}
