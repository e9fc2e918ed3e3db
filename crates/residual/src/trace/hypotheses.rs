//! What could be missing: every kind, site and constant that the logs may be asked about.

use super::input::TraceOptions;
use super::stage::Fixed;
use crate::selection::Member;
use phiw_effects::{Catalogue, Constants, EffectKind, SignalRanges};
use phiw_identification::{Effect, EffectSpec, IdentificationError};

/// A kind on a site, with the constants to choose from.
pub(super) struct Candidate {
    /// Its number, see [`number_of`].
    pub kind: usize,
    /// Whether the kind acts on each joint by itself.
    pub familiar: bool,
    /// One for each variant.
    pub specs: Vec<EffectSpec>,
    /// The place of each variant's effect in the design.
    pub effects: Vec<usize>,
    /// Whether it stays in the model.
    pub declared: bool,
}

/// All candidates, and the effects that the design needs for them beside those that are in the model.
pub(super) struct Candidates {
    pub list: Vec<Candidate>,
    pub effects: Vec<Box<dyn Effect>>,
    /// The effects of the model as members.
    pub present: Vec<Member>,
}

/// The effects of the model, those declared first, and how many these are.
#[derive(Clone, Copy)]
pub(super) struct Present<'a> {
    pub specs: &'a [EffectSpec],
    pub declared: usize,
}

/// A number for hypotheses of the kind of a rank in the catalogue: two for each, in its order, for those on
/// single joints and for those on several together.
fn number_of(rank: usize, joints: usize) -> usize {
    2 * rank + usize::from(joints > 1)
}

/// The rank in the catalogue of the kind of a number.
pub(super) fn rank_of(number: usize) -> usize {
    number / 2
}

impl Candidates {
    /// The effects of the model, each as it is. Declared effects of a held model are no candidates but part
    /// of what is held.
    pub fn of_model(fixed: &Fixed<'_>, present: Present<'_>) -> Self {
        let mut candidates = Candidates { list: Vec::new(), effects: Vec::new(), present: Vec::new() };
        for (place, spec) in present.specs.iter().enumerate() {
            let declared = place < present.declared;
            if declared && fixed.prior.is_some() {
                continue;
            }
            let rank = fixed.catalogue.rank(&spec.kind).unwrap_or_default();
            candidates.present.push(Member { hypothesis: candidates.list.len(), variant: 0 });
            candidates.list.push(Candidate {
                kind: number_of(rank, spec.joints.len()),
                familiar: spec.joints.len() == 1,
                specs: vec![spec.clone()],
                effects: vec![place],
                declared,
            });
        }
        candidates
    }

    /// The same with every hypothesis that is open beside them, of the kinds that are `sought`.
    pub fn all(
        fixed: &Fixed<'_>,
        present: Present<'_>,
        ranges: &SignalRanges,
        options: &TraceOptions,
        sought: impl Fn(&dyn EffectKind) -> bool,
    ) -> Result<Self, IdentificationError> {
        let mut all = Self::of_model(fixed, present);
        let held = fixed.prior.is_some();
        for (rank, kind) in fixed.catalogue.kinds().enumerate() {
            if (kind.needs_held_model() && !held) || !sought(kind) {
                continue;
            }
            for site in kind.sites(fixed.tree) {
                let joints: Vec<String> =
                    site.iter().map(|&joint| fixed.tree.joint(joint).joint.clone()).collect();
                let is_this = |spec: &EffectSpec| spec.kind == kind.name() && spec.joints == joints;
                if options.excluded.iter().any(is_this) {
                    continue;
                }
                let is_varied =
                    |varied| present.specs.iter().any(|spec| spec.kind == varied && spec.joints == joints);
                if !kind.varies().is_none_or(is_varied) && !present.specs.iter().any(is_this) {
                    continue;
                }
                let constants = scan(fixed.catalogue, kind, &site, ranges, present.specs, &joints);
                let place = present.specs.iter().position(is_this);
                let changed =
                    held && kind.may_change() && place.is_some_and(|place| place < present.declared);
                match place.filter(|_| !changed) {
                    Some(place) => {
                        let specs = constants
                            .into_iter()
                            .map(|constants| EffectSpec { constants, ..present.specs[place].clone() });
                        all.add_variants(fixed, present, place, specs.collect())?;
                    }
                    None => all.push(fixed, present, rank, kind, &site, constants),
                }
            }
        }
        if let Some(torques) = &options.torques {
            all.restrict(torques, present.specs.len());
        }
        Ok(all)
    }

