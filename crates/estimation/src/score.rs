//! What an effect beside the model would save of −log L, before it is fitted: the score test (Rao 1948).
//!
//! With g the gradient of −log L in the new parameters θ at θ = 0, and S what of their Fisher information the
//! model's own parameters w do not take up, S = H_θθ − H_θw·H_ww⁻¹·H_wθ, −log L falls by ½gᵀS⁻¹g at θ =
//! −S⁻¹g, once w has settled too. Under a right model twice that is χ² with as many degrees of freedom as θ
//! has. All that it asks of a candidate are its products with what the model leaves, with the model's columns
//! and with itself.

use super::evidence::periods_of_an_instant;
use super::likelihood::column;
use super::response::Response;
use super::sensitivity::Sensitivity;
use super::turning::{Believed, turned};
use super::{Evidence, MotionLikelihood, RowsAt, foresight};
use crate::{EstimationError, MotionLog, Robot, RobotModel};
use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, Par, Side};
use phiw_dynamics::dense::{Cholesky, dot};
use phiw_identification::design::RowLayout;
use phiw_identification::{Design, EffectSpec};
use std::ops::Range;

/// What an effect beside the model would save.
#[derive(Clone, Debug, PartialEq)]
pub struct Gain {
    /// The effect.
    pub effect: EffectSpec,
    /// −log L that it saves; twice its root is how many standard deviations an effect of one parameter is
    /// from nothing.
    pub gain: f64,
    /// What its parameters would be.
    pub parameters: Vec<f64>,
    /// What it saves less the price of its parameters; where constants were chosen, the mean over all of them
    /// (as likelihoods, not as logarithms), so that a constant on which nothing depends costs nothing.
    pub merit: f64,
}

/// Rows that are multiplied at a time.
const CHUNK: usize = 256;

impl MotionLikelihood {
    /// What each of the `candidates` would save beside a model that has been fitted to these logs with this
    /// estimator. None for one that the model already contains, that would break its own bounds, or whose
    /// columns look ahead in time: these depend on the noise of later periods.
    ///
    /// # Errors
    /// A log or a candidate is not of this robot.
    pub fn gains(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        candidates: &[EffectSpec],
    ) -> Result<Vec<Option<Gain>>, EstimationError> {
        let present = robot.design_of(model)?;
        let mut evidence = Evidence::none(&present, RowsAt::Periods)?;
        for log in logs {
            evidence.add(&present, log)?;
        }
        let precision: Vec<f64> = self.torque_noise.iter().map(|noise| noise.powi(-2)).collect();
        let w = model.parameters(robot)?;
        if let Some(under) = evidence.under(&present, &w, &self.standing_on)? {
            evidence = under;
        }
        let believed = Believed { parameters: w.clone(), standing_on: self.standing_on.clone() };
        let problem = self.problem(&present, &evidence)?;
        let nothing = || Ok(vec![None; candidates.len()]);
        let (gradient, responses) = problem.gradient(&column(&w));
        if responses.iter().any(Option::is_none) {
            return nothing();
        }
        let hessian = problem.hessian(&problem.log_determinant_curvature(&responses));
        let Ok(own) = hessian.llt(Side::Lower) else { return nothing() };

        let design = robot.design_beside(model, candidates)?;
        let mut score = Score::new(&design, present.effects().len(), w, precision);
        let foreseen = foresight::foreseen(&design);
        for log in logs {
            foresight::rows(&design, &foreseen, (log, Some(&believed)), |row| {
                score.add(row);
                Ok(())
            })?;
            score.flush();
        }
        self.add_determinants(robot, model, (candidates, logs), &foreseen, &evidence, &mut score)?;
        let ahead = foresight::looking_ahead(&design);

        let (mut own_score, mut cross) = (gradient, std::mem::replace(&mut score.cross, Mat::zeros(0, 0)));
        solve_lower_triangular_in_place(own.L(), own_score.as_mut(), Par::Seq);
        solve_lower_triangular_in_place(own.L(), cross.as_mut(), Par::Seq);
        let gain = |(index, effect): (usize, &EffectSpec)| {
            let range = score.range(index);
            let unseen = |parameter: usize| ahead[score.present + parameter];
            if range.clone().any(unseen) {
                return None;
            }
            let part = |a: usize| cross.col(a);
            let left = |a: usize, b: usize| {
                score.own[index][(a - range.start, b - range.start)] - part(a).transpose() * part(b)
            };
            let slope = |a: usize| score.gradient[a] - part(a).transpose() * own_score.col(0);
            let squares = range.clone().map(|a| score.own[index][(a - range.start, a - range.start)]);
            let s = Mat::from_fn(range.len(), range.len(), |a, b| left(range.start + a, range.start + b));
            let g: Vec<f64> = range.clone().map(slope).collect();
            let (gain, parameters) = newton(&s, &g, &squares.collect::<Vec<_>>(), self.score.least_left)?;
            let bounds = design.effects()[score.effects + index].parameters();
            let within = bounds.iter().zip(&parameters).all(|(parameter, value)| {
                let (lower, upper) = parameter.bounds;
                (lower..=upper).contains(value)
            });
            let merit = gain - self.score.parameter_price * parameters.len() as f64;
            within.then(|| Gain { effect: effect.clone(), gain, parameters, merit })
        };
        Ok(candidates.iter().enumerate().map(gain).collect())
    }

