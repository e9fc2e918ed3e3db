//! Friction that turns over a way: all of a joint together, or in the place of what mended how it turned.

use super::search::Search;
use crate::selection::LEAST_STEP;
use phiw_effects::{BRISTLE_WAYS, Constants, LONGEST_BRISTLES};
use phiw_identification::{EffectSpec, IdentificationError};

/// How much larger the criterion is to be with a friction that turns over a way in the place of a form of it:
/// about what a name takes (five standard deviations of one parameter are 12).
const A_FORM_IS_WORTH: f64 = 10.0;

impl Search<'_> {
    /// Lets the frictions of a joint turn over a way, as bristles do, in the place of a hysteresis or a delay
    /// of that joint, where the criterion is then smaller, or little larger with a friction in the place of a
    /// hysteresis. Whether any do.
    ///
    /// Constants are refined one effect after the other, and each is best as it is beside what mends it.
    pub(super) fn turn_over_a_way(&mut self) -> Result<bool, IdentificationError> {
        let catalogue = self.fixed.catalogue;
        let mut own = None;
        let mut any = false;
        for place in (self.declared..self.specs.len()).rev() {
            let joints = self.specs[place].joints.clone();
            if joints.len() != 1 || !catalogue.kind(&self.specs[place].kind)?.mends_turning() {
                continue;
            }
            let way = catalogue.kind(&self.specs[place].kind)?.way_of_turning(&self.specs[place].constants);
            let mut together = self.clone();
            for other in 0..self.specs.len() {
                let spec = &mut together.specs[other];
                let is_open = spec.joints == joints && !self.is_held(other);
                if let Some(turned) = catalogue.kind(&spec.kind)?.turned_over_a_way(&spec.constants, way)
                    && is_open
                {
                    spec.constants = turned;
                }
            }
            let (mut branches, mut may_lose) = (vec![together], 0.0);
            if let Some(simpler) = self.simpler_that_turns(place, way)? {
                // A form of a friction gives way to the friction, if that does about as much; the others of
                // the joint turn over the same way, or as they did.
                branches.push(self.clone());
                may_lose = A_FORM_IS_WORTH;
                for branch in &mut branches {
                    branch.replace(place, simpler.clone())?;
                }
            } else if branches[0].specs != self.specs {
                branches[0].remove(place)?;
            } else {
                continue;
            }
            for mut branch in branches {
                branch.refine()?;
                let value = branch.value(&branch.chosen.rows)?;
                let present = match own {
                    Some(own) => own,
                    None => *own.insert(self.value(&self.chosen.rows)?),
                };
                if value < present + may_lose {
                    *self = branch;
                    own = Some(value);
                    any = true;
                    break;
                }
            }
        }
        Ok(any)
    }

    /// Lets all frictions of a joint that has several turn over a way, where the criterion is then smaller:
    /// of several that turn over a speed, or over another way, one alone is no better. Whether any do.
    pub(super) fn turn_together(&mut self) -> Result<bool, IdentificationError> {
        let mut own = None;
        let mut any = false;
        for joint in self.fixed.tree.joint_names().map(str::to_owned).collect::<Vec<_>>() {
            let Some(mut branch) = self.over_the_best_way(&joint)? else { continue };
            branch.refine_those(|spec| spec.joints == [joint.as_str()])?;
            let value = branch.value(&branch.chosen.rows)?;
            let present = match own {
                Some(own) => own,
                None => *own.insert(self.value(&self.chosen.rows)?),
            };
            if value < present - LEAST_STEP {
                *self = branch;
                own = Some(value);
                any = true;
            }
        }
        Ok(any)
    }

    /// The model with all frictions of a joint turning over the way, of those that are tried first, at which
    /// the criterion is smallest. `None` for a joint that has not several, and for one whose turning
    /// something mends: beside that another way is best than in its place.
    fn over_the_best_way(&self, joint: &str) -> Result<Option<Self>, IdentificationError> {
        let catalogue = self.fixed.catalogue;
        let mut best: Option<(f64, Self)> = None;
        for way in BRISTLE_WAYS {
            let mut branch = self.clone();
            let mut frictions = 0;
            for place in (0..self.specs.len()).filter(|&place| self.specs[place].joints == [joint]) {
                let spec = &mut branch.specs[place];
                let kind = catalogue.kind(&spec.kind)?;
                if kind.mends_turning() {
                    return Ok(None);
                }
                if let Some(constants) = kind.turned_over_a_way(&spec.constants, Some(way))
                    && !self.is_held(place)
                {
                    spec.constants = constants;
                    frictions += 1;
                }
            }
            if frictions < 2 {
                return Ok(None);
            }
            let value = branch.value(&branch.chosen.rows)?;
            if best.as_ref().is_none_or(|(smallest, _)| value < *smallest) {
                best = Some((value, branch));
            }
        }
        Ok(best.map(|(_, branch)| branch))
    }

    /// Calls a form of a friction that turns over a way as short as that of bristles by the friction's name,
    /// where the joint has lost that: the two have the same torque, but where a log begins.
    pub(super) fn call_by_the_frictions_name(&mut self) -> Result<(), IdentificationError> {
        for place in self.declared..self.specs.len() {
            let own = &self.specs[place];
            let way = self.fixed.catalogue.kind(&own.kind)?.way_of_turning(&own.constants);
            let way = way.filter(|way| *way <= LONGEST_BRISTLES);
            if way.is_some()
                && let Some(simpler) = self.simpler_that_turns(place, way)?
            {
                self.specs[place] = simpler;
            }
        }
        Ok(())
    }

    /// Whether an effect is no more than how a friction of its joint turns, over a way as short as that of
    /// bristles: then it refines that friction.
    pub(super) fn is_how_a_friction_turns(&self, place: usize) -> bool {
        let catalogue = self.fixed.catalogue;
        let own = &self.specs[place];
        let turns = |spec: &EffectSpec| {
            let kind = catalogue.kind(&spec.kind);
            kind.is_ok_and(|kind| kind.turned_over_a_way(&spec.constants, None).is_some())
        };
        let way = catalogue.kind(&own.kind).ok().and_then(|kind| kind.way_of_turning(&own.constants));
        way.is_some_and(|way| way <= LONGEST_BRISTLES)
            && self.specs.iter().any(|spec| spec.joints == own.joints && turns(spec))
    }

    /// The simpler kind, turning over a way, that the effect at `place` is a form of, where the model does
    /// not have it on that joint and it may be found.
    fn simpler_that_turns(
        &self,
        place: usize,
        way: Option<f64>,
    ) -> Result<Option<EffectSpec>, IdentificationError> {
        let catalogue = self.fixed.catalogue;
        let own = &self.specs[place];
        for &kind in catalogue.kind(&own.kind)?.form_of() {
            let Some(constants) = catalogue.kind(kind)?.turned_over_a_way(&Constants::new(), way) else {
                continue;
            };
            let is_this = |spec: &EffectSpec| spec.kind == kind && spec.joints == own.joints;
            if !self.specs.iter().chain(&self.options.excluded).any(is_this) {
                return Ok(Some(EffectSpec { kind: kind.to_owned(), joints: own.joints.clone(), constants }));
            }
        }
        Ok(None)
    }
}
