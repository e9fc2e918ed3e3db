//! Block-banded matrices with a dense border: the normal equations of a spline, and their Cholesky factor in
//! O(N).
//!
//! A spline of degree p couples a control point with the p after it; parameters that all samples share are a
//! dense border. What stands in a control point's columns on and below the diagonal, border included, is a
//! dense panel, and the factor of the matrix has the same panels.

use super::Pattern;
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::{matmul::matmul, triangular_solve};
use faer::{Accum, MatMut, MatRef, Par, Spec};
use phiw_dynamics::dense::dot;
use phiw_dynamics::scalar::Lanes;

/// A symmetric matrix \[H, B'; B, C\]; only what lies on or below the diagonal is used.
#[derive(Clone)]
pub(crate) struct Arrow {
    /// Coordinates of a control point.
    point: usize,
    /// Control points.
    points: usize,
    degree: usize,
    border: usize,
    /// For each control point a column-major panel, [`Self::height`] × `point`: its own block, those of the
    /// `degree` points after it, the border. Blocks of points that there are not stay zero.
    panels: Vec<f64>,
    corner: Vec<f64>,
}

impl Arrow {
    pub fn new(point: usize, points: usize, degree: usize, border: usize) -> Self {
        let height = (degree + 1) * point + border;
        Arrow {
            point,
            points,
            degree,
            border,
            panels: vec![0.0; points * height * point],
            corner: vec![0.0; border * border],
        }
    }

    /// Rows of a panel; one that has none counts as one, so that it can be cut into columns.
    fn height(&self) -> usize {
        ((self.degree + 1) * self.point + self.border).max(1)
    }
    /// Numbers of a panel.
    fn panel(&self) -> usize {
        self.height() * self.point
    }

    pub fn clear(&mut self) {
        self.panels.fill(0.0);
        self.corner.fill(0.0);
    }

    /// Takes over another matrix of the same shape.
    pub fn copy_from(&mut self, other: &Arrow) {
        self.panels.copy_from_slice(&other.panels);
        self.corner.copy_from_slice(&other.corner);
    }

    /// Adds `K` samples of the same control points: of each, `normals` has the upper triangle, row by row, of
    /// `point` rows with `point + border` numbers, with respect to the sample's coordinates and the border's,
    /// as far as `pattern` goes; `products` are what the weights of the control points `first ..` come to in
    /// pairs (row by row, `degree + 1` numbers each), `sums` what they come to by themselves.
    ///
    /// [`Self::mirror`] has to come after the last.
    #[inline(always)]
    pub fn add_windows<const K: usize>(
        &mut self,
        first: usize,
        pattern: &Pattern,
        products: &[Lanes<K>],
        sums: &[Lanes<K>],
        normals: [&[f64]; K],
    ) {
        let (n, order) = (self.point, self.degree + 1);
        let (height, panel, size) = (self.height(), self.panel(), self.point + self.border);
        for low in 0..order {
            let columns = self.panels[(first + low) * panel..][..panel].chunks_exact_mut(height);
            for (c, column) in columns.enumerate() {
                let rows = normals.map(|normal| &normal[c * size..][..size]);
                let [own, edge] = pattern.runs(c);
                for high in low..order {
                    let (block, weights) =
                        (&mut column[(high - low) * n..][..n], products[high * order + low]);
                    for run in own {
                        add_all(&mut block[run.clone()], weights, rows.map(|row| &row[run.clone()]));
                    }
                }
                let target = &mut column[(order - 1) * n..];
                for run in edge {
                    add_all(&mut target[run.clone()], sums[low], rows.map(|row| &row[run.clone()]));
                }
            }
        }
    }

    /// Completes the blocks below the diagonal ones, of which [`Self::add_windows`] fills the lower
    /// triangles: they are symmetric.
    pub fn mirror(&mut self) {
        let (n, height) = (self.point, self.height());
        for panel in self.panels.chunks_exact_mut((height * n).max(1)) {
            for block in 1..=self.degree {
                for column in 0..n {
                    for row in column + 1..n {
                        panel[row * height + block * n + column] = panel[column * height + block * n + row];
                    }
                }
            }
        }
    }

