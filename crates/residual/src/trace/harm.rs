//! Which of the chosen effects do harm, and leave the model.

use super::search::Search;
use super::tracing::Tracing;
use super::trial::Trial;
use crate::selection::{Member, Products};
use phiw_effects::Constants;
use phiw_identification::fitting::{OwnTorqueFit, TorqueError, torque_error};
use phiw_identification::{EffectSpec, IdentificationError};
use rayon::prelude::*;

/// Effects of which it is asked at once whether the model as it is fitted is better without them.
const ASKED_OF: usize = 4;

/// What speaks against an effect.
#[derive(Clone, Copy, Debug)]
pub(super) enum Harm {
    /// That the logarithms of the torques' foretold errors grow.
    EachTorque,
    /// That the logarithms of the errors on motion held out grow, or that the error of all torques together
    /// is there larger than `most_relative` of the torques (RMS); of each torque what is as good as none
    /// counts as the largest such.
    HeldOut { most_relative: f64 },
}

/// The error on motion held out of a model as it is fitted in the end.
pub(super) struct ErrorAsFitted {
    /// Its effects.
    specs: Vec<EffectSpec>,
    error: TorqueError,
}

impl Search<'_> {
    /// The places of the effects, ascending, that do harm: the worst, the worst of what is left without it,
    /// and so on. What others are forms of stays, and what another's columns are made of.
    ///
    /// Errors count by their logarithms; while that of all torques together is larger than `harm` allows, by
    /// their squares.
    pub(super) fn harmful(&self, trial: &Trial, harm: Harm) -> Vec<usize> {
        let mut left_out: Vec<usize> = Vec::new();
        let together = |squares: &[f64]| self.counted_squares(trial, squares);
        let most = match harm {
            Harm::EachTorque => f64::INFINITY,
            Harm::HeldOut { most_relative } => {
                let torque: f64 = trial.held_out.iter().map(Products::right_hand_side).sum();
                most_relative * most_relative * torque
            }
        };
        loop {
            let fit = trial.fit_with(|other| !left_out.contains(&other));
            let foretelling = trial.foretelling(&fit);
            let squares_without = |member: Member| match harm {
                Harm::HeldOut { .. } => trial.held_out_squares_without(&fit, member),
                _ => foretelling.squares_without(member),
            };
            let present = match harm {
                Harm::HeldOut { .. } => trial.held_out_squares(&fit),
                _ => foretelling.squares(),
            };
            let found = trial.members.par_iter().zip(&trial.places).filter(|(member, place)| {
                let is_in = |other: usize| !left_out.contains(&other);
                **place >= self.declared
                    && is_in(**place)
                    && !(matches!(harm, Harm::HeldOut { .. }) && self.is_of_training_logs(**place))
                    && !trial.is_required(member)
                    && !trial.is_material_of_another(member, is_in)
            });
            let without = found.map(|(&member, &place)| {
                let squares = squares_without(member);
                (trial.gain(&squares, &present), place, together(&squares))
            });
            let mut without: Vec<(f64, usize, f64)> = without.collect();
            without.sort_by(|a, b| a.0.total_cmp(&b.0));
            let harms = without.first().is_some_and(|(gain, ..)| *gain <= 0.0);
            let too_much = together(&present) > most;
            if !harms && too_much {
                without.sort_by(|a, b| a.2.total_cmp(&b.2));
            }
            match without.first() {
                Some(&(_, place, _)) if harms || too_much => left_out.push(place),
                _ => break,
            }
        }
        left_out.sort_unstable();
        left_out
    }

    /// The model without the effect that makes the errors on motion held out larger by most, if any does by
    /// more than [`Self::least_growth`]: in their geometric mean over the torques, or all together. A drift
    /// that one log seems to show may be a disaster in the next. It does so on trial, beside the others as
    /// they are, and in the model as it is fitted, whose other constants may make up for it.
    ///
    /// `as_fitted` is the error of the model as it was fitted last, so that it is not fitted again.
    pub(super) fn without_what_misleads(
        &self,
        trial: &Trial,
        as_fitted: &mut Option<ErrorAsFitted>,
    ) -> Result<Option<Self>, IdentificationError> {
        let misleading = self.misleading(trial);
        if misleading.is_empty() {
            return Ok(None);
        }
        let share = self.options.thresholds.negligible_share();
        let with = match as_fitted.take().filter(|known| known.specs == self.specs) {
            Some(known) => known.error,
            None => self.held_out_error_as_fitted()?,
        };
        for place in misleading.into_iter().take(ASKED_OF) {
            let mut branch = self.clone();
            branch.remove(place)?;
            branch.refine()?;
            let without = branch.held_out_error_as_fitted()?;
            let mean = with.mean_logarithm_from(share) - without.mean_logarithm_from(share);
            let together = (self.counted(&with) / self.counted(&without)).ln();
            if mean.max(together) > self.least_growth() {
                branch.left_out_by_held_out.push(self.specs[place].clone());
                *as_fitted = Some(ErrorAsFitted { specs: branch.specs.clone(), error: without });
                return Ok(Some(branch));
            }
        }
        Ok(None)
    }

    /// The places of the effects that make the errors on motion held out larger on trial, that which does by
    /// most first. But where an effect makes the errors on training motion that is foretold smaller by more,
    /// motion held out is foretold badly for another reason.
    fn misleading(&self, trial: &Trial) -> Vec<usize> {
        let mut grown = self.grown_on_motion_held_out(trial);
        let foretelling = trial.foretelling(&trial.fit);
        let foretold = foretelling.squares();
        let trained: f64 = (0..foretold.len()).map(|torque| trial.torque(torque).rows()).sum();
        grown.retain(|(growth, member, _)| {
            growth * trained > trial.gain(&foretelling.squares_without(*member), &foretold)
        });
        grown.into_iter().map(|(.., place)| place).collect()
    }

    /// This end without the effect, of those that what came of it has kept, which makes the error on motion
    /// held out larger by most, and with nothing else refuted; none where no effect does. Whatever it does on
    /// training motion, others may do that better, and this as well.
    pub(super) fn without_suspect(&self, end: &Tracing) -> Result<Option<Self>, IdentificationError> {
        let trial = self.trial()?;
        let is_kept = |own: &EffectSpec| {
            end.specs.iter().any(|kept| kept.kind == own.kind && kept.joints == own.joints)
        };
        let grown = self.grown_on_motion_held_out(&trial).into_iter();
        let mut kept = grown.map(|(.., place)| place).filter(|&place| is_kept(&self.specs[place]));
        let Some(place) = kept.next() else { return Ok(None) };
        let mut without = self.clone();
        without.remove(place)?;
        without.refuted = vec![EffectSpec { constants: Constants::new(), ..self.specs[place].clone() }];
        Ok(Some(without))
    }

    /// The effects with which the errors on motion held out are larger on trial, as members and by their
    /// places, each with the logarithm of what they grow by: in the mean of the torques, or all together.
    /// That which they grow by most with comes first.
    fn grown_on_motion_held_out(&self, trial: &Trial) -> Vec<(f64, Member, usize)> {
        let present = trial.held_out_squares(&trial.fit);
        let rows: f64 = trial.held_out.iter().map(Products::rows).sum();
        let together = |squares: &[f64]| self.counted_squares(trial, squares);
        let found = trial.members.par_iter().zip(&trial.places);
        let found = found.filter(|(member, place)| {
            **place >= self.declared && !trial.is_required(member) && !self.is_of_training_logs(**place)
        });
        let growth = found.map(|(&member, &place)| {
            let without = trial.held_out_squares_without(&trial.fit, member);
            let of_torque =
                |torque: usize| trial.held_out[torque].rows() * (present[torque] / without[torque]).ln();
            let mean = (0..present.len()).map(of_torque).sum::<f64>() / rows.max(1.0);
            (mean.max((together(&present) / together(&without)).ln()), member, place)
        });
        let least = 2.0 * self.least_growth();
        let mut grown: Vec<(f64, Member, usize)> = growth.filter(|(growth, ..)| *growth > least).collect();
        grown.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.2.cmp(&b.2)));
        grown
    }

    /// By how much, as a logarithm, an error on motion held out must grow with an effect that is to leave
    /// for it: by `same_error`, so that this motion has no say about what it hardly tells. Once anything has
    /// left for it, the error there is not blind any more, and any growth counts.
    fn least_growth(&self) -> f64 {
        if self.left_out_by_held_out.is_empty() { self.options.thresholds.same_error.ln() } else { 0.0 }
    }

    /// The error on motion held out of the model as it is fitted in the end.
    pub(super) fn held_out_error_as_fitted(&self) -> Result<TorqueError, IdentificationError> {
        let OwnTorqueFit { fit, folds, .. } = self.final_fit(false)?;
        let held_out = &folds.moving[self.whole.train.len()..];
        Ok(torque_error(held_out, &fit.parameters)?)
    }

    /// The sum of what is left of the torques held out, where what is as good as none counts as the largest
    /// such.
    fn counted_squares(&self, trial: &Trial, squares: &[f64]) -> f64 {
        let least = self.options.thresholds.negligible_share().powi(2);
        let torques = trial.held_out.iter().map(Products::right_hand_side);
        squares.iter().zip(torques).map(|(squares, torque)| squares.max(least * torque)).sum()
    }
}
