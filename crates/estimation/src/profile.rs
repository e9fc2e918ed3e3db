//! The likelihood of a motion with the noise's size replaced by its most likely value.
//!
//! −log L = Σ_t ½‖Φ_t w − f_t‖²_σ + N·Σ log σ_j − Σ_t log det J_t(w) has its least value over σ_j at σ_j² =
//! S_j/N, S_j = Σ_t (Φ_t w − f_t)_j²; what is left is Σ_j (N/2)·log S_j − Σ_t log det J_t, to which the prior
//! is added. (Concentrated likelihood: Barndorff-Nielsen & Cox 1994, section 3.4.)

use super::body_prior::BodyPrior;
use super::likelihood::log_determinant_curvature;
use super::response::{Modes, Response};
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
        self.modes(w).map_or(f64::INFINITY, |modes| self.likelihood_of_modes(w, &modes))
    }

    /// Inertia and damping of all instants; none where an inertia is not positive definite.
    fn modes(&self, w: &Mat<f64>) -> Option<Vec<Modes>> {
        self.sensitivities.iter().map(|sensitivity| Modes::of(sensitivity, w)).collect()
    }

    fn likelihood_of_modes(&self, w: &Mat<f64>, modes: &[Modes]) -> f64 {
        let cost: f64 =
            self.squares(w).iter().map(|(rows, square, _)| 0.5 * rows * (square / rows.max(1.0)).ln()).sum();
        let share = self.instants_weight();
        let instants = self.sensitivities.iter().zip(modes);
        cost - share
            * instants.map(|(sensitivity, modes)| sensitivity.weight * modes.log_determinant()).sum::<f64>()
    }

    /// The objective at `x`; none where a body or an inertia is not possible.
    fn at(&self, x: Mat<f64>) -> Option<Point> {
        let divergence = self.prior.divergence(&x);
        if !divergence.is_finite() {
            return None;
        }
        let w = self.map * &x;
        let modes = self.modes(&w)?;
        let cost = self.likelihood_of_modes(&w, &modes) + self.prior_weight * divergence;
        Some(Point { x, w, modes, cost })
    }

    /// Damped Newton steps from `x`, which is inside, `most_steps` of them at most. `curvature` is that of
    /// the log-determinants, which changes slowly: it is found anew where it is old, and kept for the next.
    pub fn minimum(&self, x: Mat<f64>, most_steps: usize, curvature: &mut Curvature) -> Minimum {
        let settings = &self.newton;
        let parameters = self.map.nrows();
        let share = self.instants_weight();
        let (mut covariance, mut settled) = (None, false);
        let Some(mut point) = self.at(x.clone()) else { return Minimum { x, covariance, settled } };
        for _ in 0..most_steps {
            let w = &point.w;
            let responses: Vec<Option<Response>> = self
                .sensitivities
                .iter()
                .zip(&point.modes)
                .map(|(sensitivity, modes)| Response::of_modes(sensitivity, modes))
                .collect();
            let fresh = curvature.is_due(settings);
            if fresh {
                curvature.matrix = log_determinant_curvature(
                    self.sensitivities,
                    &responses,
                    parameters,
                    settings.instants_every,
                );
            }
            curvature.steps += 1;
            let (mut gradient, mut hessian) =
                (Mat::zeros(parameters, 1), &curvature.matrix * faer::Scale(share));
            for (sensitivity, response) in self.sensitivities.iter().zip(&responses) {
                let Some(response) = response else { continue };
                gradient -= response.gradient(sensitivity, 0) * faer::Scale(share * sensitivity.weight);
            }
            let downdates = self.add_squares(w, &mut gradient, &mut hessian);
            let transposed = self.map.transpose();
            let mut gradient = transposed * gradient;
            let mut hessian = transposed * hessian * self.map;
            self.prior.add_to(&point.x, self.prior_weight, &mut gradient, &mut hessian);
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
            let size = point.x.nrows();
            let decrement: f64 = (0..size).map(|k| direction[(k, 0)] * gradient[(k, 0)]).sum();
            covariance = Some(factor.solve(Mat::<f64>::identity(size, size)));
            let next = self.line_search(&point, &direction, decrement);
            let near = decrement.max(0.0).sqrt() < settings.settled && !fresh;
            settled = next.is_none() || near || decrement < settings.least_decrement;
            point = next.unwrap_or(point);
            if settled {
                break;
            }
        }
        Minimum { x: point.x, covariance, settled }
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

    /// The point along −direction at which the objective falls enough (Armijo); none if it does not fall.
    fn line_search(&self, from: &Point, direction: &Mat<f64>, decrement: f64) -> Option<Point> {
        let mut length = 1.0;
        while length > self.newton.shortest_step {
            let reached = self.at(&from.x - direction * faer::Scale(length));
            let enough = from.cost - self.newton.sufficient_decrease * length * decrement;
            if let Some(reached) = reached.filter(|reached| reached.cost <= enough) {
                return Some(reached);
            }
            length *= 0.5;
        }
        None
    }
}

/// Where the objective was looked at: w, and the inertias of all instants under it.
struct Point {
    x: Mat<f64>,
    w: Mat<f64>,
    modes: Vec<Modes>,
    cost: f64,
}

/// Curvature of −Σ weight·log det J, and the steps that have been taken since minima are looked for along a
/// path.
pub(super) struct Curvature {
    matrix: Mat<f64>,
    steps: usize,
}

impl Curvature {
    /// None yet.
    pub fn unknown() -> Self {
        Curvature { matrix: Mat::zeros(0, 0), steps: 0 }
    }

    fn is_due(&self, settings: &NewtonSettings) -> bool {
        self.steps < settings.fresh_steps || self.steps.is_multiple_of(settings.curvature_every.max(1))
    }
}

/// Shares of the downdate that are tried in turn.
const SHARES: [f64; 4] = [1.0, 0.8, 0.5, 0.0];
