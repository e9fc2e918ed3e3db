//! What frictions that turn within a period add to the log-determinant of its motion.
//!
//! A torque of one that is held over a period T changes the velocity of a joint at its end by T·ρ, ρ =
//! nᵀA⁻¹φ₁(X)n with what the joint moves by with each direction, n, and X and φ₁ as in [`super::response`].
//! Of a friction between two joints the joint is the shaft that turns with the sum of both, n the sum of
//! theirs.
//! A friction that turns adds δ = Σ w_p·T·dc̄_p/dv₁, and by how much it changes what damping takes, to what
//! its joint asks for, so that the determinant of the period is larger by the factor det(1 + H·Δ): Δ has the
//! δ of each joint, and H what a torque on one does to the velocity of another, NᵀG⁻¹N with G = A + ½T·F,
//! scaled to have the ρ on its diagonal. A joint that sticks has a large δ: of those that stick the
//! determinant tells the friction, and of the inertia only what the others feel. How the scale follows from
//! the inertia is not counted in the derivatives.

use super::sensitivity::{packed, place};
use super::turning::Turned;
use faer::Mat;
use phiw_dynamics::dense::{Cholesky, dot};
use std::borrow::Borrow;

/// δ is never less than so many times −1/ρ: a friction that pushes along is none, but a search may pass
/// there.
pub(super) const LEAST: f64 = 0.9;

/// δ·ρ from which on an axis turns together with others that do; below, each turns as if no other did.
const COUPLED: f64 = 0.02;

/// What is added to H's diagonal, over its largest element.
const LEAST_RESPONSE: f64 = 1e-6;

/// An axis that a friction turns with: a joint, or the sum of several; as the inertia of an instant has it.
pub(super) struct TurningAxis {
    /// ρ: by how much a torque of one changes its velocity in a period, over the period.
    pub velocity: f64,
    /// The same if it were not damped.
    pub acceleration: f64,
    /// G⁻¹n.
    pub moved: Vec<f64>,
    /// n.
    pub toward: Vec<f64>,
}

/// The share of frictions that turn, in the mean of the rows that an instant stands for.
#[derive(Clone)]
pub(super) struct TurningResponse {
    /// Mean of log det(1 + H·Δ).
    pub log_determinant: f64,
    /// G⁻¹N of the axes that turn, scaled, `[direction × axis]`.
    moved: Mat<f64>,
    /// Its derivatives by H.
    by_response: Mat<f64>,
    /// Parameters of the columns.
    parameters: Vec<usize>,
    /// Its derivatives by the parameters.
    by_parameter: Vec<f64>,
    /// Less its derivatives by a parameter and by H, for each parameter.
    across: Vec<Mat<f64>>,
    /// Less its second derivatives by the parameters of the same axis, `[column × column]`.
    curvature: Mat<f64>,
}

impl TurningResponse {
    /// Of frictions under parameters `w`; the instant stands for `weight` rows.
    pub fn of(turned: &Turned, axes: &[TurningAxis], w: &Mat<f64>, weight: f64) -> Self {
        let (moved, response) = responses(axes);
        let parameters: Vec<usize> = turned.columns.iter().map(|(parameter, _)| *parameter).collect();
        let (count, own) = (axes.len(), parameters.len());
        let mut sum = TurningResponse {
            log_determinant: 0.0,
            moved,
            by_response: Mat::zeros(count, count),
            by_parameter: vec![0.0; own],
            across: vec![Mat::zeros(count, count); own],
            curvature: Mat::zeros(own, own),
            parameters,
        };
        let of_axis = |axis: usize| -> Vec<usize> {
            (0..own).filter(|&index| turned.columns[index].1 == axis).collect()
        };
        let of_axes: Vec<Vec<usize>> = (0..count).map(of_axis).collect();
        let mut together = Vec::with_capacity(count);
        let mut deltas = vec![0.0; count];
        for (slopes, offsets) in turned.slopes.chunks_exact(own).zip(turned.offsets.chunks_exact(own)) {
            for (axis, columns) in of_axes.iter().enumerate() {
                let own = |&index: &usize| slopes[index] * w[(sum.parameters[index], 0)] + offsets[index];
                deltas[axis] = columns.iter().map(own).sum();
            }
            turning_together(&mut deltas, &response, &mut together);
            let row = Row::of(&together, &response);
            if let Some(row) = &row {
                sum.log_determinant += row.log_determinant / weight;
            }
            for (axis, columns) in of_axes.iter().enumerate() {
                if columns.iter().all(|&index| slopes[index] == 0.0 && offsets[index] == 0.0) {
                    continue;
                }
                let place = together.iter().position(|(own, _)| *own == axis);
                match row.as_ref().zip(place) {
                    Some((row, place)) => {
                        sum.add_together((slopes, columns), (&together, place), row, weight)
                    }
                    None => {
                        let (alone, delta) = (response[(axis, axis)], deltas[axis]);
                        sum.add_alone((slopes, columns), (axis, delta), alone, weight);
                    }
                }
            }
        }
        sum
    }

