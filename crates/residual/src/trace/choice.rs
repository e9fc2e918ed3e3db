//! Which candidate enters the model: the simplest that explains, after a contest of those that are near.

use super::candidate::Candidates;
use super::evidence::{Evidence, Refit, paired_t};
use super::search::{Fitted, Search, relative, weights_of};
use super::stage::{Judged, Stage, Thoroughness};
use super::tracing::{FoundEffect, Ranked, RivalEffect};
use phiw_identification::IdentificationError;
use phiw_regressor::RegressorError;

/// What is to be done to the model.
pub(super) struct Choice {
    /// The chosen candidate first, then those that could be in its place.
    entrants: Vec<Judged>,
    significance: f64,
    /// The place of an effect found earlier that the chosen one replaces.
    replaces: Option<usize>,
}

/// Candidates that are judged to full precision.
const FINALISTS: usize = 60;
/// Paired t of two candidates' errors over the folds below which they are told apart by nothing.
const INDISTINGUISHABLE: f64 = 2.5;
/// Share of the gain that a simpler candidate may lose.
const NEGLIGIBLE: f64 = 0.01;
/// Log-likelihood, and share of the best one's, by which a simpler candidate may be worse and still be taken.
const NEAR_SCORE: f64 = 6.0;
const NEAR_SHARE: f64 = 0.02;
/// Share of the best one's score from which a candidate may still win once it is refined: one that is linear
/// only to first order, or a simpler one beside which the declared signs have not their best widths yet.
const UNREFINED_SHARE: f64 = 0.7;
/// Candidates that are asked whether they are believed.
const TRIES: usize = 4;
/// Candidates that are tried in full.
const ENTRANTS: usize = 5;
/// What an effect that the model has taken up in part must be above the least of the others: share of a
/// residual; times the size; times the significance.
const ABSORBED_SHARE: f64 = 0.25;
const ABSORBED_SIZE: f64 = 3.0;
const ABSORBED_SIGNIFICANCE: f64 = 1.5;
/// Times the least significance for what is linear to first order only.
const FIRST_ORDER: f64 = 0.25;
/// Times the residual that a held model left when it was fitted.
const AS_IT_WAS: f64 = 1.1;
/// A rival that is less probable is none.
pub const LEAST_RIVAL: f64 = 0.05;

