//! The search for what a model lacks.

use super::candidate::{Candidates, Occupied, enumerate};
use super::evidence::Refit;
use super::input::{TraceInput, TraceOptions};
use super::residuals::residual_shape;
use super::stage::{Fixed, Prior, Stage};
use super::tracing::{FoundEffect, Tracing};
use super::verdict::Account;
use phiw_effects::SignalRanges;
use phiw_identification::fitting::{TorqueError, torque_error};
use phiw_identification::{BlockSource, Data, Design, EffectSpec, IdentificationError, KeptBlocks};
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::GroupedFactor;
use phiw_regressor::{BaseParameters, RegressorError};
use std::sync::Mutex;

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
    let fixed = Fixed {
        tree: input.tree,
        base,
        catalogue: input.catalogue,
        data: input.data,
        prior,
        not_judged: Mutex::default(),
    };
    Search {
        fixed: &fixed,
        specs: input.declared.clone(),
        found: Vec::new(),
        dropped: Vec::new(),
        account: None,
        initial: None,
        before: None,
        residual_std: input.residual_std.clone(),
        input: &input,
        options,
    }
    .run()
}

/// A model on its way, and how it came about. A clone is a branch: a model that might be.
#[derive(Clone)]
pub(super) struct Search<'a> {
    pub(super) fixed: &'a Fixed<'a>,
    /// Effects of the model: those declared, then those found.
    pub(super) specs: Vec<EffectSpec>,
    pub(super) found: Vec<FoundEffect>,
    /// Effects that were found once and that others have made superfluous.
    pub(super) dropped: Vec<EffectSpec>,
    /// The error before the newest effects came in.
    pub(super) account: Option<Account>,
    /// Held-out residual sum of squares of each torque under the declared model.
    pub(super) initial: Option<Vec<f64>>,
    pub(super) before: Option<(TorqueError, TorqueError)>,
    /// Standard deviation of each torque's residual under the present model.
    pub(super) residual_std: Vec<f64>,
    pub(super) input: &'a TraceInput<'a>,
    pub(super) options: &'a TraceOptions,
}

/// A model, fitted, and what surrounds it in one pass.
pub(super) struct Fitted {
    pub(super) stage: Stage,
    pub(super) determined: Vec<bool>,
    pub(super) weights: Vec<f64>,
    pub(super) refit: Refit,
    pub(super) prior: Option<Factor>,
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
            let fitted = self.fitted(self.candidates(&ranges), &parameters)?;
            self.account(&fitted);
            if self.before.is_none() {
                self.before = Some(self.errors(&fitted, &fitted.refit.parameters)?);
                self.initial = Some(fitted.refit.held_out.clone());
            }
            if let Some(place) = self.superfluous(&fitted)? {
                parameters = self.refine_without(place, &fitted.refit.parameters)?;
                continue;
            }
            let (choice, ranking) = match self.found.len() < self.options.most_effects {
                true => self.choose(&fitted)?,
                false => (None, Vec::new()),
            };
            match choice {
                Some(choice) => (self, parameters) = self.with_choice(&fitted, choice, ranking)?,
                None => match self.unstable(&fitted)? {
                    Some(place) => parameters = self.refine_without(place, &fitted.refit.parameters)?,
                    None => return self.finish(fitted, ranking, &shape),
                },
            }
        }
    }

    pub(super) fn design(&self, specs: &[EffectSpec]) -> Result<Design, IdentificationError> {
        let rest_speeds = self.input.data.rest_speeds.clone();
        Ok(Design::new(self.fixed.tree.clone(), self.fixed.base.clone(), self.fixed.build(specs)?)
            .with_rest_speeds(rest_speeds))
    }

    fn candidates(&self, ranges: &SignalRanges) -> Candidates {
        let found = &self.specs[self.input.declared.len()..];
        let closed: Vec<&EffectSpec> =
            found.iter().chain(&self.dropped).chain(&self.options.excluded).collect();
        let occupied = Occupied { present: &self.specs, closed: &closed, held: self.input.held.is_some() };
        let all = enumerate(self.fixed.catalogue, self.fixed.tree, ranges, &occupied);
        match &self.options.torques {
            Some(torques) => all.acting_on(torques),
            None => all,
        }
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

    pub(super) fn is_held(&self, place: usize) -> bool {
        self.input.held.is_some() && place < self.input.declared.len()
    }

    /// Whether the effect at `place` is in force through its point of linearisation, so that taking its
    /// columns away does not take it away.
    pub(super) fn is_linearised(&self, spec: &EffectSpec) -> Result<bool, IdentificationError> {
        let built = self.fixed.build(std::slice::from_ref(spec))?;
        let mut linearised =
            built.iter().map(|effect| effect.relinearised(&vec![0.0; effect.parameters().len()]).is_some());
        Ok(linearised.any(|is| is))
    }
}

const NOT_DETERMINED: &str =
    "the training logs do not determine the declared model: add motion, or declare fewer effects";
/// Conditioned samples that are kept between passes; longer logs are read again \[bytes\].
const KEPT_BYTES: usize = 64 << 20;

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

/// RMS of the error over RMS of the torque, all torques pooled.
pub(super) fn relative(factors: &GroupedFactor, squares: &[f64]) -> f64 {
    let torque: f64 =
        factors.groups().iter().map(|group| group.factor.right_hand_side_sum_of_squares()).sum();
    (squares.iter().sum::<f64>() / torque).sqrt()
}

fn resized(parameters: &[f64], size: usize) -> Vec<f64> {
    let mut resized = parameters.to_vec();
    resized.resize(size, 0.0);
    resized
}