    /// Adds an axis that turns in a row as if no other did; `alone` is its ρ.
    fn add_alone(
        &mut self,
        (slopes, columns): (&[f64], &[usize]),
        (axis, delta): (usize, f64),
        alone: f64,
        weight: f64,
    ) {
        let factor = 1.0 + delta * alone;
        self.log_determinant += factor.ln() / weight;
        self.by_response[(axis, axis)] += delta / (factor * weight);
        for &index in columns {
            let slope = slopes[index] / weight;
            self.by_parameter[index] += slope * alone / factor;
            self.across[index][(axis, axis)] += slope / (factor * factor);
            for &other in columns {
                self.curvature[(index, other)] += slope * slopes[other] * (alone / factor).powi(2);
            }
        }
    }

    /// Adds the derivatives of the axis at a `place` of those that turn `together` in a row.
    fn add_together(
        &mut self,
        (slopes, columns): (&[f64], &[usize]),
        (together, place): (&[(usize, f64)], usize),
        row: &Row,
        weight: f64,
    ) {
        let (axis, delta) = together[place];
        for (b, &(other, other_delta)) in together.iter().enumerate() {
            let own = if place == b { delta } else { 0.0 };
            self.by_response[(axis, other)] += (own - delta * row.at(place, b) * other_delta) / weight;
        }
        // The axis's row of 1 − K·Δ.
        let through = |b: usize| f64::from(u8::from(place == b)) - row.at(place, b) * together[b].1;
        let own = row.at(place, place);
        for &index in columns.iter().filter(|index| slopes[**index] != 0.0) {
            let slope = slopes[index] / weight;
            self.by_parameter[index] += slope * own;
            for (b, (left, _)) in together.iter().enumerate() {
                let share = slope * through(b);
                for (c, (right, _)) in together.iter().enumerate() {
                    self.across[index][(*left, *right)] += share * through(c);
                }
            }
            for &other in columns {
                self.curvature[(index, other)] += slope * slopes[other] * own * own;
            }
        }
    }

    /// M·S·Mᵀ of a symmetric S over the axes, packed.
    fn packed(&self, over_axes: &Mat<f64>) -> Mat<f64> {
        let whole = &self.moved * over_axes * self.moved.transpose();
        let mut column = Mat::zeros(packed(whole.nrows()), 1);
        for row in 0..whole.nrows() {
            for other in 0..=row {
                let scale = if row == other { 1.0 } else { std::f64::consts::SQRT_2 };
                column[(place(row, other), 0)] = scale * whole[(row, other)];
            }
        }
        column
    }

    /// Adds its derivatives by the inertia and by the damping to packed slopes.
    pub fn add_slopes(&self, slopes: &mut [Mat<f64>; 2]) {
        let by_inertia = self.packed(&self.by_response);
        slopes[0] -= &by_inertia;
        slopes[1] -= by_inertia * faer::Scale(0.5);
    }

    /// Adds its derivatives by the parameters from `first` on that it has through no inertia.
    pub fn add_gradient(&self, first: usize, gradient: &mut Mat<f64>) {
        for (&parameter, slope) in self.parameters.iter().zip(&self.by_parameter) {
            if let Some(place) = parameter.checked_sub(first) {
                gradient[(place, 0)] += slope;
            }
        }
    }

    /// Adds `weight` times less its second derivatives, for all parameters and those from `first` on: those
    /// by two parameters of an axis, and by one and the inertia. Another determinant outweighs those by the
    /// inertia alone. `columns` are the packed G of each parameter.
    pub fn add_curvature(&self, columns: &Mat<f64>, first: usize, weight: f64, curvature: &mut Mat<f64>) {
        for (own, &parameter) in self.parameters.iter().enumerate() {
            let across = self.packed(&self.across[own]);
            // What is wanted is a parameter before `first` with one from there on, or all with all.
            let others = match parameter.checked_sub(first) {
                Some(_) if first > 0 => 0..first,
                Some(_) => 0..columns.ncols(),
                None => first..columns.ncols(),
            };
            for other in others {
                let value = weight * (columns.col(other).transpose() * across.col(0));
                if let Some(place) = other.checked_sub(first) {
                    curvature[(parameter, place)] += value;
                }
                if let Some(place) = parameter.checked_sub(first) {
                    curvature[(other, place)] += value;
                }
            }
            for (index, &other) in self.parameters.iter().enumerate() {
                if let Some(place) = other.checked_sub(first) {
                    curvature[(parameter, place)] += weight * self.curvature[(own, index)];
                }
            }
        }
    }
}