    /// Other constants for an effect of the model; none where it is linearised about what is in force.
    pub fn add_variants(
        &mut self,
        fixed: &Fixed<'_>,
        present: Present<'_>,
        place: usize,
        specs: Vec<EffectSpec>,
    ) -> Result<(), IdentificationError> {
        let Some(candidate) = self.list.iter_mut().find(|candidate| candidate.effects[0] == place) else {
            return Ok(());
        };
        if fixed.absent(&present.specs[place])?.is_some() {
            return Ok(());
        }
        for spec in specs {
            if !candidate.specs.contains(&spec) {
                candidate.effects.push(present.specs.len() + self.effects.len());
                self.effects.extend(fixed.build(std::slice::from_ref(&spec))?);
                candidate.specs.push(spec);
            }
        }
        Ok(())
    }

    fn push(
        &mut self,
        fixed: &Fixed<'_>,
        present: Present<'_>,
        rank: usize,
        kind: &dyn EffectKind,
        site: &[usize],
        scanned: Vec<Constants>,
    ) {
        if scanned.is_empty() {
            return;
        }
        let first = present.specs.len() + self.effects.len();
        let built: Vec<Box<dyn Effect>> =
            scanned.iter().map(|constants| kind.build(fixed.tree, site, constants)).collect();
        self.list.push(Candidate {
            kind: number_of(rank, site.len()),
            familiar: site.len() == 1,
            specs: built.iter().map(|effect| effect.spec()).collect(),
            effects: (first..first + built.len()).collect(),
            declared: false,
        });
        self.effects.extend(built);
    }

    /// Leaves out what acts on none of these torques, unless it is in the model.
    fn restrict(&mut self, torques: &[usize], first: usize) {
        let effects = &self.effects;
        self.list.retain(|candidate| {
            candidate.effects[0] < first
                || effects[candidate.effects[0] - first]
                    .entries()
                    .iter()
                    .any(|entry| torques.contains(&entry.row))
        });
    }
}

/// Constants to try; those that belong to the joint are what another effect of the model says of it.
fn scan(
    catalogue: &Catalogue,
    kind: &dyn EffectKind,
    site: &[usize],
    ranges: &SignalRanges,
    present: &[EffectSpec],
    joints: &[String],
) -> Vec<Constants> {
    let known = known_of_the_site(catalogue, kind, present, joints);
    if known.is_empty() {
        return kind.scan(site, ranges);
    }
    let mut unique: Vec<Constants> = Vec::new();
    for mut constants in kind.scan(site, ranges) {
        // What belongs to the joint comes together: how a sign turns with how soon.
        if constants.keys().any(|name| known.contains_key(name)) {
            constants.extend(known.clone());
        }
        if !unique.contains(&constants) {
            unique.push(constants);
        }
    }
    unique
}

/// Constants that belong to the joints, as other effects of the model on them have them.
pub(super) fn known_of_the_site(
    catalogue: &Catalogue,
    kind: &dyn EffectKind,
    present: &[EffectSpec],
    joints: &[String],
) -> Constants {
    let mut known = Constants::new();
    for other in catalogue.kinds().filter(|other| other.name() != kind.name()) {
        let spec = present.iter().find(|spec| spec.kind == other.name() && spec.joints == joints);
        let Some(spec) = spec else { continue };
        let constants =
            spec.constants.iter().filter(|(name, _)| other.constants_of_the_site().contains(&name.as_str()));
        known.extend(constants.map(|(name, value)| (name.clone(), *value)));
    }
    known
}
