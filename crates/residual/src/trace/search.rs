//! The search for what a model lacks.

use super::candidate::{Candidates, enumerate};
use super::evidence::{Refit, paired_t};
use super::input::{TraceInput, TraceOptions};
use super::probe;
use super::residuals::{ResidualShape, residual_shape};
use super::stage::{Fixed, Judged, Prior, Stage};
use super::tracing::{FoundEffect, Ranked, Remaining, RivalEffect, Tracing, Verdict};
use crate::catalogue::SignalRanges;
use phiw_identification::{
    BlockSource, Data, Design, EffectSpec, IdentificationError, Identified, KeptBlocks, TorqueError, fit,
    torque_error,
};
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::GroupedFactor;
use phiw_regressor::{BaseParameters, RegressorError};

/// Traces the residual of the declared (or held) model.
///
/// # Errors
/// A log cannot be read, or holds too little for the declared model.
pub fn trace(input: TraceInput<'_>, options: &TraceOptions) -> Result<Tracing, IdentificationError> {
    let kept = KeptBlocks::keep(&input.data.sources, KEPT_BYTES)?;
    let data = Data {
        train: input.data.train.clone(),
        held_out: input.data.held_out.clone(),
        sources: kept.iter().map(|kept| kept as &dyn BlockSource).collect(),
        rest_speeds: input.data.rest_speeds.clone(),
    };
    let input = TraceInput { data: &data, ..input };
    let base = BaseParameters::of_tree(input.tree, Default::default())?;
    let prior = input.held.as_ref().map(|held| Prior {
        factor: held.factor.clone(),
        parameters: held.determined.clone(),
        known: input.parameters.len(),
        weights: held.residual_std.iter().map(|std| 1.0 / std.max(f64::MIN_POSITIVE)).collect(),
    });
    let fixed = Fixed { tree: input.tree, base, catalogue: input.catalogue, data: input.data, prior };
    let residual_std = input.residual_std.clone();
    Search {
        fixed,
        specs: input.declared.clone(),
        found: Vec::new(),
        before: None,
        residual_std,
        input: &input,
        options,
    }
    .run()
}

pub(super) struct Search<'a> {
    pub(super) fixed: Fixed<'a>,
    pub(super) specs: Vec<EffectSpec>,
    found: Vec<FoundEffect>,
    before: Option<(TorqueError, TorqueError)>,
    /// Standard deviation of each torque's residual under the present model.
    pub(super) residual_std: Vec<f64>,
    pub(super) input: &'a TraceInput<'a>,
    options: &'a TraceOptions,
}

/// A model, fitted, and what surrounds it in one pass.
pub(super) struct Fitted {
    pub(super) stage: Stage,
    pub(super) determined: Vec<bool>,
    weights: Vec<f64>,
    pub(super) refit: Refit,
    prior: Option<Factor>,
}

