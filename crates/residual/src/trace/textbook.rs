//! What the textbook has of every joint, beside what was found: for the prediction, without a name.
//!
//! Frictions and rotor inertias that are too small to be certain joint by joint are there nevertheless, and
//! the logs may tell them all together. They join the final model as families whose members are drawn to
//! nothing (`selection/families.rs`): each as far as the logs say. A start of the search has them, too
//! (`starts.rs`).

use super::search::Search;
use super::tracing::FoundEffect;
use super::verdict::errors;
use crate::selection::Families;
use faer::Mat;
use phiw_identification::fitting::{
    FoldFactors, OwnTorqueFit, Rests, TorqueError, accumulate_folds, fit, fit_with_own_torque, merge,
};
use phiw_identification::{Design, EffectSpec, Fold, IdentificationError, Identified};
use phiw_regressor::RegressorError;
use phiw_regressor::factor::Factor;
use phiw_regressor::least_squares::{Group, GroupedFactor};
use statrs::distribution::{ContinuousCDF, Normal};

/// Times that the noise is taken anew of what the families leave.
const ROUNDS: usize = 3;

/// The final model with what joined it.
pub(super) struct WithTextbook {
    pub model: Identified,
    pub specs: Vec<EffectSpec>,
    pub found: Vec<FoundEffect>,
}

