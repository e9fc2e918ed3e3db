//! Newton's equations in coordinates in which every body's barrier is the unit matrix.
//!
//! A body's change of pseudo-inertia is G·Y·Gᵀ, and its ten coordinates are those of Y in an orthonormal
//! basis of the symmetric matrices. Extras are scaled by the diagonal of the equations. AᵀA enters Newton's
//! matrix only; gradients come from the residual, so what AᵀA loses in digits costs iterations, not accuracy.

use crate::constraint::Equality;
use crate::problem::Problem;
use crate::pseudo_inertia::parameters_of;
use crate::small_matrix::Square;
use faer::linalg::solvers::{Llt, Solve};
use faer::{Mat, Side};
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

const TEN: usize = crate::PARAMETERS_PER_BODY;
/// The pairs of axes off the diagonal, in the order of coordinates five to ten.
const PAIRS: [(usize, usize); 6] = [(0, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3)];
/// Weight of a penalty on extras in units of their columns' squares: it keeps combinations that the data do
/// not tell at zero, and is too small to move any that they do.
const RIDGE: f64 = 1e-12;

/// Coordinates of a symmetric 4×4 matrix.
pub(crate) fn coordinates(matrix: &Square) -> [f64; TEN] {
    std::array::from_fn(|index| match index {
        0..4 => matrix.at(index, index),
        _ => SQRT_2 * matrix.at(PAIRS[index - 4].0, PAIRS[index - 4].1),
    })
}

/// The symmetric 4×4 matrix with these coordinates.
pub(crate) fn matrix_of(coordinates: &[f64]) -> Square {
    let mut matrix = Square::zeros(4);
    for axis in 0..4 {
        matrix.set(axis, axis, coordinates[axis]);
    }
    for (&(row, column), value) in PAIRS.iter().zip(&coordinates[4..]) {
        matrix.set(row, column, FRAC_1_SQRT_2 * value);
        matrix.set(column, row, FRAC_1_SQRT_2 * value);
    }
    matrix
}

/// The penalty's weight on each extra.
pub(crate) fn ridge(problem: &Problem) -> Vec<f64> {
    let first = problem.unknowns() - problem.extras;
    let weight = |extra: usize| match problem.gram[(first + extra, first + extra)] {
        norm if norm > 0.0 => RIDGE * norm,
        _ => 1.0,
    };
    (0..problem.extras).map(weight).collect()
}

/// The change of coordinates.
pub(crate) struct Frame {
    /// For each body, its standard parameters' change along each coordinate: column by column.
    bodies: Vec<[[f64; TEN]; TEN]>,
}

impl Frame {
    pub fn new<'a>(scalings: impl Iterator<Item = &'a Square>) -> Self {
        let of_body = |scaling: &Square| {
            std::array::from_fn(|index| {
                let mut unit = [0.0; TEN];
                unit[index] = 1.0;
                parameters_of(&scaling.congruence(&matrix_of(&unit)))
            })
        };
        Frame { bodies: scalings.map(of_body).collect() }
    }

    /// A gradient by the unknowns as one by the coordinates.
    pub fn pull(&self, gradient: &[f64]) -> Vec<f64> {
        let mut pulled = gradient.to_vec();
        for (body, columns) in self.bodies.iter().enumerate() {
            let own = &gradient[TEN * body..TEN * (body + 1)];
            for (index, column) in columns.iter().enumerate() {
                pulled[TEN * body + index] = dot(column, own);
            }
        }
        pulled
    }

    /// A direction in coordinates as one of the unknowns.
    pub fn push(&self, direction: &[f64]) -> Vec<f64> {
        let mut pushed = direction.to_vec();
        for (body, columns) in self.bodies.iter().enumerate() {
            let own = &direction[TEN * body..TEN * (body + 1)];
            let target = &mut pushed[TEN * body..TEN * (body + 1)];
            target.fill(0.0);
            for (column, factor) in columns.iter().zip(own) {
                target.iter_mut().zip(column).for_each(|(value, entry)| *value += factor * entry);
            }
        }
        pushed
    }

    /// A symmetric matrix over the unknowns in coordinates.
    fn congruence(&self, matrix: &Mat<f64>) -> Mat<f64> {
        let size = matrix.nrows();
        let mut half = Mat::zeros(size, size);
        for column in 0..size {
            let pulled = self.pull(matrix.col_as_slice(column));
            half.col_as_slice_mut(column).copy_from_slice(&pulled);
        }
        let mut whole = Mat::zeros(size, size);
        let half = half.transpose().to_owned();
        for column in 0..size {
            let pulled = self.pull(half.col_as_slice(column));
            whole.col_as_slice_mut(column).copy_from_slice(&pulled);
        }
        whole
    }
}

