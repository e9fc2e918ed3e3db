//! The likelihood of a motion with the noise's size replaced by its most likely value.
//!
//! −log L = Σ_t ½‖Φ_t w − f_t‖²_σ + N·Σ log σ_j − Σ_t log det J_t(w) has its least value over σ_j at σ_j² =
//! S_j/N, S_j = Σ_t (Φ_t w − f_t)_j²; what is left is Σ_j (N/2)·log S_j − Σ_t log det J_t, to which the prior
//! is added. (Concentrated likelihood: Barndorff-Nielsen & Cox 1994, section 3.4.)

use super::body_prior::BodyPrior;
use super::likelihood::log_determinant_curvature;
use super::response::{Response, log_determinant};
use super::sensitivity::Sensitivity;
use super::settings::NewtonSettings;
use faer::prelude::Solve;
use faer::{Mat, Side};
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// The objective over x: standard parameters, then effects.
pub(super) struct Profile<'a> {
    pub factor: GroupedFactor,
    /// Rows of each torque: those of the factor that are of a spread are none.
    pub rows: Vec<f64>,
    /// RᵀR of each torque: for steps only, so half the digits are enough.
    pub grams: Vec<Mat<f64>>,
    pub sensitivities: &'a [Sensitivity],
    /// w = map·x.
    pub map: &'a Mat<f64>,
    pub prior: &'a BodyPrior,
    /// Nats a unit of divergence.
    pub prior_weight: f64,
    /// Least variance of each torque's noise: what rounding and the engine leave.
    pub least_variance: Vec<f64>,
    pub newton: NewtonSettings,
}

/// What a minimum is.
pub(super) struct Minimum {
    pub x: Mat<f64>,
    /// Inverse curvature there; none if it is not positive definite.
    pub covariance: Option<Mat<f64>>,
    /// Whether it was reached within the steps that were allowed.
    pub settled: bool,
}