impl Search<'_> {
    /// `model` with the members of the textbook's families that the logs tell; none where no family is told,
    /// where the error on motion held out is larger with them by more than an effect may make it, and beside
    /// a held model.
    pub(super) fn with_textbook(
        &self,
        model: &Identified,
    ) -> Result<Option<WithTextbook>, IdentificationError> {
        if self.fixed.prior.is_some() || self.chosen.rows_per_effective.is_empty() {
            return Ok(None);
        }
        let open = self.textbook_of_other_joints()?;
        let deviations = self.deviations(model, &open)?;
        let told = open.into_iter().zip(deviations).filter(|(_, deviation)| *deviation > 0.0);
        let (specs, deviations): (Vec<EffectSpec>, Vec<f64>) = told.unzip();
        if specs.is_empty() {
            return Ok(None);
        }
        let with = self.fitted_with(model, specs, &deviations)?;
        let margin = self.options.thresholds.same_error;
        let is_worse = self.counted(&with.model.held_out) > margin * self.counted(&model.held_out);
        Ok((!is_worse).then_some(with))
    }

    /// Effects of the kinds that a joint's properties hold, on the joints that the model has without them.
    pub(super) fn textbook_of_other_joints(&self) -> Result<Vec<EffectSpec>, IdentificationError> {
        let mut open = Vec::new();
        for kind in self.fixed.catalogue.kinds().filter(|kind| kind.joint_property().is_some()) {
            for site in kind.sites(self.fixed.tree) {
                let joints = site.iter().map(|&joint| self.fixed.tree.joint(joint).joint.as_str());
                let bare = EffectSpec::new(kind.name(), &joints.collect::<Vec<&str>>());
                let is_this = |spec: &EffectSpec| spec.kind == bare.kind && spec.joints == bare.joints;
                if self.specs.iter().chain(&self.options.excluded).any(is_this) {
                    continue;
                }
                let effect = kind.build(self.fixed.tree, &site, &bare.constants);
                let acts = |row: usize| self.options.torques.as_ref().is_none_or(|own| own.contains(&row));
                if effect.entries().iter().all(|entry| acts(entry.row)) {
                    open.push(effect.spec());
                }
            }
        }
        Ok(open)
    }

    /// The model with more effects behind it, and the factors of `stretches` with its columns.
    fn read_with(
        &self,
        model: &Identified,
        more: &[EffectSpec],
        stretches: &[Fold],
    ) -> Result<(Design, FoldFactors), IdentificationError> {
        let own = model.design.effects().iter().map(|effect| effect.spec());
        let specs: Vec<EffectSpec> = own.chain(more.iter().cloned()).collect();
        let design = Design::new(self.fixed.tree.clone(), self.fixed.base.clone(), self.fixed.build(&specs)?)
            .with_rest_speeds(self.fixed.data.rest_speeds.clone());
        let mut parameters = model.fit.parameters.clone();
        parameters.resize(design.parameter_count(), 0.0);
        let design = design.with_own_reference(&parameters)?;
        let folds = accumulate_folds(&design, stretches, &self.whole.sources, Rests::Dropped)?;
        Ok((design, folds))
    }

    /// For each of the `open` effects the deviation of its parameter about nothing, 0 where it is not told.
    fn deviations(&self, model: &Identified, open: &[EffectSpec]) -> Result<Vec<f64>, IdentificationError> {
        if open.is_empty() {
            return Ok(Vec::new());
        }
        let (design, folds) = self.read_with(model, open, &self.whole.train)?;
        let train = merge(&folds.moving)?;
        let first = model.fit.parameters.len();
        let columns: Vec<usize> =
            model.fit.determined().into_iter().chain(first..first + open.len()).collect();
        let own = train.select(&columns)?;
        let kinds: Vec<&str> = {
            let mut kinds: Vec<&str> = open.iter().map(|spec| spec.kind.as_str()).collect();
            kinds.dedup();
            kinds
        };
        let family = |spec: &EffectSpec| kinds.iter().position(|kind| *kind == spec.kind).unwrap_or_default();
        let effects = &design.effects()[model.design.effects().len()..];
        let scales = effects.iter().enumerate().map(|(place, effect)| {
            let row = effect.entries().first().map_or(0, |entry| entry.row);
            scale(&train.groups()[row], first + place)
        });
        let mut families = Families {
            triangle: Mat::zeros(0, 0),
            right: Vec::new(),
            family: open.iter().map(family).collect(),
            scales: scales.collect(),
        };
        let tail = self.options.thresholds.false_name_probability / kinds.len() as f64;
        let least_gain = Normal::standard().inverse_cdf(1.0 - tail).powi(2);
        let mut noise = model.fit.residual_std.clone();
        let mut deviations = Vec::new();
        for _ in 0..ROUNDS {
            let effective = noise.iter().zip(&self.chosen.rows_per_effective);
            let weights: Vec<f64> =
                effective.map(|(std, rows)| 1.0 / (std.max(f64::MIN_POSITIVE) * rows.sqrt())).collect();
            let factor = own.combine(&weights)?;
            families.take_last(&factor);
            let drawn = families.drawn(least_gain);
            let left = own.residual_sums_of_squares(&beside(&factor, &drawn.means))?;
            for ((noise, left), group) in noise.iter_mut().zip(left).zip(own.groups()) {
                *noise = (left / group.factor.rows().max(1) as f64).sqrt();
            }
            deviations = drawn.deviations;
        }
        Ok(deviations)
    }

    /// `model` with the effects of `specs`, whose parameters have these deviations about nothing.
    fn fitted_with(
        &self,
        model: &Identified,
        specs: Vec<EffectSpec>,
        deviations: &[f64],
    ) -> Result<WithTextbook, IdentificationError> {
        let (first, train) = (model.fit.parameters.len(), self.whole.train.len());
        let stretches = [self.whole.train.as_slice(), &self.whole.held_out].concat();
        let read =
            |design: &Design| accumulate_folds(design, &stretches, &self.whole.sources, Rests::Dropped);
        let fit_drawn = |design: &Design, folds: &[GroupedFactor]| {
            // Each fold has its share, so that whichever is left out the rest knows the same. A fit counts
            // rows as they are: what was known before counts as many times more.
            let share = (1.0 / folds.len().max(1) as f64).sqrt();
            let weight = |torque: usize, parameter: usize| {
                let deviation = deviations.get(parameter.checked_sub(first)?)?;
                let noise = model.fit.residual_std[torque] * self.chosen.rows_per_effective[torque].sqrt();
                Some(share * noise / deviation)
            };
            let drawn: Result<Vec<GroupedFactor>, RegressorError> =
                folds.iter().map(|fold| fold.drawn_to_nothing(weight)).collect();
            fit(design, &drawn?)
        };
        let (design, folds) = self.read_with(model, &specs, &stretches)?;
        let fitted = fit_drawn(&design, &folds.moving[..train])?;
        let OwnTorqueFit { design, fit: mut fitted, folds } =
            fit_with_own_torque(design, fitted, folds, train, read, fit_drawn)?;
        // Deviations of what was there before are with the effects' constants free.
        for parameter in 0..first {
            let half = |interval: [f64; 2]| 0.5 * (interval[1] - interval[0]);
            let (own, before) = (fitted.intervals_95[parameter], model.fit.intervals_95[parameter]);
            let (middle, widest) = (0.5 * (own[0] + own[1]), half(own).max(half(before)));
            fitted.intervals_95[parameter] = [middle - widest, middle + widest];
            let std = &mut fitted.standard_deviations[parameter];
            *std = std.max(model.fit.standard_deviations[parameter]);
        }
        let mut train_folds = folds.moving;
        let held_out_folds = train_folds.split_off(train);
        let (train, held_out) = errors(&train_folds, &held_out_folds, &fitted.parameters)?;
        let with = Identified { design, fit: fitted, train, held_out, train_folds, held_out_folds };
        let found = self.found_with(model, &with, &specs)?;
        Ok(WithTextbook { model: with, specs, found })
    }

    /// What the effects of `specs`, which `with` has beside `model`, have explained all together.
    fn found_with(
        &self,
        model: &Identified,
        with: &Identified,
        specs: &[EffectSpec],
    ) -> Result<Vec<FoundEffect>, IdentificationError> {
        let weights: Vec<f64> = with.fit.residual_std.iter().map(|std| 1.0 / std).collect();
        let left = |of: &Identified| -> Result<Vec<f64>, RegressorError> {
            let weighted = |fold: &GroupedFactor| {
                let squares = fold.residual_sums_of_squares(&of.fit.parameters)?;
                Ok(squares.iter().zip(&weights).map(|(square, weight)| square * weight * weight).sum())
            };
            of.train_folds.iter().map(weighted).collect()
        };
        let (before, after) = (left(model)?, left(with)?);
        let better = before.iter().zip(&after).filter(|(before, after)| after < before).count();
        let excess = |error: &TorqueError| -> f64 {
            let of_torque = error.rmse.iter().zip(&self.input.noise_floor);
            of_torque.map(|(rmse, floor)| (rmse * rmse - floor * floor).max(0.0)).sum()
        };
        let kept = match excess(&model.held_out) {
            none if none <= 0.0 => 1.0,
            before => (excess(&with.held_out) / before).min(1.0),
        };
        let of_effect = |(place, spec): (usize, &EffectSpec)| {
            let parameter = model.fit.parameters.len() + place;
            FoundEffect {
                spec: spec.clone(),
                relative: with.held_out.relative,
                relative_before: model.held_out.relative,
                // The shares of all of them leave together what is left.
                explains: 1.0 - kept.powf(1.0 / specs.len() as f64),
                confidence: 1.0,
                stability: better as f64 / before.len().max(1) as f64,
                significance: with.fit.parameters[parameter] / with.fit.standard_deviations[parameter],
                rivals: Vec::new(),
                ranking: Vec::new(),
            }
        };
        Ok(specs.iter().enumerate().map(of_effect).collect())
    }
}

/// The parameter at which its column alone is as large as the torque (RMS); 0 where it has none.
fn scale(torque: &Group, parameter: usize) -> f64 {
    let column = torque.parameters.iter().position(|own| *own == parameter);
    let norm = column.map_or(0.0, |column| torque.factor.column_norm(column));
    if norm > 0.0 { torque.factor.right_hand_side_sum_of_squares().sqrt() / norm } else { 0.0 }
}

/// All parameters, the `last` of which are given: the least squares of those before.
fn beside(factor: &Factor, last: &[f64]) -> Vec<f64> {
    let count = factor.parameters();
    let first = count - last.len();
    let mut values = vec![0.0; first];
    values.extend(last);
    for row in (0..first).rev() {
        let after: f64 = (row + 1..count).map(|column| factor.entry(row, column) * values[column]).sum();
        values[row] = (factor.entry(row, count) - after) / factor.entry(row, row);
    }
    values
}
