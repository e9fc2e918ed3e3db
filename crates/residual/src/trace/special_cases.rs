//! An effect that has a simpler one as its special case gives way to that, and refines it.

use super::search::Search;
use crate::selection::LEAST_STEP;
use phiw_effects::Constants;
use phiw_identification::{EffectSpec, IdentificationError};

/// An effect that gave way to its special case and is in the model again beside it.
#[derive(Clone, Debug)]
pub(super) struct Refined {
    /// The special case.
    pub special: EffectSpec,
    /// The effect, which has no name.
    pub by: EffectSpec,
}

impl Search<'_> {
    /// Puts the special case in the place of each effect that was found and has one, where the effect is not
    /// worth a name beside it: an offset, and no spring whose rest is far away.
    ///
    /// Two that both have an offset in them do each other's work, and neither would have a name; so what the
    /// effect makes beyond its special case refines that.
    pub(super) fn prefer_special_cases(&mut self) -> Result<(), IdentificationError> {
        self.noise.clone_from(&self.input.noise_floor);
        self.take_for_noise_beside_special_cases()?;
        let mut gave_way = Vec::new();
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
                branch.replace(place, special.clone())?;
            }
            branch.refine()?;
            if !self.is_done_by_special_case(place, &branch)? {
                place += 1;
                continue;
            }
            gave_way.push(Refined { by: self.specs[place].clone(), special });
            *self = branch;
            place += usize::from(!is_there);
        }
        gave_way.into_iter().try_for_each(|refined| self.refine_special_case(refined))
    }

    /// Puts an effect that gave way to its special case into the model again, beside that, where the
    /// criterion is smaller with it and motion is foretold better: the special case has the name, and the
    /// model foretells what it foretold.
    fn refine_special_case(&mut self, refined: Refined) -> Result<(), IdentificationError> {
        let mut least = self.value(&self.chosen.rows)? - LEAST_STEP;
        let mut better = None;
        for constants in self.beside_special_case(&refined)? {
            let mut branch = self.clone();
            branch.add(EffectSpec { constants, ..refined.by.clone() })?;
            branch.refine()?;
            let value = branch.value(&branch.chosen.rows)?;
            if value < least {
                least = value;
                better = Some(branch);
            }
        }
        let Some(better) = better else { return Ok(()) };
        let (own, with) = (self.trial()?, better.trial()?);
        if own.gain(&own.foretold_squares(&own.fit), &with.foretold_squares(&with.fit)) > 0.0 {
            *self = better;
            self.refined.push(refined);
        }
        Ok(())
    }

    /// Constants with which an effect has not the parameter that makes its special case, or its own where
    /// that cannot leave; none where no parameter makes it by itself, and the two would do each other's work.
    fn beside_special_case(&self, refined: &Refined) -> Result<Vec<Constants>, IdentificationError> {
        let by = &refined.by;
        let kind = self.fixed.catalogue.kind(&by.kind)?;
        let Some(own) = kind.special_case().and_then(|special| special.parameter) else {
            return Ok(Vec::new());
        };
        let site: Vec<usize> =
            by.joints.iter().filter_map(|joint| self.fixed.tree.joint_index(joint)).collect();
        let mut without = kind.scan(&site, &self.input.ranges);
        without.retain(|constants| {
            let parameters = kind.build(self.fixed.tree, &site, constants).parameters();
            parameters.iter().all(|parameter| parameter.name != own)
        });
        if without.is_empty() {
            without.push(by.constants.clone());
        }
        Ok(without)
    }

    /// Whether an effect gave way to its special case and refines it.
    pub(super) fn refines_special_case(&self, place: usize) -> bool {
        let own = &self.specs[place];
        self.refined.iter().any(|refined| refined.by.kind == own.kind && refined.by.joints == own.joints)
    }

    /// Whether an effect is a special case that is refined.
    pub(super) fn is_refined(&self, place: usize) -> bool {
        let own = &self.specs[place];
        self.refined.iter().any(|refined| {
            let special = &refined.special;
            special.kind == own.kind && special.joints == own.joints
        })
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
        // What is left of its torque beside the column that makes the special case, and beside what the
        // textbook has of the joint.
        let beside: Vec<usize> = own
            .textbook_beside(member)
            .flat_map(|other| own.problem.variant(other).parameters.iter().copied())
            .chain(alike)
            .collect();
        let beyond = |torque: usize| {
            let column = |&parameter: &usize| own.problem.torques[torque].column(parameter);
            let columns: Vec<usize> = beside.iter().filter_map(column).collect();
            own.torque(torque).size_beside(&own.values_of(member, torque), &columns)
        };
        let (seen, absorbed) = self.is_seen_or_absorbed(&own, member, &squares, beyond);
        Ok(!seen && !absorbed && !self.is_form_material(&own, member, &squares))
    }
}
