//! The end of a search: the final fit, what each effect explained, what remains.

use super::harm::Harm;
use super::scanned::scanned_constants;
use super::search::Search;
use super::tracing::{ROUNDING, Tracing, Verdict};
use phiw_identification::fitting::{
    Fit, OwnTorqueFit, Rests, TorqueError, accumulate, accumulate_folds, fit, fit_with_own_torque,
    log_changes, torque_error,
};
use phiw_identification::{Design, EffectSpec, IdentificationError, Identified};
use phiw_regressor::least_squares::GroupedFactor;

/// Times that the bound for the error on trial is lowered, before all that was found leaves.
const TIGHTENINGS: usize = 2;
/// How much lower it is than what would just suffice.
const TIGHTER: f64 = 0.99;

impl Search<'_> {
    /// Training motion alone decides, unless the declared model foretells motion held out better than what is
    /// chosen: a model that an effect makes worse is of no use to anybody. Then that motion has a say, and
    /// the result says so.
    pub(super) fn finish(mut self) -> Result<Tracing, IdentificationError> {
        self.refine_together()?;
        self.settle_between_logs()?;
        let before = self.declared_error()?;
        let most = self.counted(&before.1) * (1.0 + ROUNDING);
        let tracing = self.clone().finish_with(before.clone(), Harm::EachTorque)?;
        if self.is_no_worse_than_declared(&tracing) || !tracing.withdrawn.is_empty() {
            return Ok(tracing);
        }
        let blind = tracing.specs;
        let tracing = self.with_a_say_of_what_is_held_out(before, most)?;
        let is_in = |spec: &EffectSpec| {
            tracing.specs.iter().any(|other| other.kind == spec.kind && other.joints == spec.joints)
        };
        let left_out_by_held_out = blind.into_iter().filter(|spec| !is_in(spec)).collect();
        Ok(Tracing { held_out_had_a_say: true, left_out_by_held_out, ..tracing })
    }

    /// Whether the model's error on motion held out is no worse than the declared one's, of all torques
    /// together. It may be larger, but be the same error (`same_error`), where the mean of the torques'
    /// errors is smaller by at least as much: one joint of large torques that nothing foretells has no say
    /// about all others.
    pub(super) fn is_no_worse_than_declared(&self, tracing: &Tracing) -> bool {
        let (after, before) = (&tracing.model.held_out, &tracing.before.1);
        let growth = (self.counted(after) / self.counted(before)).ln();
        let share = self.options.thresholds.negligible_share();
        let of_the_mean = after.mean_logarithm_from(share) - before.mean_logarithm_from(share);
        let is_same = growth <= self.options.thresholds.same_error.ln();
        growth <= ROUNDING || is_same && growth + of_the_mean <= 0.0
    }

    /// The error of all torques together, over them, where one that is as good as none counts as the largest
    /// such: a joint of large torques would hide by its noise what is won on all others.
    pub(super) fn counted(&self, error: &TorqueError) -> f64 {
        error.relative_from(self.options.thresholds.negligible_share())
    }

    /// Of the other ways to end the search the first that is no worse there than the declared model, whose
    /// errors are `before` and whose relative error there is `most`.
    fn with_a_say_of_what_is_held_out(
        self,
        before: (TorqueError, TorqueError),
        most: f64,
    ) -> Result<Tracing, IdentificationError> {
        let tracing =
            self.clone().finish_with(before.clone(), Harm::HeldOut { most_relative: f64::INFINITY })?;
        if self.is_no_worse_than_declared(&tracing) {
            return Ok(tracing);
        }
        // What is made of the model's torque was judged with that of an earlier fit.
        if let Some(without) = self.without_what_depends_on_the_model()? {
            let tracing = without.finish_with(before.clone(), Harm::EachTorque)?;
            if self.is_no_worse_than_declared(&tracing) {
                return Ok(tracing);
            }
        }
        // What lowers the error of most torques may raise that of all together. And what is left on trial,
        // with the weights of the search, is not quite what the final fit leaves.
        let mut most_relative = most;
        for _ in 0..TIGHTENINGS {
            let tracing = self.clone().finish_with(before.clone(), Harm::HeldOut { most_relative })?;
            if self.is_no_worse_than_declared(&tracing) {
                return Ok(tracing);
            }
            most_relative *= TIGHTER * most / self.counted(&tracing.model.held_out);
        }
        self.finish_with(before, Harm::HeldOut { most_relative: 0.0 })
    }

    /// The same without the effects that were found and whose columns are made of the model's torque or are
    /// linearised about what is in force; nothing if there are none.
    fn without_what_depends_on_the_model(&self) -> Result<Option<Self>, IdentificationError> {
        let effects = self.fixed.build(&self.specs)?;
        let mut branch = self.clone();
        for place in (self.declared..self.specs.len()).rev() {
            if effects[place].needs().of_reference() || self.fixed.absent(&self.specs[place])?.is_some() {
                branch.remove(place)?;
            }
        }
        if branch.specs.len() == self.specs.len() {
            return Ok(None);
        }
        branch.refine()?;
        Ok(Some(branch))
    }

    fn finish_with(
        mut self,
        before: (TorqueError, TorqueError),
        harm: Harm,
    ) -> Result<Tracing, IdentificationError> {
        let (mut effects, named) = self.name(harm)?;
        let mut refinements = effects.split_off(named);
        // An end that what was declared has yet to join is no declared model.
        let has_all = self.withdrawn.is_empty() && self.declared == self.input.declared.len();
        let as_declared = effects.is_empty() && refinements.is_empty() && has_all;
        if as_declared && self.is_worse_than(&before.1)? {
            self.specs.clone_from(&self.input.declared);
            self.parameters.clone_from(&self.input.parameters);
        }
        let data = self.whole;
        let searched = self.parameters.clone();
        let OwnTorqueFit { design, fit: final_fit, folds } =
            self.final_fit(effects.is_empty() && refinements.is_empty())?;
        let mut train_folds = folds.moving;
        let held_out_folds = train_folds.split_off(data.train.len());
        let (train, held_out) = errors(&train_folds, &held_out_folds, &final_fit.parameters)?;
        self.parameters.clone_from(&final_fit.parameters);
        let mut model = Identified { design, fit: final_fit, train, held_out, train_folds, held_out_folds };
        let mut constants = Vec::new();
        if self.fixed.prior.is_none() {
            constants = scanned_constants(self.fixed.catalogue, &self.input.ranges, &mut model, data)?;
            let impossible = self.impossible(&model.design, &model.fit);
            let uncertain = self.uncertain(&model, effects.len())?;
            let untold = untold(&model.design, &model.fit, self.declared);
            if impossible.is_empty() && !untold.is_empty() {
                for place in untold.into_iter().rev() {
                    self.put_in_force_or_remove(place, &model.design, &searched)?;
                }
                self.refine()?;
                return self.finish_with(before, harm);
            }
            if !impossible.is_empty() || !uncertain.is_empty() {
                let changes = !impossible.is_empty();
                self.remove_impossible(impossible)?;
                if changes {
                    self.refine()?;
                }
                self.uncertain.extend(uncertain);
                return self.finish_with(before, harm);
            }
        }
        if let Some(with) = self.with_textbook(&model)? {
            model = with.model;
            self.specs.extend(with.specs);
            self.parameters.clone_from(&model.fit.parameters);
            refinements.extend(with.found);
        }
        let changes = match self.fixed.prior {
            Some(_) => Vec::new(),
            None => log_changes(&model.fit, &data.train, &model.train_folds)?,
        };
        let remaining =
            self.remaining(&model.held_out_folds, (&model.train, &model.held_out), &model.fit, &changes)?;
        let verdict = match (effects.is_empty(), remaining.joints.is_empty()) {
            (true, true) => Verdict::Sufficient,
            (true, false) => Verdict::Unexplained,
            (false, true) => Verdict::Explained,
            (false, false) => Verdict::PartlyExplained,
        };
        let not_judged = self.fixed.not_judged.lock().map(|hypotheses| hypotheses.iter().cloned().collect());
        let not_judged = not_judged.unwrap_or_default();
        Ok(Tracing {
            verdict,
            specs: self.specs,
            model,
            constants,
            withdrawn: self.withdrawn,
            before,
            effects,
            refinements,
            remaining,
            held_out_had_a_say: self.held_out_had_a_say || !self.left_out_by_held_out.is_empty(),
            left_out_by_held_out: self.left_out_by_held_out,
            told_by_held_out: self.told_by_held_out,
            not_judged,
        })
    }

    /// Puts a factor of a torque in force that the search has found, which is exact however large it is, and
    /// removes any other effect. Beside the frictions of the same fit nothing tells a torque that is half of
    /// what it is from one that is made of half of each parameter, until that torque is another.
    fn put_in_force_or_remove(
        &mut self,
        place: usize,
        design: &Design,
        searched: &[f64],
    ) -> Result<(), IdentificationError> {
        let own = design.effect_parameters(place);
        let least = self.options.thresholds.least_size;
        let in_force = design.effects()[place].with_logged_factor(&searched[own.clone()]);
        let factor = in_force.as_ref().and_then(|in_force| in_force.logged_factor());
        let is_material = factor.is_some_and(|(_, factor)| (factor - 1.0).abs() >= least);
        match in_force.filter(|_| is_material) {
            Some(in_force) => {
                self.specs[place] = in_force.spec();
                self.parameters[own].fill(0.0);
                Ok(())
            }
            None => self.remove(place),
        }
    }

    /// The model fitted to all training motion; a held one as it is held, if `nothing_was_found`, or as the
    /// search left it.
    ///
    /// Where columns are made of the model's torque, it is that of the fit: the model as it is used.
    pub(super) fn final_fit(&self, nothing_was_found: bool) -> Result<OwnTorqueFit, IdentificationError> {
        let (design, data) = (self.design()?, self.whole);
        let folds = [data.train.as_slice(), &data.held_out].concat();
        let train = data.train.len();
        let read = |design: &Design| accumulate_folds(design, &folds, &data.sources, Rests::Dropped);
        let folds = read(&design)?;
        let mut first = fit(&design, &folds.moving[..train])?;
        if self.fixed.prior.is_none() {
            return fit_with_own_torque(design, first, folds, train, read, fit);
        }
        first.parameters = match nothing_was_found {
            true => self.input.parameters.clone(),
            false => self.parameters.clone(),
        };
        let design = design.with_own_reference(&first.parameters)?;
        let folds = if design.needs().of_reference() { read(&design)? } else { folds };
        Ok(OwnTorqueFit { design, fit: first, folds })
    }

    /// Of the `named` effects, the first that were found, those of which no parameter is certain: the 95 %
    /// interval of each holds nothing. That is about the value that it has with all effects' constants free;
    /// of an effect that has no constants, whose value means the same with other ones, also about its own.
    /// But what others on the same joint are beyond is there with them: the level that a Stribeck friction
    /// rises from is hardly told where that is wide.
    fn uncertain(
        &self,
        model: &Identified,
        named: usize,
    ) -> Result<Vec<(String, Vec<String>)>, IdentificationError> {
        let mut uncertain = Vec::new();
        let quantile = model.fit.covariance.quantile_95();
        for (place, effect) in model.design.effects().iter().enumerate().skip(self.declared).take(named) {
            let EffectSpec { kind, joints, constants } = effect.spec();
            let own = model.design.effect_parameters(place);
            let is_certain = own.zip(effect.parameters()).any(|(parameter, info)| {
                // Of what is linearised the value stands partly in the constant of the same name.
                let in_force = constants.get(&info.name).copied().unwrap_or_default();
                let [low, high] = model.fit.intervals_95[parameter];
                let half = quantile * model.fit.standard_deviations[parameter];
                let value = in_force + model.fit.parameters[parameter];
                let holds_nothing = in_force + low <= 0.0 && in_force + high >= 0.0;
                // Logs too short for an interval (NaN) say nothing against it.
                !(holds_nothing || constants.is_empty() && value.abs() <= half)
            });
            if !is_certain && !self.is_below_another(&kind, &joints)? {
                uncertain.push((kind, joints));
            }
        }
        Ok(uncertain)
    }

    /// Whether another effect of the model, on the same joints, is what is beyond this kind.
    fn is_below_another(&self, kind: &str, joints: &[String]) -> Result<bool, IdentificationError> {
        for other in self.specs.iter().filter(|other| other.joints == joints) {
            if self.fixed.catalogue.kind(&other.kind)?.is_beyond().contains(&kind) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Whether other constants of the declared effects make the error on motion held out larger than it was
    /// with those that were declared.
    fn is_worse_than(&self, declared: &TorqueError) -> Result<bool, IdentificationError> {
        let design = self.design()?;
        let data = self.whole;
        let folds = accumulate(&design, &data.held_out, &data.sources)?;
        Ok(self.counted(&torque_error(&folds, &self.parameters)?) > self.counted(declared))
    }

    /// Error of the declared (or held) model: training, held out.
    fn declared_error(&self) -> Result<(TorqueError, TorqueError), IdentificationError> {
        let data = self.whole;
        let (specs, parameters) = (&self.input.declared, &self.input.parameters);
        let folds = [data.train.as_slice(), &data.held_out].concat();
        let effects = self.fixed.build(specs)?;
        let design = Design::new(self.fixed.tree.clone(), self.fixed.base.clone(), effects)
            .with_rest_speeds(data.rest_speeds.clone())
            .with_own_reference(parameters)?;
        let mut train = accumulate(&design, &folds, &data.sources)?;
        let held_out = train.split_off(data.train.len());
        errors(&train, &held_out, parameters)
    }
}

/// The places, from `first` on and ascending, of the effects of which the fit has nothing: the logs determine
/// none of their parameters beside the others', and none has a value in force. To first order, beside the
/// model that it was chosen for, there was something.
fn untold(design: &Design, fit: &Fit, first: usize) -> Vec<usize> {
    let is_untold = |place: &usize| {
        let effect = &design.effects()[*place];
        let constants = effect.spec().constants;
        let in_force = |name: &String| constants.get(name).is_some_and(|value| *value != 0.0);
        let mut own = design.effect_parameters(*place).zip(effect.parameters());
        own.all(|(parameter, info)| fit.undetermined.contains(&parameter) && !in_force(&info.name))
    };
    (first..design.effects().len()).filter(is_untold).collect()
}

pub(super) fn errors(
    train: &[GroupedFactor],
    held_out: &[GroupedFactor],
    parameters: &[f64],
) -> Result<(TorqueError, TorqueError), IdentificationError> {
    Ok((torque_error(train, parameters)?, torque_error(held_out, parameters)?))
}

#[cfg(test)]
mod tests {
    use super::untold;
    use phiw_dynamics::random_tree::{RandomTreeOptions, random_tree};
    use phiw_effects::Catalogue;
    use phiw_identification::fitting::{accumulate, fit};
    use phiw_identification::{BlockSource, Design, EffectCatalogue, EffectSpec, Fold};
    use phiw_regressor::BaseParameters;
    use phiw_telemetry::Block;

    /// A gain that left the fit, since the logs did not tell it beside all others, was named: "the torque of
    /// joint_5 is measured 0.0 % too large".
    #[test]
    fn what_the_logs_tell_nothing_of_is_not_in_the_model() {
        let tree = random_tree(5, &RandomTreeOptions { joints: 2, ..Default::default() }).unwrap();
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let signal = |phase: f64| -> Vec<f64> {
            (0..800).map(|row| (0.01 * f64::from(row) * (2.0 + f64::from(row % 2)) + phase).sin()).collect()
        };
        let t: Vec<f64> = (0..400).map(|sample| 0.02 * f64::from(sample)).collect();
        let blocks = vec![Block::unfiltered(2, t, [signal(0.0), signal(1.5), signal(3.0)], signal(0.7))];
        let sources: [&dyn BlockSource; 1] = [&blocks];
        let folds = [0.0, 4.0].map(|start| Fold { log: 0, start, end: start + 4.0 });
        let specs = ["viscous_friction", "coulomb_friction", "viscous_friction"]
            .map(|kind| EffectSpec::new(kind, &[joints[0].as_str()]));
        let effects = specs.iter().map(|spec| Catalogue::default().build(spec, &tree).unwrap()).collect();
        let base = BaseParameters::of_tree(&tree, Default::default()).unwrap();
        let design = Design::new(tree.clone(), base, effects).with_rest_speeds(vec![0.0; 2]);
        let fitted = fit(&design, &accumulate(&design, &folds, &sources).unwrap()).unwrap();
        assert_eq!(untold(&design, &fitted, 0), [2]);
        assert_eq!(untold(&design, &fitted, 3), [0; 0]);
    }
}