/// Joints with frictions that turn, as the inertia of an instant has them.
pub(super) struct TurningAxes {
    response: Mat<f64>,
}

impl TurningAxes {
    /// Of these.
    pub fn of(axes: &[&TurningAxis]) -> Self {
        TurningAxes { response: responses(axes).1 }
    }

    /// What a torque on each axis does to its own velocity in a row in which the others have these δ, ρ
    /// where none of them turns: the determinant of the row is larger by 1 + δ times this than it were
    /// without the friction of the axis. None where H is no response.
    pub fn felt_alone(&self, deltas: &[f64]) -> Option<Vec<f64>> {
        let least = |axis: usize| -LEAST / self.response[(axis, axis)];
        let all: Vec<(usize, f64)> =
            deltas.iter().enumerate().map(|(axis, delta)| (axis, delta.max(least(axis)))).collect();
        let row = Row::of(&all, &self.response)?;
        let alone = |&(axis, delta): &(usize, f64)| {
            let felt = row.at(axis, axis);
            felt / (1.0 - delta * felt)
        };
        Some(all.iter().map(alone).collect())
    }
}

/// Of axes with these δ, those that turn together in a row; a δ that pushes along is kept where some
/// inertia is left.
fn turning_together(deltas: &mut [f64], response: &Mat<f64>, together: &mut Vec<(usize, f64)>) {
    together.clear();
    for (axis, delta) in deltas.iter_mut().enumerate() {
        *delta = delta.max(-LEAST / response[(axis, axis)]);
        if delta.abs() * response[(axis, axis)] > COUPLED {
            together.push((axis, *delta));
        }
    }
}

/// G⁻¹N of these axes, scaled, and H.
fn responses<A: Borrow<TurningAxis>>(axes: &[A]) -> (Mat<f64>, Mat<f64>) {
    let scale = |axis: &A| {
        let TurningAxis { velocity, moved, toward, .. } = axis.borrow();
        let acceleration = dot(moved, toward);
        if acceleration > 0.0 { (velocity / acceleration).sqrt() } else { 0.0 }
    };
    let scales: Vec<f64> = axes.iter().map(scale).collect();
    let directions = axes.first().map_or(0, |first| first.borrow().moved.len());
    let moved =
        Mat::from_fn(directions, axes.len(), |row, axis| scales[axis] * axes[axis].borrow().moved[row]);
    let mut response = Mat::from_fn(axes.len(), axes.len(), |row, column| {
        scales[row] * dot(&axes[row].borrow().toward, moved.col_as_slice(column))
    });
    // Legs on the floor move together, and two joints with their sum: there are more axes than directions.
    let largest = (0..axes.len()).map(|axis| response[(axis, axis)]).fold(0.0, f64::max);
    (0..axes.len()).for_each(|axis| response[(axis, axis)] += LEAST_RESPONSE * largest);
    (moved, response)
}

/// The axes that turn in one row.
struct Row {
    log_determinant: f64,
    size: usize,
    /// K = (H⁻¹ + Δ)⁻¹.
    inverse: Vec<f64>,
}

impl Row {
    /// Of axes, each with its δ. None where none turns, or H is no response.
    fn of(turning: &[(usize, f64)], response: &Mat<f64>) -> Option<Self> {
        let size = turning.len();
        if size == 0 {
            return None;
        }
        let own = Cholesky::of(size, |row, column| response[(turning[row].0, turning[column].0)])?;
        let inertia = own.inverse();
        let stiff = Cholesky::of(size, |row, column| {
            inertia[row * size + column] + if row == column { turning[row].1 } else { 0.0 }
        })?;
        let log_determinant = own.log_determinant() + stiff.log_determinant();
        Some(Row { log_determinant, size, inverse: stiff.inverse() })
    }

    fn at(&self, row: usize, column: usize) -> f64 {
        self.inverse[row * self.size + column]
    }
}
