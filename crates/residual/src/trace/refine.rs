//! Constants closer to the best, once an effect is in the model.

use super::candidate::{Candidate, Candidates};
use super::evidence::Refit;
use super::search::{Fitted, Search, weights_of};
use super::stage::{Judged, Thoroughness};
use phiw_identification::{EffectCatalogue, EffectSpec, IdentificationError};

/// A residual over the noise floor by less than this says nothing about a constant.
const DOWN_TO_NOISE: f64 = 1.05;
/// Share of a torque's residual variance that other constants of a declared effect must save.
const WORTH_A_CHANGE: f64 = 0.03;
/// Passes to refine constants.
const REFINEMENTS: usize = 3;

impl Search<'_> {
    /// Refines the constants of the effect found last and the widths of the signs on its joints, and
    /// linearises anew what is linearised: one pass a step, for all of them.
    pub(super) fn refine(&mut self, mut parameters: Vec<f64>) -> Result<Vec<f64>, IdentificationError> {
        for step in 0..REFINEMENTS {
            let (places, candidates) = self.near(step)?;
            if candidates.list.is_empty()
                && !self.fixed.build(&self.specs)?.iter().any(|effect| !effect.needs().is_empty())
            {
                break;
            }
            let fitted = self.fitted(candidates, &parameters)?;
            let mut changed = false;
            let mut refit = fitted.refit.clone();
            for place in places {
                if let Some((spec, better)) = self.best_near(&fitted, place, &refit)? {
                    changed |= spec != self.specs[place];
                    self.specs[place] = spec;
                    refit = better;
                }
            }
            parameters = refit.parameters[..fitted.stage.model_size()].to_vec();
            self.residual_std =
                weights_of(&fitted.stage.train, &refit.train).iter().map(|weight| 1.0 / weight).collect();
            changed |= self.relinearise(&mut parameters)?;
            // Columns that need torques had those of the last step.
            changed |=
                step == 0 && self.fixed.build(&self.specs)?.iter().any(|effect| !effect.needs().is_empty());
            if !changed {
                break;
            }
        }
        Ok(parameters)
    }

    /// Constants to try in the place of those of the effects found and of the declared ones whose constants
    /// the data chose: each missing effect has bent the choice. All of the kind's scan first, then closer and
    /// closer to the best.
    fn near(&self, step: usize) -> Result<(Vec<usize>, Candidates), IdentificationError> {
        let declared = self.input.declared.len();
        // A torque that is down to its noise has nothing to say about a constant.
        let noisy = |spec: &EffectSpec| {
            let joints = spec.joints.iter().filter_map(|joint| self.fixed.tree.joint_index(joint));
            joints
                .into_iter()
                .any(|joint| self.residual_std[joint] > DOWN_TO_NOISE * self.input.noise_floor[joint])
        };
        let places: Vec<usize> = (0..self.specs.len())
            .filter(|&place| !self.is_held(place) && (place >= declared || noisy(&self.specs[place])))
            .collect();
        let mut candidates = Candidates::none();
        for &place in &places {
            let spec = &self.specs[place];
            let kind = self.fixed.catalogue.kind(&spec.kind)?;
            let mut near = kind.refine(&spec.constants, step);
            if step == 0 && place < declared && !spec.constants.is_empty() {
                let site: Vec<usize> =
                    spec.joints.iter().filter_map(|joint| self.fixed.tree.joint_index(joint)).collect();
                near.extend(kind.scan(&site, &self.input.ranges));
            }
            for constants in near.into_iter().filter(|constants| *constants != spec.constants) {
                let variant = EffectSpec { constants, ..spec.clone() };
                let first = candidates.effects.len();
                candidates.effects.push(self.fixed.catalogue.build(&variant, self.fixed.tree)?);
                candidates.list.push(Candidate {
                    specs: vec![variant],
                    rank: place,
                    effects: first..first + 1,
                    constants: 0,
                });
            }
        }
        Ok((places, candidates))
    }

    /// The best of the constants near one effect's, if any beats its own; the refit's parameters are in the
    /// effect's own place.
    fn best_near(
        &self,
        fitted: &Fitted,
        place: usize,
        now: &Refit,
    ) -> Result<Option<(EffectSpec, Refit)>, IdentificationError> {
        let stage = &fitted.stage;
        let own: Vec<usize> = stage.design.effect_parameters(place).collect();
        let mut determined = fitted.determined.clone();
        own.iter().for_each(|&parameter| determined[parameter] = false);
        let prior = self.prior_over(&determined)?;
        let weights = weights_of(&stage.train, &now.train);
        let evidence = stage.evidence(&determined, &weights, prior.as_ref())?;
        let mine: Vec<usize> = (0..stage.candidates.len())
            .filter(|&candidate| stage.candidates[candidate].rank == place)
            .collect();
        let judged =
            stage.judge(&evidence, now, &mine, Thoroughness::Screening, self.input.rows_per_independent)?;
        let gain = |refit: &Refit| {
            let (train, held_out) = stage.gain(now, refit);
            train + held_out
        };
        let best = match place < self.input.declared.len() {
            true => {
                let rows = stage.rows_of(place);
                let samples: u64 = [&stage.train, &stage.held_out]
                    .iter()
                    .flat_map(|factors| rows.iter().map(|&row| factors.groups()[row].factor.rows()))
                    .sum();
                simplest(&stage.candidates, judged, &gain, 0.5 * WORTH_A_CHANGE * samples as f64)
            }
            false => {
                let better = judged.into_iter().filter(|judged| gain(&judged.refit) > 0.0);
                better.max_by(|a, b| gain(&a.refit).total_cmp(&gain(&b.refit)))
            }
        };
        Ok(best.map(|best| {
            let mut refit = best.refit;
            for (own, variant) in own.iter().zip(&best.parameters) {
                refit.parameters[*own] = refit.parameters[*variant];
            }
            (stage.candidates[best.candidate].specs[0].clone(), refit)
        }))
    }

    /// Moves the point of linearisation of effects that have one.
    fn relinearise(&mut self, parameters: &mut [f64]) -> Result<bool, IdentificationError> {
        let design = self.design(&self.specs)?;
        let mut changed = false;
        for (place, effect) in design.effects().iter().enumerate() {
            let own: Vec<f64> =
                design.effect_parameters(place).map(|parameter| parameters[parameter]).collect();
            if let Some(moved) = effect.relinearised(&own) {
                changed |= own.iter().any(|value| value.abs() > 0.0);
                self.specs[place] = moved.spec();
                design.effect_parameters(place).for_each(|parameter| parameters[parameter] = 0.0);
            }
        }
        Ok(changed)
    }
}

/// For a declared effect the variant with the smallest constants among those that are nearly as good as the
/// best; `None` where the present one is nearly as good, so that a declared model means the same whatever has
/// been found beside it.
fn simplest(
    candidates: &[Candidate],
    judged: Vec<Judged>,
    gain: &dyn Fn(&Refit) -> f64,
    margin: f64,
) -> Option<Judged> {
    let best = judged.iter().map(|judged| gain(&judged.refit)).fold(0.0, f64::max);
    if best <= margin {
        return None;
    }
    let size = |judged: &Judged| candidates[judged.candidate].specs[0].constants.values().sum::<f64>();
    let near = judged.into_iter().filter(|judged| gain(&judged.refit) >= best - margin);
    near.min_by(|a, b| size(a).total_cmp(&size(b)))
}
