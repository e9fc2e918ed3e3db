//! A form that can imitate many others gives way to simpler ones that do its work.

use super::search::Search;
use super::trial::{Squares, Trial};
use crate::selection::Member;
use phiw_effects::Constants;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// Chooses again without each general form that was found, among what acts on its torques, and takes what
    /// is found in its place where the criterion is smaller with it; or where the general form is not worth a
    /// name beside it and has as many numbers or more: a stop that is not quite a spring is still a stop.
    ///
    /// Several in its place must make the criterion no larger: with enough of them any curve is drawn but for
    /// what is not worth a name. Where any gave way, what is missing beside its successor is sought.
    pub(super) fn prefer_simpler_forms(&mut self) -> Result<(), IdentificationError> {
        let mut asked: Vec<EffectSpec> = Vec::new();
        let mut options = self.options.clone();
        let mut gave_way = Vec::new();
        while let Some(place) = self.general_form(&asked)? {
            let spec = self.specs[place].clone();
            asked.push(spec.clone());
            let own = self.fixed.build(std::slice::from_ref(&spec))?;
            options.torques = Some(own.iter().flat_map(|own| own.entries()).map(|entry| entry.row).collect());
            options.excluded.push(spec.clone());
            let mut without = Search { options: &options, ..self.clone() };
            without.remove(place)?;
            // What the others can do of its work is not to be seen in the residual.
            without.refine()?;
            without.choose()?;
            without.refine()?;
            let in_its_place = without.specs.iter().filter(|spec| !self.has(spec)).count();
            let rows = &self.chosen.rows;
            let is_no_more = in_its_place <= 1 && without.numbers()? <= self.numbers()?;
            if without.value(rows)? <= self.value(rows)? || is_no_more && self.is_done_by(place, &without)? {
                let Search { specs, parameters, chosen, .. } = without;
                (self.specs, self.parameters, self.chosen) = (specs, parameters, chosen);
                gave_way.push(EffectSpec { constants: Constants::new(), ..spec });
            } else {
                options.excluded.pop();
            }
        }
        if !gave_way.is_empty() {
            self.refuted.extend(gave_way);
            self.settle()?;
        }
        Ok(())
    }

    /// The place of a general form that was found and is not among those asked of.
    fn general_form(&self, asked: &[EffectSpec]) -> Result<Option<usize>, IdentificationError> {
        let is = |a: &EffectSpec, b: &EffectSpec| a.kind == b.kind && a.joints == b.joints;
        for (place, spec) in self.specs.iter().enumerate().skip(self.declared) {
            let is_general = self.fixed.catalogue.kind(&spec.kind)?.is_general_form();
            if is_general && !asked.iter().any(|other| is(other, spec)) {
                return Ok(Some(place));
            }
        }
        Ok(None)
    }

    /// Whether there is an effect of this kind and on these joints.
    fn has(&self, spec: &EffectSpec) -> bool {
        self.specs.iter().any(|own| own.kind == spec.kind && own.joints == spec.joints)
    }

    /// Parameters and constants of the effects.
    fn numbers(&self) -> Result<usize, IdentificationError> {
        let parameters: usize =
            self.fixed.build(&self.specs)?.iter().map(|effect| effect.parameters().len()).sum();
        Ok(parameters + self.specs.iter().map(|spec| spec.constants.len()).sum::<usize>())
    }

    /// Whether the effect at `place` is not worth a name beside what another model, without it, leaves of its
    /// torques where they are foretold.
    fn is_done_by(&self, place: usize, other: &Search<'_>) -> Result<bool, IdentificationError> {
        let beside = self.beside(place, other)?;
        Ok(beside.is_some_and(|(own, member, squares)| {
            !self.is_seen_or_absorbed(&own, member, &squares, |_| 0.0).0
        }))
    }

    /// The effect at `place` in the model on trial, and what this and another model leave where torques are
    /// foretold.
    pub(super) fn beside(
        &self,
        place: usize,
        other: &Search<'_>,
    ) -> Result<Option<(Trial, Member, Squares)>, IdentificationError> {
        let (own, other) = (self.trial()?, other.trial()?);
        let Some(member) = own.member(place) else { return Ok(None) };
        let squares = Squares {
            initial: own.foretold_squares(&own.fit_with(|other| other < self.declared)),
            without: other.foretold_squares(&other.fit),
            with: own.foretold_squares(&own.fit),
        };
        Ok(Some((own, member, squares)))
    }
}
