//! −log L of the periods of one joint, as a function of its frictions' parameters.

use super::turning_response::LEAST;
use phiw_dynamics::dense::{Cholesky, dot};
use std::ops::Range;

/// Newton steps at most for the parameters of one friction, and the decrement at which they are found
/// \[−log L\].
const MOST_STEPS: usize = 12;
const SETTLED: f64 = 1e-3;
/// Times at most that a step is halved.
const MOST_HALVINGS: usize = 20;

/// −log L of a joint's periods as a function of some of its parameters θ: ½p·Σ(r + c·θ)² − Σ log(1 + (δ +
/// s·θ)·ρ), convex.
pub(super) struct JointRows {
    count: usize,
    /// 1/σ² of the torque.
    precision: f64,
    /// r of each period, and c of each parameter in it.
    left: Vec<f64>,
    columns: Vec<f64>,
    /// δ·ρ of the periods in which it or a slope is anything, and s·ρ of each parameter in them.
    deltas: Vec<f64>,
    slopes: Vec<f64>,
}

impl JointRows {
    /// None yet, of `count` parameters.
    pub fn new(count: usize, precision: f64) -> Self {
        let [left, columns, deltas, slopes] = Default::default();
        JointRows { count, precision, left, columns, deltas, slopes }
    }

    /// Adds a period: what is left and δ, the columns and s of the parameters, and ρ.
    pub fn push(&mut self, [left, delta]: [f64; 2], columns: &[[f64; 2]], felt: f64) {
        self.left.push(left);
        self.columns.extend(columns.iter().map(|[value, _]| value));
        if delta != 0.0 || columns.iter().any(|[_, slope]| *slope != 0.0) {
            self.deltas.push(felt * delta);
            self.slopes.extend(columns.iter().map(|[_, slope]| felt * slope));
        }
    }

    /// For each period: what is left under these values, and the place of its columns.
    fn left<'a>(&'a self, values: &'a [f64]) -> impl Iterator<Item = (f64, Range<usize>)> + 'a {
        of_rows(&self.left, &self.columns, values)
    }

    /// −log L under these values.
    pub fn cost(&self, values: &[f64]) -> f64 {
        let squares: f64 = self.left(values).map(|(left, _)| left * left).sum();
        let factor = |(delta, _): (f64, _)| (delta.max(-LEAST)).ln_1p();
        0.5 * self.precision * squares - of_rows(&self.deltas, &self.slopes, values).map(factor).sum::<f64>()
    }

    /// Damped Newton steps from `values` to the smallest cost.
    pub fn minimize(&self, values: &mut [f64]) {
        let mut cost = self.cost(values);
        for _ in 0..MOST_STEPS {
            let (gradient, hessian) = self.derivatives(values);
            let Some(factor) = Cholesky::of(self.count, |row, column| hessian[row * self.count + column])
            else {
                return;
            };
            let mut step = gradient.clone();
            factor.solve_lower(&mut step);
            factor.solve_upper(&mut step);
            if dot(&step, &gradient) < SETTLED {
                return;
            }
            let mut length = 1.0;
            let shorter = |_| {
                let moved: Vec<f64> =
                    values.iter().zip(&step).map(|(value, step)| value - length * step).collect();
                length *= 0.5;
                let cost = self.cost(&moved);
                (cost, moved)
            };
            let Some((lower, moved)) = (0..MOST_HALVINGS).map(shorter).find(|(next, _)| *next < cost) else {
                return;
            };
            cost = lower;
            values.copy_from_slice(&moved);
        }
    }

    /// Gradient and curvature of the cost.
    fn derivatives(&self, values: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut gradient = vec![0.0; self.count];
        let mut hessian = vec![0.0; self.count * self.count];
        let mut add = |columns: &[f64], slope: f64, curvature: f64| {
            for (row, own) in columns.iter().enumerate() {
                gradient[row] += slope * own;
                for (column, other) in columns.iter().enumerate() {
                    hessian[row * columns.len() + column] += curvature * own * other;
                }
            }
        };
        for (left, place) in self.left(values) {
            add(&self.columns[place], self.precision * left, self.precision);
        }
        for (delta, place) in of_rows(&self.deltas, &self.slopes, values) {
            let share = 1.0 / (1.0 + delta.max(-LEAST));
            add(&self.slopes[place], -share, share * share);
        }
        (gradient, hessian)
    }
}

/// For each row, its constant and the product of its columns with the values, and the place of its columns.
fn of_rows<'a>(
    constants: &'a [f64],
    columns: &'a [f64],
    values: &'a [f64],
) -> impl Iterator<Item = (f64, Range<usize>)> + 'a {
    constants.iter().enumerate().map(move |(row, constant)| {
        let place = row * values.len()..(row + 1) * values.len();
        (constant + dot(&columns[place.clone()], values), place)
    })
}