    /// Adds `value` where two of the border's rows meet.
    pub fn add_corner(&mut self, row: usize, column: usize, value: f64) {
        self.corner[row.min(column) * self.border + row.max(column)] += value;
    }

    /// Adds `value` where coordinate `coordinate` of two control points meet.
    pub fn add(&mut self, point: usize, other: usize, coordinate: usize, value: f64) {
        let (high, low) = (point.max(other), point.min(other));
        let row = (high - low) * self.point + coordinate;
        let at = low * self.panel() + coordinate * self.height() + row;
        self.panels[at] += value;
    }

    /// Element on the diagonal, of all variables in a row.
    pub fn diagonal_mut(&mut self, variable: usize) -> &mut f64 {
        let tail = self.points * self.point;
        if variable < tail {
            let at = variable / self.point * self.panel() + variable % self.point * (self.height() + 1);
            &mut self.panels[at]
        } else {
            &mut self.corner[(variable - tail) * (self.border + 1)]
        }
    }

    /// Replaces the matrix by its Cholesky factor; false if it is not positive definite.
    pub fn factor(&mut self) -> bool {
        let (n, degree, border) = (self.point, self.degree, self.border);
        let (height, panel) = (self.height(), self.panel());
        let size = n.max(border);
        let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(
            size,
            Par::Seq,
            Spec::<LltParams, f64>::default(),
        ));
        let stack = MemStack::new(&mut memory);
        for point in 0..self.points {
            let (done, later) = self.panels.split_at_mut((point + 1) * panel);
            let this = MatMut::from_column_major_slice_mut(&mut done[point * panel..], height, n);
            let (mut own, mut below) = this.split_at_row_mut(n);
            if !cholesky(own.as_mut(), stack) {
                return false;
            }
            triangular_solve::solve_lower_triangular_in_place(
                own.as_ref(),
                below.as_mut().transpose_mut(),
                Par::Seq,
            );
            let below = below.as_ref();
            let edge = below.subrows(degree * n, border);
            for (ahead, next) in later.chunks_exact_mut(panel.max(1)).take(degree).enumerate() {
                let next = MatMut::from_column_major_slice_mut(next, height, n);
                let (blocks, next_edge) = next.split_at_row_mut((degree + 1) * n);
                let (own, others) = blocks.subrows_mut(0, (degree - ahead) * n).split_at_row_mut(n);
                let block = below.subrows(ahead * n, n);
                subtract_square(own, block);
                let further = below.subrows((ahead + 1) * n, (degree - ahead - 1) * n);
                matmul(others, Accum::Add, further, block.transpose(), -1.0, Par::Seq);
                matmul(next_edge, Accum::Add, edge, block.transpose(), -1.0, Par::Seq);
            }
            subtract_square(MatMut::from_column_major_slice_mut(&mut self.corner, border, border), edge);
        }
        cholesky(MatMut::from_column_major_slice_mut(&mut self.corner, border, border), stack)
    }

    /// Replaces a right-hand side by the solution; after [`Self::factor`].
    pub fn solve(&self, right: &mut [f64]) {
        // The same loops, compiled for the widest SIMD registers of the machine.
        pulp::Arch::new().dispatch(Substitute { factor: self, right });
    }

    #[inline(always)]
    fn substitute(&self, right: &mut [f64]) {
        let (n, height, panel) = (self.point, self.height(), self.panel());
        let tail = self.points * n;
        let (spline, parameters) = right.split_at_mut(tail);
        // Rows of a panel's blocks that there are.
        let rows = |point: usize| ((self.degree + 1) * n).min(tail - point * n);
        // Leading zeros of the right-hand side contribute nothing and are skipped.
        let begin = spline.iter().position(|&value| value != 0.0).map_or(self.points, |first| first / n);
        for point in begin..self.points {
            let (known, below) = spline[point * n..][..rows(point)].split_at_mut(n);
            for (c, column) in self.panels[point * panel..][..panel].chunks_exact(height).enumerate() {
                known[c] /= column[c];
                let solved = -known[c];
                add_scaled(&mut known[c + 1..], solved, &column[c + 1..n]);
                add_scaled(below, solved, &column[n..]);
                add_scaled(parameters, solved, &column[height - self.border..]);
            }
        }
        let border = self.border;
        for c in 0..border {
            let column = &self.corner[c * border..][..border];
            parameters[c] /= column[c];
            let solved = -parameters[c];
            add_scaled(&mut parameters[c + 1..], solved, &column[c + 1..]);
        }
        for c in (0..border).rev() {
            let column = &self.corner[c * border..][..border];
            parameters[c] = (parameters[c] - dot(&column[c + 1..], &parameters[c + 1..])) / column[c];
        }
        for point in (0..self.points).rev() {
            let (own, below) = spline[point * n..][..rows(point)].split_at_mut(n);
            let columns = self.panels[point * panel..][..panel].chunks_exact(height).enumerate();
            for (c, column) in columns.rev() {
                let known = dot(&column[c + 1..n], &own[c + 1..])
                    + dot(&column[n..], below)
                    + dot(&column[height - border..], parameters);
                own[c] = (own[c] - known) / column[c];
            }
        }
    }
}

