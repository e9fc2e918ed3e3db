//! What frictions that turn within a period add to the log-determinant of its motion.
//!
//! A torque of one that is held over a period T changes the velocity of a joint at its end by T·ρ, ρ =
//! nᵀA⁻¹φ₁(X)n with what the joint moves by with each direction, n, and X and φ₁ as in [`super::response`]. A
//! friction that turns adds δ = Σ w_p·T·dc̄_p/dv₁ to what its joint asks for, so that the determinant of the
//! period is larger by the factor det(1 + H·Δ): Δ has the δ of each joint, and H what a torque on one does to
//! the velocity of another, NᵀG⁻¹N with G = A + ½T·F, scaled to have the ρ on its diagonal. A joint that sticks
//! has a large δ: of those that stick the determinant tells the friction, and of the inertia only what the
//! others feel. How the scale follows from the inertia is not counted in the derivatives.

use super::sensitivity::{packed, place};
use super::turning::Turned;
use faer::prelude::Solve;
use faer::{Mat, Side};
use phiw_dynamics::dense::dot;

/// δ is never less than so many times −1/ρ: a friction that pushes along is none, but a search may pass there.
const LEAST: f64 = 0.9;

/// A joint, as the inertia of an instant has it.
pub(super) struct TurningJoint {
    /// ρ.
    pub velocity: f64,
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
    /// G⁻¹N of the joints that turn, scaled, `[direction × joint]`.
    moved: Mat<f64>,
    /// Its derivatives by H.
    by_response: Mat<f64>,
    /// Parameters of the columns.
    parameters: Vec<usize>,
    /// Its derivatives by the parameters.
    by_parameter: Vec<f64>,
    /// Less its derivatives by a parameter and by H, for each parameter.
    across: Vec<Mat<f64>>,
    /// Less its second derivatives by the parameters of the same joint, `[column × column]`.
    curvature: Mat<f64>,
}

impl TurningResponse {
    /// Of frictions under parameters `w`; the instant stands for `weight` rows. None where H is no response.
    pub fn of(turned: &Turned, joints: Vec<TurningJoint>, w: &Mat<f64>, weight: f64) -> Option<Self> {
        let mut present: Vec<usize> = turned.columns.iter().map(|(_, joint)| *joint).collect();
        present.sort_unstable();
        present.dedup();
        let (count, own) = (present.len(), turned.columns.len());
        let scales: Vec<f64> = present
            .iter()
            .map(|&joint| {
                let TurningJoint { velocity, moved, toward } = &joints[joint];
                (velocity / dot(moved, toward)).sqrt()
            })
            .collect();
        let moved = Mat::from_fn(joints[present[0]].moved.len(), count, |row, joint| {
            scales[joint] * joints[present[joint]].moved[row]
        });
        let response = Mat::from_fn(count, count, |row, column| {
            scales[row] * dot(&joints[present[row]].toward, moved.col_as_slice(column))
        });
        let inertia = response.llt(Side::Lower).ok()?.solve(Mat::<f64>::identity(count, count));
        let place = |(_, joint): &(usize, usize)| present.partition_point(|own| own < joint);
        let places: Vec<usize> = turned.columns.iter().map(place).collect();
        let places = &places;
        let mut sum = TurningResponse {
            log_determinant: 0.0,
            moved,
            by_response: Mat::zeros(count, count),
            parameters: turned.columns.iter().map(|(parameter, _)| *parameter).collect(),
            by_parameter: vec![0.0; own],
            across: vec![Mat::zeros(count, count); own],
            curvature: Mat::zeros(own, own),
        };
        let of_joint = |joint: usize| (0..own).filter(move |index| places[*index] == joint);
        let of_joints: Vec<Vec<usize>> = (0..count).map(|joint| of_joint(joint).collect()).collect();
        let base: f64 = log_determinant(&inertia)?;
        let mut delta = vec![0.0; count];
        for slopes in turned.slopes.chunks_exact(own) {
            delta.fill(0.0);
            for ((slope, &parameter), &joint) in slopes.iter().zip(&sum.parameters).zip(places) {
                delta[joint] += slope * w[(parameter, 0)];
            }
            for (joint, delta) in delta.iter_mut().enumerate() {
                *delta = delta.max(-LEAST * inertia[(joint, joint)]);
            }
            let stiff = Mat::from_fn(count, count, |row, column| {
                inertia[(row, column)] + if row == column { delta[row] } else { 0.0 }
            });
            let Ok(factor) = stiff.llt(Side::Lower) else { continue };
            // K = (H⁻¹ + Δ)⁻¹, and R = K·H⁻¹.
            let inverse = factor.solve(Mat::<f64>::identity(count, count));
            let diagonal = (0..count).map(|joint| factor.L()[(joint, joint)].ln()).sum::<f64>();
            sum.log_determinant += (2.0 * diagonal - base) / weight;
            let through = &inverse * &inertia;
            for column in 0..count {
                for row in 0..count {
                    let own = if row == column { delta[row] } else { 0.0 };
                    sum.by_response[(row, column)] +=
                        (own - delta[row] * inverse[(row, column)] * delta[column]) / weight;
                }
            }
            for (index, slope) in slopes.iter().enumerate().filter(|(_, slope)| **slope != 0.0) {
                let joint = places[index];
                let response = inverse[(joint, joint)];
                sum.by_parameter[index] += slope * response / weight;
                let across = &mut sum.across[index];
                for column in 0..count {
                    let share = slope * through[(joint, column)] / weight;
                    for row in 0..count {
                        across[(row, column)] += share * through[(joint, row)];
                    }
                }
                for &other in &of_joints[joint] {
                    sum.curvature[(index, other)] += slope * slopes[other] * response * response / weight;
                }
            }
        }
        Some(sum)
    }

    /// M·S·Mᵀ of a symmetric S over the joints, packed.
    fn packed(&self, over_joints: &Mat<f64>) -> Mat<f64> {
        let whole = &self.moved * over_joints * self.moved.transpose();
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

    /// Adds `weight` times less its second derivatives, for all parameters and those from `first` on: those by
    /// two parameters of a joint, and by one and the inertia. Another determinant outweighs those by the inertia alone. `columns` are the packed G of
    /// each parameter.
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

fn log_determinant(matrix: &Mat<f64>) -> Option<f64> {
    let factor = matrix.llt(Side::Lower).ok()?;
    Some((0..matrix.nrows()).map(|index| 2.0 * factor.L()[(index, index)].ln()).sum())
}