impl Search<'_> {
    /// The best candidate if it is believed, and the ranking.
    pub(super) fn choose(
        &self,
        fitted: &Fitted,
    ) -> Result<(Option<Choice>, Vec<Ranked>), IdentificationError> {
        let stage = &fitted.stage;
        let inflation = self.input.rows_per_independent;
        let all: Vec<usize> = (0..stage.candidates.len()).collect();
        let evidence = stage.evidence(&fitted.determined, &fitted.weights, fitted.prior.as_ref())?;
        let judged = stage.judge(&evidence, &fitted.refit, &all, Thoroughness::Screening, inflation)?;
        let Some(first) = judged.first() else { return Ok((None, Vec::new())) };
        // With the best candidate in, the torques' noise is better known: judge the others by it.
        let weights = weights_of(&stage.train, &first.refit.train);
        let evidence = stage.evidence(&fitted.determined, &weights, fitted.prior.as_ref())?;
        let near: Vec<usize> = judged.iter().take(FINALISTS).map(|judged| judged.candidate).collect();
        let judged = stage.judge(&evidence, &fitted.refit, &near, Thoroughness::Full, inflation)?;
        let mut open = best_of_each(stage, judged);
        let ranked = |judged: &Judged| self.ranked(stage, judged);
        let ranking: Vec<Ranked> = open.iter().take(10).map(ranked).collect();
        // One that is not believed does not stand in the way of the next.
        let mut believed = None;
        for _ in 0..TRIES {
            let Some(entrants) = self.entrants(fitted, &evidence, &open)? else { break };
            let chosen = &entrants[0];
            let heard: Vec<usize> = chosen
                .parameters
                .iter()
                .copied()
                .filter(|&parameter| chosen.refit.parameters[parameter] != 0.0)
                .collect();
            let significance = evidence.significance(&heard)?;
            if self.is_believed(fitted, chosen, significance)? {
                believed = Some((entrants, significance));
                break;
            }
            open.retain(|judged| entrants.iter().all(|entrant| entrant.candidate != judged.candidate));
        }
        let Some((entrants, significance)) = believed else { return Ok((None, ranking)) };
        let chosen = &entrants[0];
        let replacement = self.replacement(fitted, &weights, chosen.score - near_score(chosen.score))?;
        Ok(match replacement {
            Some((place, judged)) => {
                (Some(Choice { entrants: vec![judged], significance, replaces: Some(place) }), ranking)
            }
            None => (Some(Choice { entrants, significance, replaces: None }), ranking),
        })
    }

    /// The simplest candidate that the folds cannot tell from the best, then those that it is to be compared
    /// with. `None`: there is no candidate.
    fn entrants(
        &self,
        fitted: &Fitted,
        evidence: &Evidence<'_>,
        best_of_each: &[Judged],
    ) -> Result<Option<Vec<Judged>>, IdentificationError> {
        let stage = &fitted.stage;
        let Some(best) = best_of_each.first() else { return Ok(None) };
        let std: Vec<f64> =
            weights_of(&stage.train, &best.refit.train).iter().map(|weight| 1.0 / weight).collect();
        let reference = evidence.fold_errors(&best.refit, &std)?;
        let nothing = evidence.fold_errors(&fitted.refit, &std)?;
        let total: f64 = nothing.iter().zip(&reference).map(|(a, b)| a - b).sum();
        let mut equals = vec![best.clone()];
        let mut others = Vec::new();
        for other in best_of_each.iter().skip(1) {
            let errors = evidence.fold_errors(&other.refit, &std)?;
            let lost: f64 = errors.iter().zip(&reference).map(|(a, b)| a - b).sum();
            let t = paired_t(&errors, &reference);
            let near = best.score - other.score < near_score(best.score);
            if (t < INDISTINGUISHABLE && near) || lost < NEGLIGIBLE * total {
                equals.push(other.clone());
            } else if other.score > UNREFINED_SHARE * best.score {
                let spec = &stage.candidates[other.candidate].specs[0];
                if self.is_linearised(spec)? || complexity(stage, other) < complexity(stage, best) {
                    others.push(other.clone());
                }
            }
        }
        equals.sort_by_key(|judged| complexity(stage, judged));
        let simplest = equals[0].candidate;
        // After the simplest those that are nearest.
        equals[1..].sort_by(|a, b| b.score.total_cmp(&a.score));
        let highest = equals.iter().map(|judged| judged.score).fold(f64::NEG_INFINITY, f64::max);
        let weight = |judged: &Judged| (judged.score - highest).exp();
        let sum: f64 = equals.iter().map(weight).sum();
        equals.retain(|judged| judged.candidate == simplest || weight(judged) / sum >= 0.2 * LEAST_RIVAL);
        equals.extend(others);
        equals.truncate(ENTRANTS);
        Ok(Some(equals))
    }

    /// Whether a candidate is sure enough, and worth a name, also on motion held out.
    fn is_believed(
        &self,
        fitted: &Fitted,
        chosen: &Judged,
        significance: f64,
    ) -> Result<bool, IdentificationError> {
        let stage = &fitted.stage;
        let rows = stage.rows(chosen.candidate);
        // What is linear to first order only is judged before it is in force: its columns are not yet what
        // they will be.
        let linearised = self.is_linearised(&stage.candidates[chosen.candidate].specs[0])?;
        let needed = if linearised { FIRST_ORDER } else { 1.0 } * self.options.least_significance;
        Ok(chosen.held_out_gain > 0.0
            && significance >= needed
            && self.matters(stage, &rows, &chosen.parameters, significance, &fitted.refit, &chosen.refit)?)
    }

    /// Whether what lies between two fits, one without and one with the parameters `own`, which act on
    /// `rows`, is worth a name.
    ///
    /// It must take away a share of the residual of a torque that it acts on, and be a share of that torque.
    /// Where the other parameters have taken up most of it, it is to be seen on any torque, and must be a
    /// share of its torque by itself; the evidence must then be stronger.
    pub(super) fn matters(
        &self,
        stage: &Stage,
        rows: &[usize],
        own: &[usize],
        significance: f64,
        without: &Refit,
        with: &Refit,
    ) -> Result<bool, RegressorError> {
        let options = self.options;
        let mut effect = vec![0.0; with.parameters.len()];
        own.iter().for_each(|&parameter| effect[parameter] = with.parameters[parameter]);
        let (mut largest_share, mut size): (f64, f64) = (0.0, 0.0);
        let mut seen = false;
        for (row, group) in stage.held_out.groups().iter().enumerate() {
            let (before, after) = (without.held_out[row], with.held_out[row]);
            if self.is_as_it_was(row, before, group.factor.rows()) {
                continue;
            }
            let torque = group.factor.right_hand_side_sum_of_squares().max(f64::MIN_POSITIVE);
            let taken = (before - after).max(0.0);
            let share = taken / before.max(f64::MIN_POSITIVE);
            largest_share = largest_share.max(share);
            // The form of an effect is never quite the catalogue's: a small part of what the others took is
            // no effect of its own.
            let by_others = self.initial.as_ref().map_or(0.0, |initial| initial[row] - before);
            seen |= rows.contains(&row)
                && share >= options.least_share
                && taken >= options.least_of_others * by_others
                && (taken / torque).sqrt() >= options.least_size;
            let values: Vec<f64> = group.parameters.iter().map(|&parameter| effect[parameter]).collect();
            size = size.max((group.factor.product_sum_of_squares(&values)? / torque).sqrt());
        }
        let absorbed = largest_share >= ABSORBED_SHARE
            && size >= ABSORBED_SIZE * options.least_size
            && significance >= ABSORBED_SIGNIFICANCE * options.least_significance;
        Ok(seen || absorbed)
    }

    /// Whether a torque's residual is no larger than it was when the held model was fitted: then nothing has
    /// changed there since.
    fn is_as_it_was(&self, row: usize, squares: f64, rows: u64) -> bool {
        let held = self.input.held.as_ref();
        held.is_some_and(|held| (squares / rows.max(1) as f64).sqrt() <= AS_IT_WAS * held.residual_std[row])
    }

    fn ranked(&self, stage: &Stage, judged: &Judged) -> Ranked {
        Ranked {
            spec: stage.candidates[judged.candidate].specs[0].clone(),
            parameters: judged.parameters.len(),
            held_out: relative(&stage.held_out, &judged.refit.held_out),
        }
    }

    /// The branch in which the choice is in the model, constants refined, and its parameters.
    ///
    /// Where there are several entrants, each gets a branch of its own: an effect that is linear only to
    /// first order, or whose constants come from a coarse grid, shows what it can explain after it is
    /// refined.
    pub(super) fn with_choice(
        &self,
        fitted: &Fitted,
        choice: Choice,
        ranking: Vec<Ranked>,
    ) -> Result<(Self, Vec<f64>), IdentificationError>
    where
        Self: Sized,
    {
        let mut standings = Vec::new();
        for judged in &choice.entrants {
            let (branch, parameters) = self.branch(fitted, judged, choice.replaces)?;
            let score = match choice.entrants.len() {
                1 => judged.score,
                _ => {
                    let refined = branch.fitted(Candidates::none(), &parameters)?;
                    let (train, held_out) = fitted.stage.gain(&fitted.refit, &refined.refit);
                    (train + held_out) / self.input.rows_per_independent - judged.penalty
                }
            };
            standings.push(Standing { judged, branch, parameters, score });
        }
        let highest = standings.iter().map(|standing| standing.score).fold(f64::NEG_INFINITY, f64::max);
        standings.retain(|standing| standing.score >= highest - near_score(highest));
        standings.sort_by_key(|standing| complexity(&fitted.stage, standing.judged));
        // The odds are those of the choice itself: one with more parameters than the one chosen has to be
        // better by what the choice asks for.
        let counted = |standing: &Standing<'_, Self>| complexity(&fitted.stage, standing.judged).0;
        let fewest = standings.first().map_or(0, counted);
        for standing in standings.iter_mut().filter(|standing| counted(standing) > fewest) {
            standing.score -= near_score(highest);
        }
        let highest = standings.iter().map(|standing| standing.score).fold(f64::NEG_INFINITY, f64::max);
        let weigh = |score: f64| (score - highest).max(-700.0).exp();
        let sum: f64 = standings.iter().map(|standing| weigh(standing.score)).sum();
        let rivals: Vec<RivalEffect> = standings
            .iter()
            .skip(1)
            .map(|standing| RivalEffect {
                spec: fitted.stage.candidates[standing.judged.candidate].specs[0].clone(),
                confidence: weigh(standing.score) / sum,
            })
            .filter(|rival| rival.confidence >= LEAST_RIVAL)
            .collect();
        let Standing { judged, mut branch, parameters, score } = standings.swap_remove(0);
        if let Some(place) = choice.replaces {
            branch.dropped.push(self.specs[place].clone());
            branch.found.remove(place - self.input.declared.len());
        }
        branch.account_from_here();
        for spec in &fitted.stage.candidates[judged.candidate].specs {
            branch.found.push(FoundEffect {
                spec: spec.clone(),
                relative: 0.0,
                relative_before: 0.0,
                explains: 0.0,
                confidence: weigh(score) / sum,
                stability: 1.0,
                significance: choice.significance,
                rivals: rivals.clone(),
                ranking: ranking.clone(),
            });
        }
        Ok((branch, parameters))
    }

    /// The model with a candidate (in the place of an effect, if it replaces one), its constants refined.
    fn branch(
        &self,
        fitted: &Fitted,
        judged: &Judged,
        replaces: Option<usize>,
    ) -> Result<(Self, Vec<f64>), IdentificationError>
    where
        Self: Sized,
    {
        let stage = &fitted.stage;
        let mut branch = self.clone();
        let candidate = &stage.candidates[judged.candidate];
        branch.specs.extend(candidate.specs.iter().cloned());
        let values = &judged.refit.parameters;
        let mut parameters: Vec<f64> = values[..stage.model_size()].to_vec();
        if let Some(place) = replaces {
            branch.specs.remove(place);
            parameters.drain(stage.design.effect_parameters(place));
        }
        parameters.extend(judged.parameters.iter().map(|&parameter| values[parameter]));
        let parameters = branch.refine(parameters)?;
        Ok((branch, parameters))
    }
}

/// An entrant with its own refined model.
struct Standing<'a, S> {
    judged: &'a Judged,
    branch: S,
    parameters: Vec<f64>,
    score: f64,
}

pub(super) fn near_score(best: f64) -> f64 {
    NEAR_SCORE.max(NEAR_SHARE * best)
}

/// The best variant of each hypothesis, best first.
pub(super) fn best_of_each(stage: &Stage, judged: Vec<Judged>) -> Vec<Judged> {
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
pub(super) fn complexity(stage: &Stage, judged: &Judged) -> (usize, usize) {
    let candidate = &stage.candidates[judged.candidate];
    (judged.parameters.len() + candidate.constants, candidate.rank)
}
