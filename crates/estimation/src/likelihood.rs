//! Maximum likelihood where the noise moves the robot.

use super::own_friction::OwnFriction;
use super::prior::{ParameterPrior, with_prior};
use super::response::{Response, log_determinant};
use super::sensitivity::Sensitivity;
use super::settings::{NewtonSettings, ScoreSettings};
use super::{Estimate, Estimator, Evidence};
use crate::robot::spheres;
use crate::{EstimationError, RobotModel, TorqueNoise};
use faer::prelude::Solve;
use faer::{Mat, Side};
use phiw_dynamics::check::check_size;
use phiw_identification::Design;
use phiw_regressor::least_squares::GroupedFactor;

/// The parameters under which the *motion* that was measured is most likely, given the commands.
///
/// The paper's plant adds noise δ to the commanded torque f on its way to the robot, and logs the command:
/// Φ(q, q̇, q̈)·w = f + δ, and δ is in q̈. What is random is the motion, not the right-hand side. Its density
/// is that of δ times the Jacobian |∂δ/∂q̈| = det J(q; w), J the mass matrix (and what friction does within a
/// period, in closed form), so with σ_j the noise of torque j
///
/// −log L(w) = Σ_t ½‖Φ_t w − f_t‖²_σ − Σ_t log det J_t(w).
///
/// Least squares is the first sum alone. It makes every inertia too small, since that explains the
/// accelerations that the noise itself has caused; the second sum counters this. J is linear in w, that of
/// dry friction near the one that is believed, and log det is concave, so the problem is convex: damped
/// Newton steps find its only minimum from anywhere inside. Bodies that make some J indefinite can not exist,
/// and lie outside. A closed loop does no harm: a command may depend on the past as it likes. (Compare the
/// prediction-error view of closed-loop identification, Forssell & Ljung 1999.)
///
/// σ must be known: the noise of the actuators, as a data sheet gives it. With σ free, a robot with more
/// inertia and more noise is nearly as likely, and little is gained over least squares.
///
/// Right for rows over periods ([`super::RowsAt::Periods`]) and exact encoders. Columns that turn with the
/// velocity are means over the period, whose slopes are in J; others that are not linear in the motion are
/// those of a period's beginning and have no share in J. Noise in the logged torque, which
/// moves nothing, is taken for noise that does; where that dominates, [`super::WeightedLeastSquares`] is
/// right.
#[derive(Clone, Debug, PartialEq)]
pub struct MotionLikelihood {
    /// σ: standard deviation of each torque's noise \[N·m, N\].
    pub torque_noise: Vec<f64>,
    /// Bodies that do not move, such as the feet of a robot that stands: the noise moves it only as they
    /// allow, and the log-determinant is that of J over the directions that are left, Nᵀ·J·N. (What the floor
    /// gives is measured and on the right-hand side; its share of |∂δ/∂(q̈, f)| does not depend on w.)
    pub standing_on: Vec<usize>,
    /// What was believed before anything was measured; −log L then has its square too. None in the paper:
    /// right where all parameters are well excited.
    pub prior: Option<ParameterPrior>,
    /// How the minimum is found.
    pub newton: NewtonSettings,
    /// What effects beside the model are asked.
    pub score: ScoreSettings,
}

impl MotionLikelihood {
    /// For torques with this noise \[N·m, N\].
    pub fn new(torque_noise: Vec<f64>) -> Self {
        MotionLikelihood {
            torque_noise,
            standing_on: Vec::new(),
            prior: None,
            newton: NewtonSettings::default(),
            score: ScoreSettings::default(),
        }
    }

    /// The same for a robot on which these bodies do not move.
    pub fn standing_on(self, bodies: Vec<usize>) -> Self {
        MotionLikelihood { standing_on: bodies, ..self }
    }

    /// The same with a belief from before anything was measured.
    pub fn believing(self, prior: ParameterPrior) -> Self {
        MotionLikelihood { prior: Some(prior), ..self }
    }

    /// −log L of the evidence, that of the prior included.
    pub(super) fn problem(&self, design: &Design, evidence: &Evidence) -> Result<Problem, EstimationError> {
        check_size(
            "standard deviations of the torques' noise",
            self.torque_noise.len(),
            design.rows().len(),
        )?;
        if let Some(&value) = self.torque_noise.iter().find(|noise| !(noise.is_finite() && **noise > 0.0)) {
            return Err(EstimationError::Value {
                what: "the noise of a torque",
                value,
                must_be: "finite and > 0",
            });
        }
        let mut precision: Vec<f64> = self.torque_noise.iter().map(|noise| noise.powi(-2)).collect();
        let sensitivities = Sensitivity::all(design, evidence, &self.standing_on)?;
        let factor = match &self.prior {
            Some(prior) => {
                precision.push(1.0);
                with_prior(evidence.factor(), prior.group(design)?)?
            }
            None => evidence.factor().clone(),
        };
        Ok(Problem::new(factor, sensitivities, precision, self.newton))
    }
}

