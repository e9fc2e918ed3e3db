//! The end of a search: the final fit, what each effect explained, what remains.

use super::probe::{self, Fit};
use super::residuals::ResidualShape;
use super::search::{Fitted, Search, relative};
use super::signal_shapes::neighbours;
use super::stage::Stage;
use super::tracing::{Ranked, Remaining, Tracing, Verdict};
use phiw_identification::fitting::{TorqueError, fit, torque_error};
use phiw_identification::{EffectSpec, IdentificationError, Identified};
use phiw_regressor::RegressorError;
use phiw_regressor::least_squares::{Group, GroupedFactor};

/// The held-out error of a model on its way.
#[derive(Clone)]
pub(super) struct Account {
    /// RMS of the error over RMS of the torque.
    relative: f64,
    /// Sum of squares above the noise floor.
    excess: f64,
    /// Effects found so far.
    effects: usize,
}

impl Search<'_> {
    /// Writes what the newest effects have explained into them, now that the model with them is fitted.
    pub(super) fn account(&mut self, fitted: &Fitted) {
        let now = Account {
            relative: relative(&fitted.stage.held_out, &fitted.refit.held_out),
            excess: self.excess(fitted),
            effects: self.found.len(),
        };
        if let Some(before) = &self.account {
            for effect in self.found.iter_mut().skip(before.effects) {
                effect.relative_before = before.relative;
                effect.relative = now.relative;
                effect.explains = match before.excess > 0.0 {
                    true => (1.0 - now.excess / before.excess).clamp(0.0, 1.0),
                    false => 0.0,
                };
            }
        }
        self.account = Some(now);
    }

    /// What is found from now on has not been accounted for.
    pub(super) fn account_from_here(&mut self) {
        let effects = self.found.len();
        self.account.iter_mut().for_each(|account| account.effects = effects);
    }

    /// Held-out residual sum of squares above what the noise alone would leave.
    fn excess(&self, fitted: &Fitted) -> f64 {
        let groups = fitted.stage.held_out.groups().iter();
        let of_row = |((group, squares), floor): ((&Group, &f64), &f64)| {
            (squares - group.factor.rows() as f64 * floor * floor).max(0.0)
        };
        groups.zip(&fitted.refit.held_out).zip(&self.input.noise_floor).map(of_row).sum()
    }

    pub(super) fn finish(
        self,
        fitted: Fitted,
        ranking: Vec<Ranked>,
        shape: &ResidualShape,
    ) -> Result<Tracing, IdentificationError> {
        let silent = silent(&fitted)?;
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
        let remaining =
            Remaining { silent, ..self.remaining(&stage, &final_fit.parameters, &after.1, ranking, shape)? };
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
        let not_judged = self.fixed.not_judged.lock().map(|hypotheses| hypotheses.iter().cloned().collect());
        let not_judged = not_judged.unwrap_or_default();
        Ok(Tracing { verdict, specs: self.specs, model, before, effects: found, remaining, not_judged })
    }

    /// Torques on which effects that were found act, and those of the joints next to them.
    fn touched(&self) -> Result<Vec<usize>, IdentificationError> {
        let tree = self.fixed.tree;
        let mut touched = Vec::new();
        for effect in self.fixed.build(&self.specs[self.input.declared.len()..])? {
            for row in effect.entries().iter().map(|entry| entry.row) {
                touched.push(row);
                touched.extend(neighbours(tree, row));
            }
        }
        Ok(touched)
    }

    /// Which residuals have structure, and what they follow.
    fn remaining(
        &self,
        stage: &Stage,
        parameters: &[f64],
        held_out: &TorqueError,
        ranking: Vec<Ranked>,
        shape: &ResidualShape,
    ) -> Result<Remaining, IdentificationError> {
        let least = self.options.structured_correlation[usize::from(!self.found.is_empty())];
        let over = |row: usize| held_out.rmse[row] / self.input.noise_floor[row];
        let nearest = (0..held_out.rmse.len()).map(over).fold(f64::INFINITY, f64::min).max(1.0);
        let torque_rms = |row: usize| {
            let torque = &stage.held_out.groups()[row].factor;
            (torque.right_hand_side_sum_of_squares() / torque.rows().max(1) as f64).sqrt()
        };
        let share = |row: usize| held_out.rmse[row] / torque_rms(row);
        let touched = self.touched()?;
        let large = |row: usize| {
            over(row) > self.options.floor_margin && share(row) > self.options.structured_share[0]
        };
        let claimed = |row: usize| touched.contains(&row) && share(row) > self.options.structured_share[1];
        let loud = |row: &usize| large(*row) || claimed(*row);
        let loud: Vec<usize> = (0..held_out.rmse.len()).filter(loud).collect();
        let fit = Fit { fixed: self.fixed, specs: &self.specs, parameters, ranges: &self.input.ranges };
        let following = probe::following(fit, &loud)?;
        let structured: Vec<usize> = loud
            .into_iter()
            .filter(|&row| {
                let stands_out = over(row) > self.options.structured_ratio * nearest;
                let correlated = shape.autocorrelation[row].abs() > least;
                large(row) && (stands_out || correlated) || following.contains(&row)
            })
            .collect();
        let probed = probe::probe(fit, &structured)?;
        let names: Vec<String> = self.fixed.tree.joint_names().map(str::to_owned).collect();
        let joints = structured.iter().map(|&row| names[row].clone()).collect();
        Ok(Remaining { joints, depends_on: probed, ranking, silent: Vec::new() })
    }
}

/// Hypotheses of which nothing is left beside the model's columns, whatever their constants.
fn silent(fitted: &Fitted) -> Result<Vec<EffectSpec>, RegressorError> {
    let stage = &fitted.stage;
    let evidence = stage.evidence(&fitted.determined, &fitted.weights, fitted.prior.as_ref())?;
    let mut silent: Vec<EffectSpec> = Vec::new();
    let mut heard: Vec<&EffectSpec> = Vec::new();
    for (index, candidate) in stage.candidates.iter().enumerate() {
        let [spec] = candidate.specs.as_slice() else { continue };
        let is_this = |other: &EffectSpec| other.kind == spec.kind && other.joints == spec.joints;
        if heard.iter().any(|other| is_this(other)) {
            continue;
        }
        if evidence.screen(&stage.parameters(index), &stage.rows(index))?.is_some() {
            silent.retain(|other| !is_this(other));
            heard.push(spec);
        } else if !silent.iter().any(is_this) {
            silent.push(spec.clone());
        }
    }
    Ok(silent)
}
