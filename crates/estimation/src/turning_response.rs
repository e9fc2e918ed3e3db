//! What frictions that turn within a period add to the log-determinant of its motion.
//!
//! A torque of one that is held over a period T changes the velocity of a joint at its end by T·ρ, ρ =
//! nᵀA⁻¹φ₁(X)n with what the joint moves by with each direction, n, and X and φ₁ as in [`super::response`]. A
//! friction that turns adds y = Σ w_p·ρ·T·dc̄_p/dv₁ to what that joint asks for, so that the determinant of the
//! period is larger by the factor 1 + y. Of joints that turn in the same period each counts by itself: what
//! one's friction does to another's acceleration is of second order. That ρ changes with the inertia is
//! counted by (A + ½T·F)⁻¹, near enough for what is itself a part.

use super::sensitivity::{Turning, packed, place};
use faer::Mat;
use phiw_dynamics::dense::dot;

/// Below this factor the logarithm goes on as a straight line: a friction that pushes along is none, but a
/// search may pass there.
const LEAST_FACTOR: f64 = 0.1;
/// A larger factor counts as this one. Where friction would change the velocity by far more than it changed,
/// the joint stuck and did not pass through zero with a constant acceleration; what is known of the noise is
/// then no more.
const LARGEST_FACTOR: f64 = 3.0;
/// What a joint does in a period under a torque of one, over the period.
#[derive(Clone, Copy, Debug)]
pub(super) struct JointResponse {
    /// ρ.
    pub velocity: f64,
    /// nᵀG⁻¹n.
    pub acceleration: f64,
}

/// The share of one joint, in the mean of the rows that an instant stands for.
#[derive(Clone)]
pub(super) struct TurningResponse {
    /// Mean of log(1 + y).
    pub log_determinant: f64,
    /// G⁻¹n over the root of nᵀG⁻¹n.
    moved: Vec<f64>,
    /// Mean of ∂log(1 + y)/∂ρ times ρ.
    by_velocity: f64,
    parameters: Vec<usize>,
    /// Its derivatives by the parameters.
    by_parameter: Vec<f64>,
    /// Its derivatives by a parameter and by the inertia along `moved`, both.
    across: Vec<f64>,
    /// Less its second derivatives by the parameters, `[parameter × parameter]`.
    curvature: Vec<f64>,
}

impl TurningResponse {
    /// Of the frictions of a joint under parameters `w`; the instant stands for `weight` rows. `moved` is
    /// G⁻¹n.
    pub fn of(
        turning: &Turning,
        response: JointResponse,
        mut moved: Vec<f64>,
        w: &Mat<f64>,
        weight: f64,
    ) -> Self {
        let JointResponse { velocity, acceleration } = response;
        moved.iter_mut().for_each(|moved| *moved /= acceleration.sqrt());
        let turned = &turning.turned;
        let count = turned.parameters.len();
        let own: Vec<f64> = turned.parameters.iter().map(|&parameter| w[(parameter, 0)]).collect();
        let mut response = TurningResponse {
            log_determinant: 0.0,
            moved,
            by_velocity: 0.0,
            parameters: turned.parameters.clone(),
            by_parameter: vec![0.0; count],
            across: vec![0.0; count],
            curvature: vec![0.0; count * count],
        };
        let mut slopes = vec![0.0; count];
        for row in turned.slopes.chunks_exact(count.max(1)) {
            slopes.iter_mut().zip(row).for_each(|(slope, own)| *slope = velocity * own);
            let part = dot(&slopes, &own);
            let factor = 1.0 + part;
            if factor > LARGEST_FACTOR {
                response.log_determinant += LARGEST_FACTOR.ln() / weight;
                continue;
            }
            let beyond = (LEAST_FACTOR - factor).max(0.0);
            let factor = factor.max(LEAST_FACTOR);
            let share = 1.0 / (weight * factor);
            response.log_determinant += (factor.ln() - beyond / factor) / weight;
            response.by_velocity += share * part;
            for (row, left) in slopes.iter().enumerate() {
                response.by_parameter[row] += share * left;
                response.across[row] += share * left / factor;
                let curvature = &mut response.curvature[row * count..(row + 1) * count];
                for (curvature, right) in curvature.iter_mut().zip(&slopes) {
                    *curvature += share * left * right / factor;
                }
            }
        }
        response
    }

    /// Adds its derivatives by the inertia and by the damping to packed slopes.
    pub fn add_slopes(&self, slopes: &mut [Mat<f64>; 2]) {
        for (slope, damped) in slopes.iter_mut().zip([1.0, 0.5]) {
            let share = damped * self.by_velocity;
            let slope = slope.col_as_slice_mut(0);
            for row in 0..self.moved.len() {
                for column in 0..=row {
                    let scale = if row == column { 1.0 } else { std::f64::consts::SQRT_2 };
                    slope[place(row, column)] -= share * scale * self.moved[row] * self.moved[column];
                }
            }
        }
    }

    /// Adds its derivatives by the parameters from `first` on that it has through no inertia.
    pub fn add_gradient(&self, first: usize, gradient: &mut Mat<f64>) {
        for (&parameter, slope) in self.parameters.iter().zip(&self.by_parameter) {
            if let Some(place) = parameter.checked_sub(first) {
                gradient[(place, 0)] += slope;
            }
        }
    }

    /// Adds `weight` times less its second derivatives, but those by the inertia alone, which another
    /// determinant outweighs. `columns` are the packed G of each parameter.
    pub fn add_curvature(&self, columns: &Mat<f64>, first: usize, weight: f64, curvature: &mut Mat<f64>) {
        let mut along = Mat::zeros(packed(self.moved.len()), 1);
        for row in 0..self.moved.len() {
            for column in 0..=row {
                let scale = if row == column { 1.0 } else { std::f64::consts::SQRT_2 };
                along[(place(row, column), 0)] = scale * self.moved[row] * self.moved[column];
            }
        }
        // nᵀG⁻¹·G_k·G⁻¹n over nᵀG⁻¹n of each parameter: by what share it lessens what the joint does.
        let lessened = columns.transpose() * along;
        let count = self.parameters.len();
        for (own, &parameter) in self.parameters.iter().enumerate() {
            let across = weight * self.across[own];
            for other in 0..lessened.nrows() {
                if let Some(place) = other.checked_sub(first) {
                    curvature[(parameter, place)] += across * lessened[(other, 0)];
                }
                if let Some(place) = parameter.checked_sub(first) {
                    curvature[(other, place)] += across * lessened[(other, 0)];
                }
            }
            for (&other, value) in self.parameters.iter().zip(&self.curvature[own * count..]) {
                if let Some(place) = other.checked_sub(first) {
                    curvature[(parameter, place)] += weight * value;
                }
            }
        }
    }
}