impl Estimator for MotionLikelihood {
    fn name(&self) -> &'static str {
        "motion_likelihood"
    }

    fn estimate(
        &self,
        design: &Design,
        evidence: &Evidence,
        present: &RobotModel,
        present_parameters: &[f64],
    ) -> Result<Estimate, EstimationError> {
        let own = OwnFriction { design, standing_on: &self.standing_on, settings: &self.newton };
        own.estimate(
            evidence,
            present_parameters,
            |evidence, start| self.minimum(design, evidence, present, start),
            |evidence, w| Ok(self.problem(design, evidence)?.cost(&column(w))),
        )
    }

    fn torque_noise(&self) -> Option<&[f64]> {
        Some(&self.torque_noise)
    }

    fn negative_log_likelihood(
        &self,
        design: &Design,
        evidence: &Evidence,
        parameters: &[f64],
    ) -> Result<Option<f64>, EstimationError> {
        let under = evidence.under(design, parameters, &self.standing_on)?;
        let problem = self.problem(design, under.as_ref().unwrap_or(evidence))?;
        Ok(Some(problem.cost(&column(parameters))))
    }
}

impl MotionLikelihood {
    fn minimum(
        &self,
        design: &Design,
        evidence: &Evidence,
        present: &RobotModel,
        present_parameters: &[f64],
    ) -> Result<Estimate, EstimationError> {
        let problem = self.problem(design, evidence)?;
        let mut w = column(present_parameters);
        if problem.log_determinants(&w).is_none() {
            // Random parameters are no bodies; spheres of the same mass at the same place are.
            let mut start = design.base().from_standard(&spheres(&present.standard, &self.newton))?;
            start.extend(present_parameters[start.len()..].iter().map(|value| value.abs()));
            w = column(&start);
        }
        let mut curvature = Mat::zeros(0, 0);
        let mut freshness = 0;
        let settings = &self.newton;
        for step in 0..settings.most_steps {
            let (gradient, responses) = problem.gradient(&w);
            // The curvature of log det changes slowly: it is the dearest part.
            if step < settings.fresh_steps || step % settings.curvature_every.max(1) == 0 {
                curvature = problem.log_determinant_curvature(&responses);
                freshness = step;
            }
            let hessian = problem.hessian(&curvature);
            let Ok(factor) = hessian.llt(Side::Lower) else { break };
            let direction = factor.solve(&gradient);
            let decrement = (0..w.nrows()).map(|k| direction[(k, 0)] * gradient[(k, 0)]).sum::<f64>();
            let moved = problem.line_search(&mut w, &direction, decrement);
            let settled = decrement.max(0.0).sqrt() < settings.settled && step > freshness;
            if !moved || settled || decrement < settings.least_decrement {
                break;
            }
        }
        let covariance = problem
            .hessian(&curvature)
            .llt(Side::Lower)
            .ok()
            .map(|factor| factor.solve(Mat::<f64>::identity(w.nrows(), w.nrows())));
        let deviation =
            |k: usize| covariance.as_ref().map_or(f64::NAN, |covariance| covariance[(k, k)].max(0.0).sqrt());
        Ok(Estimate {
            parameters: (0..w.nrows()).map(|k| w[(k, 0)]).collect(),
            standard_deviations: (0..w.nrows()).map(deviation).collect(),
            covariance,
            noise: Some(self.torque_noise.iter().map(|&std| TorqueNoise::white(std)).collect()),
        })
    }
}

/// Σ weight·tr(J⁻¹ J_k J⁻¹ J_l) of one instant in so many: a part of them is enough for a step's length.
pub(super) fn log_determinant_curvature(
    sensitivities: &[Sensitivity],
    responses: &[Option<Response>],
    parameters: usize,
    every: usize,
) -> Mat<f64> {
    let mut curvature = Mat::zeros(parameters, parameters);
    let every = every.max(1);
    let all: f64 = sensitivities.iter().map(|sensitivity| sensitivity.weight).sum();
    let chosen = || sensitivities.iter().zip(responses).skip(every / 2).step_by(every);
    let part: f64 = chosen().map(|(sensitivity, _)| sensitivity.weight).sum();
    for (sensitivity, response) in chosen() {
        let Some(response) = response else { continue };
        response.add_curvature(sensitivity, 0, sensitivity.weight * all / part, &mut curvature);
    }
    curvature
}

pub(super) fn column(values: &[f64]) -> Mat<f64> {
    Mat::from_fn(values.len(), 1, |row, _| values[row])
}