/// Newton's equations with their factor.
pub(crate) struct Equations {
    frame: Frame,
    factor: Llt<f64>,
    /// Diagonal scaling of the coordinates.
    scales: Vec<f64>,
    /// E in scaled coordinates, one column for each equality, after the factor's solve: H⁻¹Eᵀ.
    equalities: Option<Equalities>,
}

struct Equalities {
    columns: Mat<f64>,
    solved: Mat<f64>,
    schur: Llt<f64>,
}

/// A step in coordinates and what belongs to it.
pub(crate) struct Step {
    /// The direction of the unknowns.
    pub unknowns: Vec<f64>,
    /// The same in coordinates.
    pub coordinates: Vec<f64>,
    /// Multipliers of the equalities.
    pub multipliers: Vec<f64>,
}

impl Equations {
    /// `hessian` is over the unknowns, without the bodies' barrier, whose weight in coordinates is `barrier`.
    /// None if nothing finite comes out.
    pub fn new(frame: Frame, hessian: &Mat<f64>, barrier: f64, equalities: &[Equality]) -> Option<Self> {
        let mut matrix = frame.congruence(hessian);
        let size = matrix.nrows();
        for coordinate in 0..TEN * frame.bodies.len() {
            matrix[(coordinate, coordinate)] += barrier;
        }
        let scale = |index: usize| 1.0 / matrix[(index, index)].max(f64::MIN_POSITIVE).sqrt();
        let scales: Vec<f64> = (0..size).map(scale).collect();
        let scaled =
            Mat::from_fn(size, size, |row, column| scales[row] * matrix[(row, column)] * scales[column]);
        let factor = factor_of(&scaled)?;
        let equalities = match equalities {
            [] => None,
            all => {
                let mut columns = Mat::zeros(size, all.len());
                for (index, equality) in all.iter().enumerate() {
                    let mut row = vec![0.0; size];
                    equality.coefficients.iter().for_each(|(unknown, value)| row[*unknown] += value);
                    let row = frame.pull(&row);
                    (0..size).for_each(|place| columns[(place, index)] = scales[place] * row[place]);
                }
                let solved = factor.solve(&columns);
                let schur = factor_of(&(columns.transpose() * &solved))?;
                Some(Equalities { columns, solved, schur })
            }
        };
        Some(Equations { frame, factor, scales, equalities })
    }

    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// H·d + Eᵀν = −gradient, E·d = missing; the gradient is by the coordinates.
    pub fn step(&self, gradient: &[f64], missing: &[f64]) -> Step {
        let size = gradient.len();
        let right = Mat::from_fn(size, 1, |row, _| -self.scales[row] * gradient[row]);
        let mut solution = self.factor.solve(&right);
        let mut multipliers = vec![0.0; missing.len()];
        if let Some(equalities) = &self.equalities {
            let reached = equalities.columns.transpose() * &solution;
            let excess = Mat::from_fn(missing.len(), 1, |row, _| reached[(row, 0)] - missing[row]);
            let found = equalities.schur.solve(&excess);
            solution -= &equalities.solved * &found;
            multipliers.iter_mut().enumerate().for_each(|(row, value)| *value = found[(row, 0)]);
        }
        let coordinates: Vec<f64> = (0..size).map(|row| self.scales[row] * solution[(row, 0)]).collect();
        Step { unknowns: self.frame.push(&coordinates), coordinates, multipliers }
    }
}

/// Cholesky's factor of a matrix with unit diagonal, made a little heavier where rounding has left it
/// indefinite.
fn factor_of(matrix: &Mat<f64>) -> Option<Llt<f64>> {
    let mut shift = 0.0;
    for _ in 0..8 {
        let mut heavier = matrix.clone();
        for index in 0..matrix.nrows() {
            heavier[(index, index)] += shift * matrix[(index, index)].abs().max(f64::MIN_POSITIVE);
        }
        if let Ok(factor) = heavier.llt(Side::Lower) {
            return Some(factor);
        }
        shift = if shift == 0.0 { 1e-14 } else { 10.0 * shift };
    }
    None
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
