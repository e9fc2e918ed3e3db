//! Second thoughts: an effect found early may be superfluous, or another in its place, once more is known.

use super::choice::{LEAST_RIVAL, best_of_each, complexity};
use super::search::{Fitted, Search};
use super::stability::{DRAWS, Finalist, winners};
use super::stage::{Judged, Thoroughness};
use super::tracing::RivalEffect;
use phiw_identification::IdentificationError;

/// Share of an effect's score from which a candidate could win in its place on other motion, and how many of
/// those are tried.
const CONTENDER: f64 = 0.5;
const CONTENDERS: usize = 8;
/// Share of the draws in which an effect must be chosen.
const STABLE: f64 = 0.9;

impl Search<'_> {
    /// Effects that were found, but for the last, and that can be taken out by leaving out their columns.
    fn removable(&self) -> Result<Vec<usize>, IdentificationError> {
        let mut places = Vec::new();
        for place in self.input.declared.len()..self.specs.len().saturating_sub(1) {
            if !self.is_linearised(&self.specs[place])? {
                places.push(place);
            }
        }
        Ok(places)
    }

    /// The place of an effect that the others have made superfluous.
    pub(super) fn superfluous(&self, fitted: &Fitted) -> Result<Option<usize>, IdentificationError> {
        let stage = &fitted.stage;
        for place in self.removable()? {
            let determined = self.determined_without(fitted, place);
            let prior = self.prior_over(&determined)?;
            let evidence = stage.evidence(&determined, &fitted.weights, prior.as_ref())?;
            let every: Vec<usize> = (0..stage.train.groups().len()).collect();
            let Some(without) = evidence.refit(&[], &every)? else { continue };
            let own: Vec<usize> = stage.design.effect_parameters(place).collect();
            let rows = stage.rows_of(place);
            let significance = self.found[place - self.input.declared.len()].significance;
            let (_, held_out) = stage.gain(&without, &fitted.refit);
            if held_out <= 0.0 || !self.matters(stage, &rows, &own, significance, &without, &fitted.refit)? {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }

    /// Takes an effect out of the model; gives the parameters of what is left.
    pub(super) fn refine_without(
        &mut self,
        place: usize,
        parameters: &[f64],
    ) -> Result<Vec<f64>, IdentificationError> {
        let design = self.design(&self.specs)?;
        let mut parameters = parameters[..design.parameter_count()].to_vec();
        parameters.drain(design.effect_parameters(place));
        self.dropped.push(self.specs.remove(place));
        self.found.remove(place - self.input.declared.len());
        self.refine(parameters)
    }

    /// A candidate that, in the place of an effect found earlier, does as much as the best candidate beside
    /// it (whose score is at least `score`): one effect instead of two.
    pub(super) fn replacement(
        &self,
        fitted: &Fitted,
        weights: &[f64],
        score: f64,
    ) -> Result<Option<(usize, Judged)>, IdentificationError> {
        let stage = &fitted.stage;
        let inflation = self.input.rows_per_independent;
        let mut best: Option<(usize, Judged)> = None;
        let mut places = self.removable()?;
        let declared = self.input.declared.len();
        if let Some((last, spec)) = self.specs.iter().enumerate().skip(declared).last()
            && !self.is_linearised(spec)?
        {
            places.push(last);
        }
        for place in places {
            let determined = self.determined_without(fitted, place);
            let prior = self.prior_over(&determined)?;
            let evidence = stage.evidence(&determined, weights, prior.as_ref())?;
            let rivals = stage.independent_of(place);
            let judged =
                stage.judge(&evidence, &fitted.refit, &rivals, Thoroughness::Screening, inflation)?;
            let Some(mut first) = judged.into_iter().next() else { continue };
            let own = stage.design.effect_parameters(place).len() + self.specs[place].constants.len();
            first.score += first.penalty * own as f64 / first.counted.max(1) as f64;
            if first.score > score && best.as_ref().is_none_or(|(_, other)| first.score > other.score) {
                best = Some((place, first));
            }
        }
        Ok(best)
    }

    /// Chooses again on bootstrap draws of the training folds, each effect found beside all the others: what
    /// wins in some draw is a rival. Gives the place of the effect that is chosen too seldom to keep its
    /// name, if there is one.
    pub(super) fn unstable(&mut self, fitted: &Fitted) -> Result<Option<usize>, IdentificationError> {
        let stage = &fitted.stage;
        let declared = self.input.declared.len();
        let inflation = self.input.rows_per_independent;
        let training = self.input.data.train.len();
        let every: Vec<usize> = (0..stage.train.groups().len()).collect();
        let mut worst: Option<(usize, f64)> = None;
        for place in declared..self.specs.len() {
            if self.is_linearised(&self.specs[place])? {
                continue;
            }
            let determined = self.determined_without(fitted, place);
            let prior = self.prior_over(&determined)?;
            let evidence = stage.evidence(&determined, &fitted.weights, prior.as_ref())?;
            let Some(without) = evidence.refit(&[], &every)? else { continue };
            let rivals = stage.independent_of(place);
            let judged = stage.judge(&evidence, &without, &rivals, Thoroughness::Screening, inflation)?;
            let parameters: Vec<usize> = stage.design.effect_parameters(place).collect();
            let counted = parameters.len() + self.specs[place].constants.len();
            let own = Finalist {
                penalty: stage.penalty(&stage.rows_of(place), counted, inflation),
                complexity: (counted, 0),
                parameters,
            };
            let (train, held_out) = stage.gain(&without, &fitted.refit);
            let score = (train + held_out) / inflation - own.penalty;
            let others: Vec<Judged> = best_of_each(stage, judged)
                .into_iter()
                .take_while(|judged| judged.score > CONTENDER * score)
                .take(CONTENDERS)
                .collect();
            let finalist = |judged: &Judged| Finalist {
                parameters: judged.parameters.clone(),
                penalty: judged.penalty,
                complexity: complexity(stage, judged),
            };
            let finalists: Vec<Finalist> = std::iter::once(own).chain(others.iter().map(finalist)).collect();
            let winners = winners(fitted, &determined, prior.as_ref(), &finalists, training, inflation);
            let share = |wanted: Option<usize>| {
                winners.iter().filter(|winner| **winner == wanted).count() as f64 / DRAWS as f64
            };
            let effect = &mut self.found[place - declared];
            effect.stability = 1.0 - share(None);
            effect.confidence = effect.confidence.min(share(Some(0)));
            for (index, judged) in others.iter().enumerate() {
                let (confidence, spec) =
                    (share(Some(index + 1)), &stage.candidates[judged.candidate].specs[0]);
                let is_known = effect
                    .rivals
                    .iter()
                    .any(|rival| rival.spec.kind == spec.kind && rival.spec.joints == spec.joints);
                if confidence >= LEAST_RIVAL && !is_known {
                    effect.rivals.push(RivalEffect { spec: spec.clone(), confidence });
                }
            }
            if effect.stability < STABLE && worst.is_none_or(|(_, stability)| effect.stability < stability) {
                worst = Some((place, effect.stability));
            }
        }
        Ok(worst.map(|(place, _)| place))
    }

    fn determined_without(&self, fitted: &Fitted, place: usize) -> Vec<bool> {
        let mut determined = fitted.determined.clone();
        fitted.stage.design.effect_parameters(place).for_each(|parameter| determined[parameter] = false);
        determined
    }
}