/// [`Arrow::substitute`] with its arguments.
struct Substitute<'a> {
    factor: &'a Arrow,
    right: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Substitute<'_> {
    type Output = ();
    #[inline(always)]
    fn call(self) {
        self.factor.substitute(self.right);
    }
}

/// `target` ← `target` + `factor` · `values`, as far as both go.
#[inline(always)]
fn add_scaled(target: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in target.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// `target` ← `target` + Σ `factors` · `values`; all of one length.
#[inline(always)]
fn add_all<const K: usize>(target: &mut [f64], Lanes(factors): Lanes<K>, values: [&[f64]; K]) {
    let length = target.len();
    let values = values.map(|values| &values[..length]);
    for at in 0..length {
        let mut sum = target[at];
        for k in 0..K {
            sum += factors[k] * values[k][at];
        }
        target[at] = sum;
    }
}

/// faer's, in place: the blocks are parts of panels whose columns lie further apart than they are long, and a
/// step of the solver factors hundreds of them with one allocation. (`phiw_dynamics::dense::Cholesky` owns
/// its triangle.)
fn cholesky(matrix: MatMut<'_, f64>, stack: &mut MemStack) -> bool {
    cholesky_in_place(matrix, LltRegularization::default(), Par::Seq, stack, Spec::default()).is_ok()
}

/// Lower triangle of `target` ← `target` − A·Aᵀ.
fn subtract_square(target: MatMut<'_, f64>, a: MatRef<'_, f64>) {
    let (lower, full) = (BlockStructure::TriangularLower, BlockStructure::Rectangular);
    triangular::matmul(target, lower, Accum::Add, a, full, a.transpose(), full, -1.0, Par::Seq);
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
                let products: Vec<f64> = weights.iter().flat_map(|a| weights.iter().map(move |b| a * b)).collect();
                let one = |values: &[f64]| values.iter().map(|&value| Lanes([value])).collect::<Vec<_>>();
                arrow.add_windows(first, &Pattern::dense(point, border), &one(&products), &one(&weights), [&normal]);
                for row in 0..border {
                    (row..border).for_each(|c| arrow.add_corner(row, c, normal[(point + row) * size + point + c]));
                }
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
            arrow.mirror();
            for i in 0..all {
                *arrow.diagonal_mut(i) += 0.5;
                dense[(i, i)] += 0.5;
            }
            arrow.add(1, 0, 0, 0.01);
            dense[(point, 0)] += 0.01;
            dense[(0, point)] += 0.01;
            prop_assert!(arrow.factor());
            let mut solution: Vec<f64> = (0..all).map(|i| right[(i, 0)]).collect();
            arrow.solve(&mut solution);
            let residual = &dense * faer::Mat::from_fn(all, 1, |i, _| solution[i]) - &right;
            prop_assert!(residual.norm_max() < 1e-10);
        }
    }
}