impl Search<'_> {
    fn run(mut self) -> Result<Tracing, IdentificationError> {
        // The constants of the declared effects come from a grid.
        let mut parameters = self.refine(self.input.parameters.clone())?;
        loop {
            let mut ranges = self.input.ranges.clone();
            let design =
                self.design(&self.specs)?.with_reference(self.fixed.reference(&self.specs, &parameters)?);
            let positions: Vec<(f64, f64)> = ranges.joints.iter().map(|joint| joint.position).collect();
            let data = self.input.data;
            let all = [data.train.as_slice(), &data.held_out].concat();
            let shape = residual_shape(&design, &parameters, &all, &data.sources, &positions)?;
            ranges.ripple_frequencies = shape.ripple_frequencies.clone();
            let candidates = self.candidates(&ranges);
            let mut fitted = self.fitted(candidates, &parameters)?;
            if self.before.is_none() {
                let errors = self.errors(&fitted, &fitted.refit.parameters)?;
                self.before = Some(errors);
            }
            let (chosen, ranking) = match self.found.len() < self.options.most_effects {
                true => self.choose(&mut fitted)?,
                false => (None, Vec::new()),
            };
            let Some(chosen) = chosen else { return self.finish(fitted, ranking, &shape) };
            parameters = self.add(&fitted, chosen, ranking);
            parameters = self.refine(parameters)?;
        }
    }

    pub(super) fn design(&self, specs: &[EffectSpec]) -> Result<Design, IdentificationError> {
        let rest_speeds = self.input.data.rest_speeds.clone();
        Ok(Design::new(self.fixed.tree.clone(), self.fixed.base.clone(), self.fixed.build(specs)?)
            .with_rest_speeds(rest_speeds))
    }

    fn candidates(&self, ranges: &SignalRanges) -> Candidates {
        enumerate(self.fixed.catalogue, self.fixed.tree, ranges, &self.specs, self.input.held.is_some())
    }

    /// One pass with candidates beside the model, and the model's own weighted fit.
    pub(super) fn fitted(
        &self,
        candidates: Candidates,
        parameters: &[f64],
    ) -> Result<Fitted, IdentificationError> {
        let reference = self.fixed.reference(&self.specs, parameters)?;
        let stage = self.fixed.pass(&self.specs, candidates, reference)?;
        let determined = stage.determined(self.fixed.prior.as_ref())?;
        let prior = self.prior_over(&determined)?;
        let (weights, refit) = self.weighted(&stage, &determined, prior.as_ref())?;
        Ok(Fitted { stage, determined, weights, refit, prior })
    }

    /// The held model's factor over the determined parameters of the grown model, in their order.
    pub(super) fn prior_over(&self, determined: &[bool]) -> Result<Option<Factor>, RegressorError> {
        let Some(prior) = &self.fixed.prior else { return Ok(None) };
        let kept: Vec<usize> = (0..determined.len()).filter(|&parameter| determined[parameter]).collect();
        let columns: Vec<usize> = prior
            .parameters
            .iter()
            .map(|parameter| kept.iter().position(|other| other == parameter).unwrap_or(kept.len()))
            .chain([kept.len()])
            .collect();
        let mut builder = phiw_regressor::factor::FactorBuilder::new(kept.len() + 1);
        builder.push_factor(&prior.factor, &columns, 1.0)?;
        Ok(Some(builder.factor()))
    }

    /// The model's fit with weights iterated from its own residual.
    fn weighted(
        &self,
        stage: &Stage,
        determined: &[bool],
        prior: Option<&Factor>,
    ) -> Result<(Vec<f64>, Refit), IdentificationError> {
        let mut weights = match &self.fixed.prior {
            Some(prior) => prior.weights.clone(),
            None => rms(&stage.train).iter().map(|rms| 1.0 / rms.max(1e-12)).collect(),
        };
        let mut refit = None;
        for _ in 0..4 {
            let evidence = stage.evidence(determined, &weights, prior)?;
            let every: Vec<usize> = (0..stage.train.groups().len()).collect();
            let fitted = evidence.refit(&[], &every)?;
            let fitted = fitted.ok_or_else(|| IdentificationError::Model(NOT_DETERMINED.to_owned()))?;
            weights = weights_of(&stage.train, &fitted.train);
            refit = Some(fitted);
        }
        let refit = refit.ok_or_else(|| IdentificationError::Model(NOT_DETERMINED.to_owned()))?;
        Ok((weights, refit))
    }

    /// Errors of parameters over the model of a stage.
    fn errors(
        &self,
        fitted: &Fitted,
        parameters: &[f64],
    ) -> Result<(TorqueError, TorqueError), IdentificationError> {
        let held;
        let parameters = match self.input.held.is_some() && self.found.is_empty() {
            true => {
                held = resized(&self.input.parameters, fitted.stage.train.parameter_count());
                &held
            }
            false => parameters,
        };
        let (train, held_out) = fitted.stage.folds.split_at(self.input.data.train.len());
        Ok((torque_error(train, parameters)?, torque_error(held_out, parameters)?))
    }

    /// The best candidate if it is believed, and the ranking.
    fn choose(&self, fitted: &mut Fitted) -> Result<(Option<Choice>, Vec<Ranked>), IdentificationError> {
        let stage = &fitted.stage;
        let inflation = self.input.rows_per_independent;
        let all: Vec<usize> = (0..stage.candidates.len()).collect();
        let evidence = stage.evidence(&fitted.determined, &fitted.weights, fitted.prior.as_ref())?;
        evidence.prepare()?;
        let judged = stage.judge(&evidence, &fitted.refit, &all, inflation)?;
        let Some(first) = judged.first() else { return Ok((None, Vec::new())) };
        // With the best candidate in, the torques' noise is better known: judge the others by it.
        let weights = weights_of(&stage.train, &first.refit.train);
        let evidence = stage.evidence(&fitted.determined, &weights, fitted.prior.as_ref())?;
        let near: Vec<usize> = judged.iter().take(FINALISTS).map(|judged| judged.candidate).collect();
        let judged = stage.judge(&evidence, &fitted.refit, &near, inflation)?;
        let best_of_each = best_of_each(stage, judged);
        let ranking: Vec<Ranked> =
            best_of_each.iter().take(10).map(|judged| self.ranked(stage, judged)).collect();
        let Some(best) = best_of_each.first() else { return Ok((None, ranking)) };

        // The simplest that the folds cannot tell from the best.
        let std: Vec<f64> =
            weights_of(&stage.train, &best.refit.train).iter().map(|weight| 1.0 / weight).collect();
        let reference = evidence.fold_errors(&best.refit, &std)?;
        let nothing = evidence.fold_errors(&fitted.refit, &std)?;
        let total: f64 = nothing.iter().zip(&reference).map(|(a, b)| a - b).sum();
        let mut equals = vec![best.clone()];
        for other in best_of_each.iter().skip(1) {
            let errors = evidence.fold_errors(&other.refit, &std)?;
            let lost: f64 = errors.iter().zip(&reference).map(|(a, b)| a - b).sum();
            let t = paired_t(&errors, &reference);
            let near = best.score - other.score < NEAR_SCORE.max(NEAR_SHARE * best.score);
            if (t < INDISTINGUISHABLE && near) || lost < NEGLIGIBLE * total {
                equals.push(other.clone());
            }
        }
        equals.sort_by_key(|judged| complexity(stage, judged));
        let chosen = equals[0].clone();
        let heard: Vec<usize> = chosen
            .parameters
            .iter()
            .copied()
            .filter(|&parameter| chosen.refit.parameters[parameter] != 0.0)
            .collect();
        let significance = evidence.significance(&heard)?;
        let weigh = |judged: &Judged| (judged.score - best.score).max(-700.0).exp();
        let sum: f64 = equals.iter().map(weigh).sum();
        let share = |judged: &Judged| (judged.candidate, weigh(judged) / sum);
        let rivals: Vec<(usize, f64)> =
            equals.iter().skip(1).map(share).filter(|(_, share)| *share >= LEAST_RIVAL).collect();
        let confidence = weigh(&chosen) / sum;
        let believed = self.believed(fitted, &chosen, significance);
        Ok((believed.then_some(Choice { judged: chosen, significance, confidence, rivals }), ranking))
    }

    fn believed(&self, fitted: &Fitted, chosen: &Judged, significance: f64) -> bool {
        let stage = &fitted.stage;
        let mut share: f64 = 0.0;
        let mut size: f64 = 0.0;
        for row in stage.rows(chosen.candidate) {
            let (before, after) = (fitted.refit.held_out[row], chosen.refit.held_out[row]);
            let factor = &stage.held_out.groups()[row].factor;
            share = share.max(1.0 - after / before.max(f64::MIN_POSITIVE));
            let torque = factor.right_hand_side_sum_of_squares().max(f64::MIN_POSITIVE);
            size = size.max(((before - after).max(0.0) / torque).sqrt());
        }
        chosen.held_out_gain > 0.0
            && significance >= self.options.least_significance
            && share >= self.options.least_share
            && size >= self.options.least_size
    }

    fn ranked(&self, stage: &Stage, judged: &Judged) -> Ranked {
        Ranked {
            spec: stage.candidates[judged.candidate].specs[0].clone(),
            parameters: judged.parameters.len(),
            held_out: relative(&stage.held_out, &judged.refit.held_out),
        }
    }

    /// Puts the chosen effect into the model; gives the grown model's parameters.
    fn add(&mut self, fitted: &Fitted, choice: Choice, ranking: Vec<Ranked>) -> Vec<f64> {
        let stage = &fitted.stage;
        let before = relative(&stage.held_out, &fitted.refit.held_out);
        let after = relative(&stage.held_out, &choice.judged.refit.held_out);
        let rivals: Vec<RivalEffect> = choice
            .rivals
            .iter()
            .map(|&(candidate, confidence)| RivalEffect {
                spec: stage.candidates[candidate].specs[0].clone(),
                confidence,
            })
            .collect();
        let above = |squares: &[f64]| -> f64 {
            let of_row = |row: usize| {
                let rows = stage.held_out.groups()[row].factor.rows() as f64;
                (squares[row] - rows * self.input.noise_floor[row].powi(2)).max(0.0)
            };
            (0..squares.len()).map(of_row).sum()
        };
        let (left, had) = (above(&choice.judged.refit.held_out), above(&fitted.refit.held_out));
        let explains = if had > 0.0 { (1.0 - left / had).clamp(0.0, 1.0) } else { 0.0 };
        for spec in &stage.candidates[choice.judged.candidate].specs {
            self.specs.push(spec.clone());
            self.found.push(FoundEffect {
                spec: spec.clone(),
                relative: after,
                relative_before: before,
                explains,
                confidence: choice.confidence,
                significance: choice.significance,
                rivals: rivals.clone(),
                ranking: ranking.clone(),
            });
        }
        let parameters = &choice.judged.refit.parameters;
        let added = choice.judged.parameters.iter().map(|&parameter| parameters[parameter]);
        parameters[..stage.model_size()].iter().copied().chain(added).collect()
    }

    pub(super) fn is_held(&self, place: usize) -> bool {
        self.input.held.is_some() && place < self.input.declared.len()
    }

    fn finish(
        self,
        fitted: Fitted,
        ranking: Vec<Ranked>,
        shape: &ResidualShape,
    ) -> Result<Tracing, IdentificationError> {
        let stage = fitted.stage;
        let model = stage.model_size();
        let kept: Vec<usize> = (0..model).collect();
        let folds: Result<Vec<GroupedFactor>, RegressorError> =
            stage.folds.iter().map(|fold| fold.select(&kept)).collect();
        let mut train_folds = folds?;
        let held_out_folds = train_folds.split_off(self.input.data.train.len());
        let design = self.design(&self.specs)?;
        let mut final_fit = fit(&design, &train_folds)?;
        if self.input.held.is_some() {
            final_fit.parameters = fitted.refit.parameters[..model].to_vec();
        }
        if self.input.held.is_some() && self.found.is_empty() {
            final_fit.parameters = self.input.parameters.clone();
        }
        let after = (
            torque_error(&train_folds, &final_fit.parameters)?,
            torque_error(&held_out_folds, &final_fit.parameters)?,
        );
        let remaining = self.remaining(&final_fit.parameters, &after.1, ranking, shape)?;
        let design = design.with_reference(self.fixed.reference(&self.specs, &final_fit.parameters)?);
        let verdict = match (self.found.is_empty(), remaining.joints.is_empty()) {
            (true, true) => Verdict::Sufficient,
            (true, false) => Verdict::Unexplained,
            (false, true) => Verdict::Explained,
            (false, false) => Verdict::PartlyExplained,
        };
        let before = self.before.unwrap_or_else(|| after.clone());
        let declared = self.input.declared.len();
        let mut found = self.found;
        found.iter_mut().zip(&self.specs[declared..]).for_each(|(effect, spec)| effect.spec = spec.clone());
        let model = Identified {
            design,
            fit: final_fit,
            train: after.0,
            held_out: after.1,
            train_folds,
            held_out_folds,
        };
        Ok(Tracing { verdict, specs: self.specs, model, before, effects: found, remaining })
    }

    /// Which residuals have structure, and what they follow.
    fn remaining(
        &self,
        parameters: &[f64],
        held_out: &TorqueError,
        ranking: Vec<Ranked>,
        shape: &ResidualShape,
    ) -> Result<Remaining, IdentificationError> {
        let structured: Vec<usize> = (0..held_out.rmse.len())
            .filter(|&row| {
                held_out.rmse[row] > self.options.floor_margin * self.input.noise_floor[row]
                    && shape.autocorrelation[row].abs() > self.options.structured_correlation
            })
            .collect();
        let reference = self.fixed.reference(&self.specs, parameters)?;
        let probed =
            probe::probe(&self.fixed, &self.specs, reference, parameters, &self.input.ranges, &structured)?;
        let names: Vec<String> = self.fixed.tree.joint_names().map(str::to_owned).collect();
        let joints = structured.iter().map(|&row| names[row].clone()).collect();
        Ok(Remaining { joints, depends_on: probed, ranking })
    }
}

