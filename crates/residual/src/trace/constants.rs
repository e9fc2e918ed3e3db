//! Constants closer to the best, once an effect is in the model.

use super::hypotheses::{Candidates, Present, known_of_the_site};
use super::kept_columns::Keep;
use super::search::Search;
use crate::selection::{LEAST_STEP, Member, Problem, choose_variants, value_in_force};
use phiw_effects::Constants;
use phiw_identification::{EffectSpec, IdentificationError};

/// Passes to refine constants.
const REFINEMENTS: usize = 3;

impl Search<'_> {
    /// Refines the constants of all effects of the model that are not held, linearises anew what is
    /// linearised, and makes columns again that are made of the model's torque: one pass a step, for all of
    /// them.
    pub(super) fn refine(&mut self) -> Result<(), IdentificationError> {
        self.refine_those(|_| true)
    }

    /// The same for those effects only.
    pub(super) fn refine_those(
        &mut self,
        are_those: impl Fn(&EffectSpec) -> bool,
    ) -> Result<(), IdentificationError> {
        let mut way = Way::default();
        for step in 0..REFINEMENTS {
            let mut candidates = self.near(step, &are_those)?;
            let depends = self.fixed.build(&self.specs)?.iter().any(|effect| effect.needs().of_reference());
            if candidates.effects.is_empty() && !depends {
                break;
            }
            let effects = std::mem::take(&mut candidates.effects);
            let stage = self.pass(effects, Keep::WhileThereIsRoom)?;
            let mut problem = self.fixed.problem(stage, &mut candidates)?;
            let is_linearised = problem.hypotheses.iter().any(|hypothesis| hypothesis.linearised);
            if is_linearised && !way.goes_on_from(self, &mut problem, &candidates.present)? {
                continue;
            }
            problem.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.declared = true);
            let outcome = choose_variants(&problem, candidates.present.clone(), self.policy());
            self.take(&problem, &candidates, &outcome.members, &outcome.fit.values);
            way.moved = Some((self.specs.clone(), self.parameters.clone()));
            let relinearised = self.relinearise(1.0)?;
            // What is linearised is looked at twice: the second time where it has moved to.
            if outcome.gained < LEAST_STEP && (step > 0 || !relinearised) {
                break;
            }
        }
        way.ends(self)
    }

    /// Chooses constants, among those that its kind tries first, for those effects that have none.
    pub(super) fn scan_those(
        &mut self,
        are_those: impl Fn(&EffectSpec) -> bool,
    ) -> Result<(), IdentificationError> {
        let present = Present { specs: &self.specs, declared: self.declared };
        let mut candidates = Candidates::of_model(self.fixed, present);
        for (place, spec) in self.specs.iter().enumerate() {
            if self.is_held(place) || !spec.constants.is_empty() || !are_those(spec) {
                continue;
            }
            let scanned = self.fixed.catalogue.scanned(spec, self.fixed.tree, &self.input.ranges)?;
            let specs = scanned.into_iter().map(|constants| EffectSpec { constants, ..spec.clone() });
            candidates.add_variants(self.fixed, present, place, specs.collect())?;
        }
        let effects = std::mem::take(&mut candidates.effects);
        if effects.is_empty() {
            return Ok(());
        }
        let stage = self.pass(effects, Keep::Always)?;
        let mut problem = self.fixed.problem(stage, &mut candidates)?;
        problem.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.declared = true);
        let outcome = choose_variants(&problem, candidates.present.clone(), self.policy());
        self.take(&problem, &candidates, &outcome.members, &outcome.fit.values);
        Ok(())
    }

    /// The model's effects, those that are asked for each with constants near its own.
    fn near(
        &self,
        step: usize,
        are_those: impl Fn(&EffectSpec) -> bool,
    ) -> Result<Candidates, IdentificationError> {
        let present = Present { specs: &self.specs, declared: self.declared };
        let mut candidates = Candidates::of_model(self.fixed, present);
        for (place, spec) in self.specs.iter().enumerate() {
            if self.is_held(place) || !are_those(spec) {
                continue;
            }
            let (catalogue, tree) = (self.fixed.catalogue, self.fixed.tree);
            let mut near = catalogue.refined(spec, tree, &self.input.ranges, step)?;
            if step == 0 && place < self.declared && !spec.constants.is_empty() {
                near.extend(catalogue.scanned(spec, tree, &self.input.ranges)?);
            }
            near.extend(self.as_the_joint_turns(spec)?);
            let specs = near.into_iter().map(|constants| EffectSpec { constants, ..spec.clone() });
            candidates.add_variants(self.fixed, present, place, specs.collect())?;
        }
        Ok(candidates)
    }

    /// The constants of an effect with those that belong to its joint as other effects have them, where it
    /// has others: it may have come before they were known.
    fn as_the_joint_turns(&self, spec: &EffectSpec) -> Result<Option<Constants>, IdentificationError> {
        let catalogue = self.fixed.catalogue;
        let known = known_of_the_site(catalogue, catalogue.kind(&spec.kind)?, &self.specs, &spec.joints);
        let depends = spec.constants.keys().any(|name| known.contains_key(name));
        let constants: Constants = spec.constants.clone().into_iter().chain(known).collect();
        Ok((depends && constants != spec.constants).then_some(constants))
    }

    /// Moves the point of linearisation of effects that have one, by a share of what was fitted.
    fn relinearise(&mut self, share: f64) -> Result<bool, IdentificationError> {
        let mut changed = false;
        let mut first = self.fixed.base.count();
        for (place, effect) in self.fixed.build(&self.specs)?.into_iter().enumerate() {
            let own = first..first + effect.parameters().len();
            first = own.end;
            let values = &mut self.parameters[own];
            let moves: Vec<f64> = values.iter().map(|value| share * value).collect();
            if let Some(moved) = effect.relinearised(&moves) {
                changed |= values.iter().any(|value| value.abs() > 0.0);
                self.specs[place] = moved.spec();
                values.fill(0.0);
            }
        }
        Ok(changed)
    }
}

