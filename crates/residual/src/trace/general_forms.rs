//! A form that can imitate many others gives way to simpler ones that do its work.

use super::search::Search;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// Chooses again without each general form that was found, and takes what is found in its place if that
    /// does most of its work with no more numbers: nothing was lost that had no simple form.
    pub(super) fn prefer_simpler_forms(&mut self) -> Result<(), IdentificationError> {
        let mut asked: Vec<EffectSpec> = Vec::new();
        let mut options = self.options.clone();
        while let Some(place) = self.general_form(&asked)? {
            let spec = self.specs[place].clone();
            asked.push(spec.clone());
            options.excluded.push(spec);
            let mut without = Search { options: &options, ..self.clone() };
            without.remove(place)?;
            without.choose()?;
            without.refine()?;
            if without.numbers()? <= self.numbers()? && self.is_done_by(place, &without)? {
                let Search { specs, parameters, chosen, .. } = without;
                (self.specs, self.parameters, self.chosen) = (specs, parameters, chosen);
            } else {
                options.excluded.pop();
            }
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

    /// Parameters and constants of the effects.
    fn numbers(&self) -> Result<usize, IdentificationError> {
        let parameters: usize =
            self.fixed.build(&self.specs)?.iter().map(|effect| effect.parameters().len()).sum();
        Ok(parameters + self.specs.iter().map(|spec| spec.constants.len()).sum::<usize>())
    }

    /// Whether another model takes as good as all that the effect at `place` takes from its torques, on
    /// motion held out.
    fn is_done_by(&self, place: usize, other: &Search<'_>) -> Result<bool, IdentificationError> {
        let (own, other) = (self.trial()?, other.trial()?);
        let Some(member) = own.member(place) else { return Ok(false) };
        let squares_of_other = other.held_out_squares(&other.fit);
        let with = own.held_out_squares(&own.fit);
        let without = own.held_out_squares(&own.fit_with(|other| other != place));
        Ok(own.problem.hypotheses[member.hypothesis].torques.iter().all(|&torque| {
            let work = without[torque] - with[torque];
            without[torque] - squares_of_other[torque] >= self.options.least_of_general_form * work
        }))
    }
}
