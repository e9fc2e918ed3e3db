//! One pass over the logs with a model and candidates beside it.

use super::candidate::{Candidate, Candidates};
use super::evidence::{Evidence, Refit};
use phiw_dynamics::Tree;
use phiw_effects::Catalogue;
use phiw_identification::effect::ReferenceModel;
use phiw_identification::fitting::{accumulate, merge};
use phiw_identification::{Data, Design, Effect, EffectCatalogue, EffectSpec, IdentificationError};
use phiw_regressor::factor::{Factor, FactorBuilder};
use phiw_regressor::least_squares::GroupedFactor;
use phiw_regressor::{BaseParameters, RegressorError};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Mutex;

/// What stays the same over all passes of a trace.
pub(super) struct Fixed<'a> {
    pub tree: &'a Tree,
    pub base: BaseParameters,
    pub catalogue: &'a Catalogue,
    pub data: &'a Data<'a>,
    /// What was known before, over the parameters of the held model that its logs determined.
    pub prior: Option<Prior>,
    /// Hypotheses that could not be judged.
    pub not_judged: Mutex<BTreeSet<(String, Vec<String>)>>,
}

/// A held model's factor, and the parameters that its columns stand for.
pub(super) struct Prior {
    pub factor: Factor,
    pub parameters: Vec<usize>,
    /// Number of parameters that the held model has, determined or not.
    pub known: usize,
    /// 1/σ of each torque when it was fitted.
    pub weights: Vec<f64>,
}

/// Factors of a model and its candidates over all folds.
pub(super) struct Stage {
    pub design: Design,
    pub candidates: Vec<Candidate>,
    /// Number of the model's effects; the candidates' follow.
    pub model_effects: usize,
    pub train: GroupedFactor,
    pub held_out: GroupedFactor,
    pub folds: Vec<GroupedFactor>,
}

/// How a candidate is refitted.
#[derive(Clone, Copy)]
pub(super) enum Thoroughness {
    /// Quickly, for a first ranking.
    Screening,
    /// To full precision.
    Full,
}

/// A candidate and what a refit with it gave.
#[derive(Clone)]
pub(super) struct Judged {
    pub candidate: usize,
    pub refit: Refit,
    /// Gain in log-likelihood, correlated samples counted once, less a penalty for parameters and constants.
    pub score: f64,
    /// That penalty, and how many parameters and constants it counts.
    pub penalty: f64,
    pub counted: usize,
    /// Gain on the folds held out alone.
    pub held_out_gain: f64,
    pub parameters: Vec<usize>,
}

impl<'a> Fixed<'a> {
    pub fn build(&self, specs: &[EffectSpec]) -> Result<Vec<Box<dyn Effect>>, IdentificationError> {
        Ok(specs.iter().map(|spec| self.catalogue.build(spec, self.tree)).collect::<Result<_, _>>()?)
    }

    /// A rigid body and effects with numbers, for columns that need torques.
    pub fn reference(
        &self,
        specs: &[EffectSpec],
        parameters: &[f64],
    ) -> Result<ReferenceModel, IdentificationError> {
        let mut tree = self.tree.clone();
        let (base, mut rest) = parameters.split_at(self.base.count());
        tree.set_inertial_parameters(&self.base.to_standard(base, &self.tree.inertial_parameters())?)?;
        let mut effects = Vec::new();
        for effect in self.build(specs)? {
            let (own, others) = rest.split_at(effect.parameters().len());
            effects.push((effect, own.to_vec()));
            rest = others;
        }
        Ok(ReferenceModel::new(tree).with_effects(effects))
    }

    /// One pass over the logs: the model's columns, then the candidates'.
    pub fn pass(
        &self,
        specs: &[EffectSpec],
        candidates: Candidates,
        reference: ReferenceModel,
    ) -> Result<Stage, IdentificationError> {
        let mut effects = self.build(specs)?;
        let model_effects = effects.len();
        effects.extend(candidates.effects);
        let design = Design::new(self.tree.clone(), self.base.clone(), effects)
            .with_rest_speeds(self.data.rest_speeds.clone())
            .with_candidates_from(model_effects)
            .with_reference(reference);
        let all = [self.data.train.as_slice(), &self.data.held_out].concat();
        let folds = accumulate(&design, &all, &self.data.sources)?;
        let not_finite = design.not_finite();
        let (fit, unfit): (Vec<Candidate>, Vec<Candidate>) =
            candidates.list.into_iter().partition(|candidate| {
                !candidate.effects.clone().any(|effect| not_finite.contains(&(model_effects + effect)))
            });
        if let Ok(mut not_judged) = self.not_judged.lock() {
            let specs = unfit.into_iter().flat_map(|candidate| candidate.specs);
            not_judged.extend(specs.map(|spec| (spec.kind, spec.joints)));
        }
        let (train, held_out) = folds.split_at(self.data.train.len());
        Ok(Stage {
            model_effects,
            candidates: fit,
            train: merge(train)?,
            held_out: merge(held_out)?,
            folds,
            design,
        })
    }
}