/// What a model was on the way to better constants.
///
/// Where something is linearised a step is to first order only. One that makes the criterion larger is taken
/// again, half as long. A compliance of 3·10⁻⁶ rad/(N·m) once went to 0.04 in one step, beside a robot's
/// torques of thousands of N·m.
#[derive(Default)]
struct Way {
    /// Effective rows of each torque, the same for all of the way.
    rows: Vec<f64>,
    /// The model where the criterion was smallest, with that.
    best: Option<(f64, Model)>,
    /// What a step led to, with what is linearised not moved yet.
    moved: Option<Model>,
    /// How much of the step is taken.
    share: f64,
}

/// Effects and parameters.
type Model = (Vec<EffectSpec>, Vec<f64>);

impl Way {
    /// Whether the model as it is, of which `problem` is made, is no worse than the best on the way;
    /// otherwise half the step that led to it is taken.
    fn goes_on_from(
        &mut self,
        search: &mut Search<'_>,
        problem: &mut Problem,
        members: &[Member],
    ) -> Result<bool, IdentificationError> {
        if self.rows.is_empty() {
            let known = &search.chosen.rows;
            self.rows = if known.is_empty() { problem.independent_rows() } else { known.clone() };
        }
        let value = value_in_force(problem, members, &self.rows);
        if let (Some((best, _)), Some(moved)) = (&self.best, &self.moved)
            && value > best + LEAST_STEP
        {
            self.share *= 0.5;
            (search.specs, search.parameters) = moved.clone();
            search.relinearise(self.share)?;
            return Ok(false);
        }
        self.share = 1.0;
        self.best = Some((value, (search.specs.clone(), search.parameters.clone())));
        Ok(true)
    }

    /// Leaves the model as it is, or where the way led to a worse one, as it was where it was best.
    fn ends(self, search: &mut Search<'_>) -> Result<(), IdentificationError> {
        let (Some((best, model)), Some(_)) = (self.best, self.moved) else { return Ok(()) };
        if search.value(&self.rows)? > best + LEAST_STEP {
            (search.specs, search.parameters) = model;
        }
        Ok(())
    }
}