    /// The share of the log-determinants: of candidates that the noise of a period moves with the robot.
    fn add_determinants(
        &self,
        robot: &Robot,
        model: &RobotModel,
        (candidates, logs): (&[EffectSpec], &[MotionLog]),
        foreseen: &[bool],
        evidence: &Evidence,
        score: &mut Score<'_>,
    ) -> Result<(), EstimationError> {
        let moves = |index: &usize| {
            let effect = &score.design.effects()[score.effects + index];
            let turns = (0..score.range(*index).len()).any(|own| effect.turns_with(own).is_some());
            turns || score.range(*index).any(|parameter| !foreseen[score.present + parameter])
        };
        let moving: Vec<usize> = (0..candidates.len()).filter(moves).collect();
        if moving.is_empty() {
            return Ok(());
        }
        let chosen: Vec<EffectSpec> = moving.iter().map(|&index| candidates[index].clone()).collect();
        let design = robot.design_beside(model, &chosen)?;
        let places: Vec<usize> = moving.iter().flat_map(|&index| score.range(index)).collect();
        let still = |parameter: usize| match parameter.checked_sub(score.present) {
            None => foreseen[parameter],
            Some(place) => foreseen[score.present + places[place]],
        };
        let present = score.present;
        let believed = Believed { parameters: score.w.clone(), standing_on: self.standing_on.clone() };
        let mut w = column(&score.w);
        w.resize_with(design.parameter_count(), 1, |_, _| 0.0);
        let stills: Vec<bool> = (0..design.parameter_count()).map(still).collect();
        let mut all_turned = Vec::with_capacity(evidence.instants().len());
        for log in logs {
            let stride = periods_of_an_instant(log.period_s, evidence.settings.instant_every_s);
            all_turned.extend(turned(&design, &stills, (log, stride), Some(&believed))?);
        }
        let mut curvature = Mat::zeros(design.parameter_count(), places.len());
        let every = self.score.instants_every.max(1);
        let instants = || evidence.instants().iter();
        let all: f64 = instants().map(|instant| instant.weight).sum();
        let part: f64 = instants().skip(every / 2).step_by(every).map(|instant| instant.weight).sum();
        for (index, (instant, turned)) in instants().zip(&all_turned).enumerate() {
            let sensitivity = Sensitivity::of(&design, (instant, turned), &self.standing_on, still)?;
            let Some(response) = Response::of(&sensitivity, &w) else { continue };
            let slopes = response.gradient(&sensitivity, present);
            for (place, &parameter) in places.iter().enumerate() {
                score.gradient[parameter] -= sensitivity.weight * slopes[(place, 0)];
            }
            // A part of the instants is enough for a curvature, which is the dearest part.
            if index % every == every / 2 {
                let weight = sensitivity.weight * all / part;
                response.add_curvature(&sensitivity, present, weight, &mut curvature);
            }
        }
        let mut start = 0;
        for &index in &moving {
            let range = score.range(index);
            for (a, parameter) in range.clone().enumerate() {
                for own in 0..present {
                    score.cross[(own, parameter)] += curvature[(own, start + a)];
                }
                for b in 0..range.len() {
                    score.own[index][(a, b)] += curvature[(present + start + b, start + a)];
                }
            }
            start += range.len();
        }
        Ok(())
    }
}

/// Products of the candidates' columns, summed row by row and divided by the torques' variance.
struct Score<'a> {
    design: &'a Design,
    /// Effects and parameters of the model; what comes after them are candidates.
    effects: usize,
    present: usize,
    w: Vec<f64>,
    precision: Vec<f64>,
    torques: Vec<Chunk>,
    rows: usize,
    /// Of each candidate's parameter, with what the model leaves.
    gradient: Vec<f64>,
    /// With the model's columns: `[parameter of the model × parameter of a candidate]`.
    cross: Mat<f64>,
    /// Of each candidate's parameters with each other.
    own: Vec<Mat<f64>>,
}