impl Profile<'_> {
    /// Rows of each torque, and S_j with the least that it can be.
    fn squares(&self, w: &Mat<f64>) -> Vec<(f64, f64, Mat<f64>)> {
        let of_group = |((group, least), &rows): ((&Group, &f64), &f64)| {
            let size = group.factor.parameters();
            let r = group.factor.as_mat();
            let own = Mat::from_fn(size, 1, |row, _| w[(group.parameters[row], 0)]);
            let left = r.get(.., ..size) * own - r.get(.., size..);
            (rows, left.squared_norm_l2() + rows * least, left)
        };
        self.factor.groups().iter().zip(&self.least_variance).zip(&self.rows).map(of_group).collect()
    }

    /// Standard deviation of each torque's noise.
    pub fn noise(&self, w: &Mat<f64>) -> Vec<f64> {
        self.squares(w).iter().map(|(rows, square, _)| (square / rows.max(1.0)).sqrt()).collect()
    }

    /// Observed information at `w` of the torques' noise with the standard deviations `std`, which are known.
    pub fn information(&self, w: &Mat<f64>, std: &[f64]) -> Mat<f64> {
        let responses: Vec<Option<Response>> =
            self.sensitivities.iter().map(|sensitivity| Response::of(sensitivity, w)).collect();
        let mut information = log_determinant_curvature(self.sensitivities, &responses, w.nrows(), 1)
            * faer::Scale(self.instants_weight());
        for ((group, gram), std) in self.factor.groups().iter().zip(&self.grams).zip(std) {
            for (row, &parameter) in group.parameters.iter().enumerate() {
                for (column, &other) in group.parameters.iter().enumerate() {
                    information[(parameter, other)] += gram[(row, column)] / (std * std);
                }
            }
        }
        information
    }

    /// Weight of the instants: they stand for all rows, of which those that follow no other are not
    /// counted.
    fn instants_weight(&self) -> f64 {
        let rows = self.rows.iter().copied().fold(0.0, f64::max);
        let all: f64 = self.sensitivities.iter().map(|sensitivity| sensitivity.weight).sum();
        if all > 0.0 { rows / all } else { 0.0 }
    }

    /// −log L without the prior; infinite where an inertia is not positive definite.
    pub fn likelihood(&self, w: &Mat<f64>) -> f64 {
        let mut cost: f64 =
            self.squares(w).iter().map(|(rows, square, _)| 0.5 * rows * (square / rows.max(1.0)).ln()).sum();
        let share = self.instants_weight();
        for sensitivity in self.sensitivities {
            let Some(value) = log_determinant(sensitivity, w) else { return f64::INFINITY };
            cost -= share * sensitivity.weight * value;
        }
        cost
    }

    fn cost(&self, x: &Mat<f64>) -> f64 {
        let divergence = self.prior.divergence(x);
        if divergence.is_infinite() {
            return divergence;
        }
        self.likelihood(&(self.map * x)) + self.prior_weight * divergence
    }

    /// Damped Newton steps from `x`, which is inside, `most_steps` of them at most.
    pub fn minimum(&self, mut x: Mat<f64>, most_steps: usize) -> Minimum {
        let settings = &self.newton;
        let parameters = self.map.nrows();
        let mut curvature = Mat::zeros(parameters, parameters);
        let mut freshness = 0;
        let mut cost = self.cost(&x);
        let share = self.instants_weight();
        let (mut covariance, mut settled) = (None, false);
        for step in 0..most_steps {
            let w = self.map * &x;
            let responses: Vec<Option<Response>> =
                self.sensitivities.iter().map(|sensitivity| Response::of(sensitivity, &w)).collect();
            if step < settings.fresh_steps || step % settings.curvature_every.max(1) == 0 {
                curvature = log_determinant_curvature(
                    self.sensitivities,
                    &responses,
                    parameters,
                    settings.instants_every,
                );
                curvature *= faer::Scale(share);
                freshness = step;
            }
            let (mut gradient, mut hessian) = (Mat::zeros(parameters, 1), curvature.clone());
            for (sensitivity, response) in self.sensitivities.iter().zip(&responses) {
                let Some(response) = response else { continue };
                gradient -= response.gradient(sensitivity, 0) * faer::Scale(share * sensitivity.weight);
            }
            let downdates = self.add_squares(&w, &mut gradient, &mut hessian);
            let transposed = self.map.transpose();
            let mut gradient = transposed * gradient;
            let mut hessian = transposed * hessian * self.map;
            self.prior.add_to(&x, self.prior_weight, &mut gradient, &mut hessian);
            let [relative, absolute] = settings.damping;
            for k in 0..hessian.nrows() {
                hessian[(k, k)] = hessian[(k, k)] * (1.0 + relative) + absolute;
            }
            let downdate = transposed * downdates;
            // That σ follows w makes a step longer along what scales both; too much of it is no minimum.
            let factor = SHARES.iter().find_map(|share| {
                let own = &hessian - &downdate * downdate.transpose() * faer::Scale(*share);
                own.llt(Side::Lower).ok()
            });
            let Some(factor) = factor else { break };
            let direction = factor.solve(&gradient);
            let decrement: f64 = (0..x.nrows()).map(|k| direction[(k, 0)] * gradient[(k, 0)]).sum();
            covariance = Some(factor.solve(Mat::<f64>::identity(x.nrows(), x.nrows())));
            let moved = self.line_search(&mut x, &mut cost, &direction, decrement);
            let near = decrement.max(0.0).sqrt() < settings.settled && step > freshness;
            settled = !moved || near || decrement < settings.least_decrement;
            if settled {
                break;
            }
        }
        Minimum { x, covariance, settled }
    }

    /// Adds the squares' part of gradient and curvature, and returns what is to be taken off the latter as a
    /// matrix times its transpose: σ follows w.
    fn add_squares(&self, w: &Mat<f64>, gradient: &mut Mat<f64>, hessian: &mut Mat<f64>) -> Mat<f64> {
        let groups = self.factor.groups();
        let mut downdates = Mat::zeros(w.nrows(), groups.len());
        for (index, (group, (rows, square, left))) in groups.iter().zip(self.squares(w)).enumerate() {
            if rows == 0.0 {
                continue;
            }
            let size = group.factor.parameters();
            let r = group.factor.as_mat().get(.., ..size);
            let precision = rows / square;
            let own = r.transpose() * left;
            let gram = &self.grams[index];
            let scale = precision * (2.0 / rows).sqrt();
            for (row, &parameter) in group.parameters.iter().enumerate() {
                gradient[(parameter, 0)] += precision * own[(row, 0)];
                downdates[(parameter, index)] = scale * own[(row, 0)];
                for (column, &other) in group.parameters.iter().enumerate() {
                    hessian[(parameter, other)] += precision * gram[(row, column)];
                }
            }
        }
        downdates
    }

    /// Moves `x` along −direction as far as the objective falls enough (Armijo); false if it does not
    /// fall.
    fn line_search(&self, x: &mut Mat<f64>, cost: &mut f64, direction: &Mat<f64>, decrement: f64) -> bool {
        let mut length = 1.0;
        while length > self.newton.shortest_step {
            let trial = &*x - direction * faer::Scale(length);
            let reached = self.cost(&trial);
            if reached <= *cost - self.newton.sufficient_decrease * length * decrement {
                (*x, *cost) = (trial, reached);
                return true;
            }
            length *= 0.5;
        }
        false
    }
}

/// Shares of the downdate that are tried in turn.
const SHARES: [f64; 4] = [1.0, 0.8, 0.5, 0.0];