/// −log L and its derivatives.
pub(super) struct Problem {
    factor: GroupedFactor,
    /// RᵀR of each torque over all parameters: for steps only, so half the digits are enough.
    grams: Vec<Mat<f64>>,
    sensitivities: Vec<Sensitivity>,
    /// 1/σ² of each torque.
    precision: Vec<f64>,
    settings: NewtonSettings,
}

impl Problem {
    pub(super) fn new(
        factor: GroupedFactor,
        sensitivities: Vec<Sensitivity>,
        precision: Vec<f64>,
        settings: NewtonSettings,
    ) -> Self {
        let gram = |group: &phiw_regressor::least_squares::Group| {
            let size = group.factor.parameters();
            let r = group.factor.as_mat().get(..size, ..size);
            r.transpose() * r
        };
        Problem {
            grams: factor.groups().iter().map(gram).collect(),
            factor,
            sensitivities,
            precision,
            settings,
        }
    }

    /// R_j·w − z_j of a torque.
    fn residual(&self, group: usize, w: &Mat<f64>) -> Mat<f64> {
        let group = &self.factor.groups()[group];
        let size = group.factor.parameters();
        let r = group.factor.as_mat();
        let own = Mat::from_fn(size, 1, |row, _| w[(group.parameters[row], 0)]);
        r.get(.., ..size) * own - r.get(.., size..)
    }

    /// Σ weight·log det J; none where some inertia is not positive definite.
    fn log_determinants(&self, w: &Mat<f64>) -> Option<f64> {
        let mut sum = 0.0;
        for sensitivity in &self.sensitivities {
            sum += sensitivity.weight * log_determinant(sensitivity, w)?;
        }
        Some(sum)
    }

    fn cost(&self, w: &Mat<f64>) -> f64 {
        let Some(log_determinants) = self.log_determinants(w) else { return f64::INFINITY };
        let squares: f64 = (0..self.grams.len())
            .map(|group| 0.5 * self.precision[group] * self.residual(group, w).squared_norm_l2())
            .sum();
        squares - log_determinants
    }

    /// The gradient, and what it was made of at each instant; none where an inertia is not positive definite.
    pub(super) fn gradient(&self, w: &Mat<f64>) -> (Mat<f64>, Vec<Option<Response>>) {
        let mut gradient = Mat::zeros(w.nrows(), 1);
        for (index, group) in self.factor.groups().iter().enumerate() {
            let size = group.factor.parameters();
            let own = group.factor.as_mat().get(.., ..size).transpose() * self.residual(index, w);
            for (row, &parameter) in group.parameters.iter().enumerate() {
                gradient[(parameter, 0)] += self.precision[index] * own[(row, 0)];
            }
        }
        let mut responses = Vec::with_capacity(self.sensitivities.len());
        for sensitivity in &self.sensitivities {
            let response = Response::of(sensitivity, w);
            if let Some(response) = &response {
                gradient -= response.gradient(sensitivity, 0) * faer::Scale(sensitivity.weight);
            }
            responses.push(response);
        }
        (gradient, responses)
    }

    /// Σ weight·tr(J⁻¹ J_k J⁻¹ J_l).
    pub(super) fn log_determinant_curvature(&self, responses: &[Option<Response>]) -> Mat<f64> {
        let (parameters, every) = (self.factor.parameter_count(), self.settings.instants_every);
        log_determinant_curvature(&self.sensitivities, responses, parameters, every)
    }

    pub(super) fn hessian(&self, curvature: &Mat<f64>) -> Mat<f64> {
        let mut hessian = curvature.clone();
        for ((group, gram), precision) in self.factor.groups().iter().zip(&self.grams).zip(&self.precision) {
            for (column, &right) in group.parameters.iter().enumerate() {
                for (row, &left) in group.parameters.iter().enumerate() {
                    hessian[(left, right)] += precision * gram[(row, column)];
                }
            }
        }
        // Directions that nothing determines stay where they are.
        let [share, all] = self.settings.damping;
        for k in 0..hessian.nrows() {
            hessian[(k, k)] = hessian[(k, k)] * (1.0 + share) + all;
        }
        hessian
    }

    /// Moves `w` along −direction as far as −log L falls enough (Armijo); false if it does not fall at all.
    fn line_search(&self, w: &mut Mat<f64>, direction: &Mat<f64>, decrement: f64) -> bool {
        let before = self.cost(w);
        let mut length = 1.0;
        while length > self.settings.shortest_step {
            let trial = &*w - direction * faer::Scale(length);
            let cost = self.cost(&trial);
            if cost <= before - self.settings.sufficient_decrease * length * decrement {
                *w = trial;
                return true;
            }
            length *= 0.5;
        }
        false
    }
}
