//! A form that can imitate many others gives way to simpler ones that do its work, and one that has a simpler
//! one as its special case to that.

use super::search::Search;
use super::trial::{Squares, Trial};
use crate::selection::Member;
use phiw_effects::Constants;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// Chooses again without each general form that was found, and takes what is found in its place where
    /// that has no more numbers, and the general form is not worth a name beside it: a stop that is not
    /// quite a spring is still a stop.
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

    /// Puts the special case in the place of each effect that was found and has one, where the effect is not
    /// worth a name beside it: an offset, and no spring whose rest is far away.
    ///
    /// Two that both have an offset in them do each other's work, and neither would have a name.
    pub(super) fn prefer_special_cases(&mut self) -> Result<(), IdentificationError> {
        let mut place = self.declared;
        while place < self.specs.len() {
            let Some(special) = self.special_case(place)? else {
                place += 1;
                continue;
            };
            let mut branch = self.clone();
            let is_special = |spec: &EffectSpec| spec.kind == special.kind && spec.joints == special.joints;
            let is_there = branch.specs.iter().any(is_special);
            if is_there {
                branch.remove(place)?;
            } else {
                branch.replace(place, special)?;
            }
            branch.refine()?;
            if !self.is_done_by_special_case(place, &branch)? {
                place += 1;
                continue;
            }
            *self = branch;
            place += usize::from(!is_there);
        }
        Ok(())
    }

    /// The special case of the effect at `place`, with those of its constants that this has, too; `None`
    /// where there is none, or it may not be found.
    fn special_case(&self, place: usize) -> Result<Option<EffectSpec>, IdentificationError> {
        let own = &self.specs[place];
        let catalogue = self.fixed.catalogue;
        let Some(special) = catalogue.kind(&own.kind)?.special_case() else { return Ok(None) };
        let kind = special.kind;
        let special = EffectSpec { kind: kind.to_owned(), joints: own.joints.clone(), ..own.clone() };
        let is_special = |spec: &EffectSpec| spec.kind == special.kind && spec.joints == special.joints;
        let may_not_change = self.fixed.prior.is_some() && self.specs[..self.declared].iter().any(is_special);
        if may_not_change || self.options.excluded.iter().chain(&self.refuted).any(is_special) {
            return Ok(None);
        }
        let site: Option<Vec<usize>> =
            special.joints.iter().map(|joint| self.fixed.tree.joint_index(joint)).collect();
        let Some(site) = site else { return Ok(None) };
        let scanned = catalogue.kind(kind)?.scan(&site, &self.input.ranges).into_iter().next();
        let of_own = |(name, value): (String, f64)| {
            let value = own.constants.get(&name).copied().unwrap_or(value);
            (name, value)
        };
        let constants: Constants = scanned.unwrap_or_default().into_iter().map(of_own).collect();
        Ok(Some(EffectSpec { constants, ..special }))
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

    /// Whether the effect at `place` is not worth a name beside what another model, without it, leaves of its
    /// torques where they are foretold.
    fn is_done_by(&self, place: usize, other: &Search<'_>) -> Result<bool, IdentificationError> {
        let beside = self.beside(place, other)?;
        Ok(beside.is_some_and(|(own, member, squares)| {
            !self.is_seen_or_absorbed(&own, member, &squares, |_| 0.0).0
        }))
    }

    /// The same where the other model has its special case: it is a form of that, and is one still where that
    /// leaves most of what it takes, or where others have taken up most of what that does not make.
    fn is_done_by_special_case(&self, place: usize, other: &Search<'_>) -> Result<bool, IdentificationError> {
        let Some((own, member, squares)) = self.beside(place, other)? else { return Ok(false) };
        let spec = &self.specs[place];
        let special = self.fixed.catalogue.kind(&spec.kind)?.special_case();
        let parameters = self.fixed.build(std::slice::from_ref(spec))?;
        let parameters = parameters.iter().flat_map(|effect| effect.parameters());
        let alike =
            parameters.zip(&own.problem.variant(member).parameters).find_map(|(parameter, &place)| {
                (Some(parameter.name.as_str()) == special.and_then(|special| special.parameter))
                    .then_some(place)
            });
        // What is left of its torque beside the column that makes the special case.
        let beyond = |torque: usize| {
            let (rows, values) = (own.torque(torque), own.values_of(member, torque));
            let column = alike.and_then(|parameter| own.problem.torques[torque].column(parameter));
            let along = column.map_or(0.0, |column| {
                let products = rows.column(column);
                let along: f64 = values.iter().map(|&(other, value)| products[other] * value).sum();
                along * along / products[column].max(f64::MIN_POSITIVE)
            });
            (rows.size_of(&values) - along).max(0.0)
        };
        let (seen, absorbed) = self.is_seen_or_absorbed(&own, member, &squares, beyond);
        Ok(!seen && !absorbed && !self.is_form_material(&own, member, &squares))
    }

    /// The effect at `place` in the model on trial, and what this and another model leave where torques are
    /// foretold.
    fn beside(
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