/// A candidate that was chosen, with those that the data could not tell from it.
struct Choice {
    judged: Judged,
    significance: f64,
    confidence: f64,
    rivals: Vec<(usize, f64)>,
}

const NOT_DETERMINED: &str =
    "the training logs do not determine the declared model: add motion, or declare fewer effects";
/// Conditioned samples that are kept between passes; longer logs are read again \[bytes\].
const KEPT_BYTES: usize = 64 << 20;
/// Candidates that are judged a second time.
const FINALISTS: usize = 60;
/// Paired t of two candidates' errors over the folds below which they are told apart by nothing.
const INDISTINGUISHABLE: f64 = 2.5;
/// Share of the gain that a simpler candidate may lose.
const NEGLIGIBLE: f64 = 0.01;
/// Log-likelihood, and share of the best one's, by which a simpler candidate may be worse and still be taken.
const NEAR_SCORE: f64 = 6.0;
const NEAR_SHARE: f64 = 0.02;
/// A rival that is less probable is none.
const LEAST_RIVAL: f64 = 0.01;

/// The best variant of each hypothesis, best first.
fn best_of_each(stage: &Stage, judged: Vec<Judged>) -> Vec<Judged> {
    let mut best: Vec<Judged> = Vec::new();
    for candidate in judged {
        let hypothesis = stage.candidates[candidate.candidate].hypothesis();
        if !best.iter().any(|other| stage.candidates[other.candidate].hypothesis() == hypothesis) {
            best.push(candidate);
        }
    }
    best
}

