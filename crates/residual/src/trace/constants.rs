//! Constants closer to the best, once an effect is in the model.

use super::hypotheses::{Candidates, Present, known_of_the_site};
use super::kept_columns::Keep;
use super::search::Search;
use crate::selection::{LEAST_STEP, choose_variants};
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
        for step in 0..REFINEMENTS {
            let mut candidates = self.near(step, &are_those)?;
            let depends = self.fixed.build(&self.specs)?.iter().any(|effect| effect.needs().of_reference());
            if candidates.effects.is_empty() && !depends {
                break;
            }
            let effects = std::mem::take(&mut candidates.effects);
            let stage = self.pass(effects, Keep::WhileThereIsRoom)?;
            let mut problem = self.fixed.problem(stage, &mut candidates)?;
            problem.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.declared = true);
            let outcome = choose_variants(&problem, candidates.present.clone(), self.policy());
            self.take(&problem, &candidates, &outcome.members, &outcome.fit.values);
            let relinearised = self.relinearise()?;
            // What is linearised is looked at twice: the second time where it has moved to.
            if outcome.gained < LEAST_STEP && (step > 0 || !relinearised) {
                break;
            }
        }
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
                let site: Vec<usize> =
                    spec.joints.iter().filter_map(|joint| tree.joint_index(joint)).collect();
                near.extend(catalogue.kind(&spec.kind)?.scan(&site, &self.input.ranges));
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

    /// Moves the point of linearisation of effects that have one.
    fn relinearise(&mut self) -> Result<bool, IdentificationError> {
        let mut changed = false;
        let mut first = self.fixed.base.count();
        for (place, effect) in self.fixed.build(&self.specs)?.into_iter().enumerate() {
            let own = first..first + effect.parameters().len();
            first = own.end;
            let values = &mut self.parameters[own];
            if let Some(moved) = effect.relinearised(values) {
                changed |= values.iter().any(|value| value.abs() > 0.0);
                self.specs[place] = moved.spec();
                values.fill(0.0);
            }
        }
        Ok(changed)
    }
}