impl Stage {
    /// Number of the model's parameters.
    pub fn model_size(&self) -> usize {
        match self.model_effects {
            0 => self.design.base().count(),
            count => self.design.effect_parameters(count - 1).end,
        }
    }

    /// Parameters of a candidate.
    pub fn parameters(&self, candidate: usize) -> Vec<usize> {
        let effects = self.candidates[candidate].effects.clone();
        effects.flat_map(|effect| self.design.effect_parameters(self.model_effects + effect)).collect()
    }

    /// Torques that a candidate acts on.
    pub fn rows(&self, candidate: usize) -> Vec<usize> {
        let effects = self.candidates[candidate].effects.clone();
        let mut rows: Vec<usize> = effects
            .flat_map(|effect| self.design.effects()[self.model_effects + effect].entries())
            .map(|entry| entry.row)
            .collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    /// Candidates whose columns would be the same if the model did not have the effect at `place`. A column
    /// of all torque that the model knows of has that effect in it, and does the effect's work under its own
    /// name where nothing else binds it.
    pub fn independent_of(&self, place: usize) -> Vec<usize> {
        let rows = self.rows_of(place);
        let made_of_it = |candidate: &usize| {
            let mut effects = self.candidates[*candidate].effects.clone();
            effects.any(|effect| self.design.effects()[self.model_effects + effect].needs().total_torque)
                && self.rows(*candidate).iter().any(|row| rows.contains(row))
        };
        (0..self.candidates.len()).filter(|candidate| !made_of_it(candidate)).collect()
    }

    /// Torques that an effect of the model acts on.
    pub fn rows_of(&self, place: usize) -> Vec<usize> {
        let entries = self.design.effects()[place].entries();
        let mut rows: Vec<usize> = entries.iter().map(|entry| entry.row).collect();
        rows.sort_unstable();
        rows.dedup();
        rows
    }

    /// Parameters of the model that the rows (and what was known before) determine.
    pub fn determined(&self, prior: Option<&Prior>) -> Result<Vec<bool>, RegressorError> {
        let model = self.model_size();
        if let Some(prior) = prior {
            return self.determined_beside(prior);
        }
        let kept: Vec<usize> = (0..model).collect();
        let selected = self.train.select(&kept)?;
        let scale = |group: &phiw_regressor::least_squares::Group| {
            let square = group.factor.right_hand_side_sum_of_squares() / group.factor.rows().max(1) as f64;
            if square > 0.0 { 1.0 / square.sqrt() } else { 1.0 }
        };
        let weights: Vec<f64> = selected.groups().iter().map(scale).collect();
        let undetermined = selected.combine(&weights)?.undetermined_columns();
        Ok((0..model).map(|parameter| !undetermined.contains(&parameter)).collect())
    }

    /// The same where a prior determines the base and the effects that it knew; those added since need the
    /// rows.
    fn determined_beside(&self, prior: &Prior) -> Result<Vec<bool>, RegressorError> {
        let model = self.model_size();
        // A parameter that was not determined then would take up what has come since: it stays out.
        let open: Vec<usize> = (0..model)
            .filter(|parameter| *parameter >= prior.known || prior.parameters.contains(parameter))
            .collect();
        let place = |parameter: &usize| open.binary_search(parameter).unwrap_or(open.len());
        let mut builder = FactorBuilder::new(open.len() + 1);
        let columns: Vec<usize> = prior.parameters.iter().map(place).chain([open.len()]).collect();
        builder.push_factor(&prior.factor, &columns, 1.0)?;
        let rows = self.train.select(&open)?.combine(&prior.weights)?;
        let all: Vec<usize> = (0..=open.len()).collect();
        builder.push_factor(&rows, &all, 1.0)?;
        let undetermined = builder.factor().undetermined_columns();
        let mut determined = vec![false; model];
        open.iter().enumerate().for_each(|(place, &parameter)| {
            determined[parameter] = !undetermined.contains(&place);
        });
        Ok(determined)
    }

    /// The evidence with the given weights.
    pub fn evidence<'a>(
        &'a self,
        determined: &[bool],
        weights: &[f64],
        prior: Option<&'a Factor>,
    ) -> Result<Evidence<'a>, RegressorError> {
        let folds = self.folds.iter().collect();
        Evidence::new(
            &self.train,
            &self.held_out,
            folds,
            self.model_size(),
            determined.to_vec(),
            weights.to_vec(),
            prior,
        )
    }

    /// Screens every candidate of `which`, or refits with it in full; those that leave nothing to identify,
    /// or break their bounds, are left out.
    ///
    /// `inflation` says how many correlated samples make one.
    pub fn judge(
        &self,
        evidence: &Evidence<'_>,
        before: &Refit,
        which: &[usize],
        thoroughness: Thoroughness,
        inflation: f64,
    ) -> Result<Vec<Judged>, RegressorError> {
        let judged: Result<Vec<Option<Judged>>, RegressorError> = which
            .par_iter()
            .map(|&candidate| {
                let parameters = self.parameters(candidate);
                let rows = self.rows(candidate);
                let refit = match thoroughness {
                    Thoroughness::Screening => evidence.screen(&parameters, &rows)?,
                    Thoroughness::Full => evidence.refit(&parameters, &rows)?,
                };
                let Some(refit) = refit else { return Ok(None) };
                if !self.within_bounds(candidate, &refit) {
                    return Ok(None);
                }
                let (train, held_out) = self.gain(before, &refit);
                // A parameter that the rows do not determine costs nothing.
                let heard =
                    parameters.iter().filter(|&&parameter| refit.parameters[parameter] != 0.0).count();
                let count = heard + self.candidates[candidate].constants;
                let penalty = self.penalty(&rows, count, inflation);
                let score = (train + held_out) / inflation - penalty;
                let held_out_gain = held_out / inflation;
                Ok(Some(Judged {
                    candidate,
                    refit,
                    score,
                    penalty,
                    counted: count,
                    held_out_gain,
                    parameters,
                }))
            })
            .collect();
        let mut judged: Vec<Judged> = judged?.into_iter().flatten().collect();
        judged.sort_by(|a, b| b.score.total_cmp(&a.score));
        Ok(judged)
    }

    /// What parameters and constants that act on `rows` cost (Schwarz 1978), correlated samples counted once.
    pub fn penalty(&self, rows: &[usize], count: usize, inflation: f64) -> f64 {
        let samples: u64 = rows.iter().map(|&row| self.train.groups()[row].factor.rows()).sum();
        0.5 * (samples as f64 / inflation).max(2.0).ln() * count as f64
    }

    /// Gain in log-likelihood of each torque's rows over `before`, with each torque's noise unknown:
    /// rows/2·ln(RSS⁰/RSS), training and held out.
    pub fn gain(&self, before: &Refit, after: &Refit) -> (f64, f64) {
        let gain = |factors: &GroupedFactor, before: &[f64], after: &[f64]| -> f64 {
            let of_group = |row: usize| {
                let rows = factors.groups()[row].factor.rows() as f64;
                if before[row] > 0.0 && after[row] > 0.0 {
                    0.5 * rows * (before[row] / after[row]).ln()
                } else {
                    0.0
                }
            };
            (0..before.len()).map(of_group).sum()
        };
        (
            gain(&self.train, &before.train, &after.train),
            gain(&self.held_out, &before.held_out, &after.held_out),
        )
    }

    fn within_bounds(&self, candidate: usize, refit: &Refit) -> bool {
        let effects = self.candidates[candidate].effects.clone();
        effects.map(|effect| self.model_effects + effect).all(|effect| {
            let info = self.design.effects()[effect].parameters();
            self.design.effect_parameters(effect).zip(info).all(|(parameter, info)| {
                let value = refit.parameters[parameter];
                info.bounds.0 <= value && value <= info.bounds.1
            })
        })
    }
}