/// Parameters first, then the catalogue's order.
fn complexity(stage: &Stage, judged: &Judged) -> (usize, usize) {
    let candidate = &stage.candidates[judged.candidate];
    (judged.parameters.len() + candidate.constants, candidate.rank)
}

fn rms(factors: &GroupedFactor) -> Vec<f64> {
    let of_group = |group: &phiw_regressor::least_squares::Group| {
        (group.factor.right_hand_side_sum_of_squares() / group.factor.rows().max(1) as f64).sqrt()
    };
    factors.groups().iter().map(of_group).collect()
}

pub(super) fn weights_of(factors: &GroupedFactor, squares: &[f64]) -> Vec<f64> {
    let torque = rms(factors);
    let weight = |row: usize| {
        let rows = factors.groups()[row].factor.rows().max(1) as f64;
        1.0 / (squares[row] / rows).sqrt().max(1e-9 * torque[row]).max(f64::MIN_POSITIVE.sqrt())
    };
    (0..squares.len()).map(weight).collect()
}

fn relative(factors: &GroupedFactor, squares: &[f64]) -> f64 {
    let torque: f64 =
        factors.groups().iter().map(|group| group.factor.right_hand_side_sum_of_squares()).sum();
    (squares.iter().sum::<f64>() / torque).sqrt()
}

fn resized(parameters: &[f64], size: usize) -> Vec<f64> {
    let mut resized = parameters.to_vec();
    resized.resize(size, 0.0);
    resized
}