/// Rows of one torque that wait: the model's columns and what it leaves, and the candidates' columns.
struct Chunk {
    known: Mat<f64>,
    added: Mat<f64>,
    /// Of each column of a candidate: which candidate, and which of its parameters.
    places: Vec<(usize, usize)>,
}

impl<'a> Score<'a> {
    fn new(design: &'a Design, effects: usize, w: Vec<f64>, precision: Vec<f64>) -> Self {
        let present = w.len();
        let candidates = design.effects().len() - effects;
        let of_parameter: Vec<(usize, usize)> = (0..candidates)
            .flat_map(|index| {
                (0..design.effect_parameters(effects + index).len()).map(move |own| (index, own))
            })
            .collect();
        let chunk = |layout: &RowLayout| {
            let known = layout.parameters.partition_point(|&parameter| parameter < present);
            let places: Vec<(usize, usize)> = layout.parameters[known..]
                .iter()
                .map(|&parameter| of_parameter[parameter - present])
                .collect();
            Chunk { known: Mat::zeros(CHUNK, known + 1), added: Mat::zeros(CHUNK, places.len()), places }
        };
        let own = |index: usize| {
            let size = design.effect_parameters(effects + index).len();
            Mat::zeros(size, size)
        };
        Score {
            torques: design.rows().iter().map(chunk).collect(),
            own: (0..candidates).map(own).collect(),
            gradient: vec![0.0; of_parameter.len()],
            cross: Mat::zeros(present, of_parameter.len()),
            rows: 0,
            design,
            effects,
            present,
            w,
            precision,
        }
    }

    /// The parameters of a candidate among those of all.
    fn range(&self, candidate: usize) -> Range<usize> {
        let range = self.design.effect_parameters(self.effects + candidate);
        range.start - self.present..range.end - self.present
    }

    fn add(&mut self, row: &[f64]) {
        let at = self.rows;
        for (chunk, layout) in self.torques.iter_mut().zip(self.design.rows()) {
            let values = &row[layout.range.clone()];
            let known = chunk.known.ncols() - 1;
            let mut left = -values[layout.parameters.len()];
            for (column, &parameter) in layout.parameters[..known].iter().enumerate() {
                chunk.known[(at, column)] = values[column];
                left += values[column] * self.w[parameter];
            }
            chunk.known[(at, known)] = left;
            for column in 0..chunk.places.len() {
                chunk.added[(at, column)] = values[known + column];
            }
        }
        self.rows += 1;
        if self.rows == CHUNK {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let rows = std::mem::take(&mut self.rows);
        let torques = self.torques.iter().zip(self.design.rows()).zip(&self.precision);
        for ((chunk, layout), &precision) in torques {
            let (known, added) = (chunk.known.get(..rows, ..), chunk.added.get(..rows, ..));
            let mut products = Mat::zeros(known.ncols(), added.ncols());
            matmul(&mut products, Accum::Replace, known.transpose(), added, precision, Par::Seq);
            let own = known.ncols() - 1;
            for (column, &(candidate, place)) in chunk.places.iter().enumerate() {
                let parameter = layout.parameters[own + column] - self.present;
                self.gradient[parameter] += products[(own, column)];
                for (index, &known) in layout.parameters[..own].iter().enumerate() {
                    self.cross[(known, parameter)] += products[(index, column)];
                }
                let same = chunk
                    .places
                    .iter()
                    .enumerate()
                    .skip(column)
                    .take_while(|(_, other)| other.0 == candidate);
                for (other, &(_, other_place)) in same {
                    let product = precision * (added.col(column).transpose() * added.col(other));
                    self.own[candidate][(place, other_place)] += product;
                    if other != column {
                        self.own[candidate][(other_place, place)] += product;
                    }
                }
            }
        }
    }
}

/// ½gᵀS⁻¹g and −S⁻¹g; none where the model leaves less than `least_left` of a column (`squares` are those of
/// the whole columns).
fn newton(s: &Mat<f64>, g: &[f64], squares: &[f64], least_left: f64) -> Option<(f64, Vec<f64>)> {
    let factor = Cholesky::of(g.len(), |row, column| s[(row, column)])?;
    let leaves_enough = |(row, square): (usize, &f64)| factor.entry(row, row).powi(2) > least_left * square;
    if !squares.iter().enumerate().all(leaves_enough) {
        return None;
    }
    let mut step = g.to_vec();
    factor.solve_lower(&mut step);
    let gain = 0.5 * dot(&step, &step);
    factor.solve_upper(&mut step);
    Some((gain, step.into_iter().map(|value| -value).collect()))
}
