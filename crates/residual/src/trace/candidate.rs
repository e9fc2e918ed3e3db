//! What could be missing: every kind, site and constant that the logs may be asked about.

use phiw_dynamics::Tree;
use phiw_effects::{Catalogue, Constants, EffectKind, SignalRanges};
use phiw_identification::{Effect, EffectSpec};
use std::ops::Range;

/// One hypothesis: an effect (or two that go together) on a site with fixed constants.
#[derive(Clone, Debug)]
pub(super) struct Candidate {
    /// The effects' specs, in the order of their columns.
    pub specs: Vec<EffectSpec>,
    /// Place of the kind in the catalogue: the simpler comes first.
    pub rank: usize,
    /// The effects' places among all effects of the design.
    pub effects: Range<usize>,
    /// Number of constants that were scanned, which count as parameters.
    pub constants: usize,
}

impl Candidate {
    /// Kind and joints, the same for all constants.
    pub fn hypothesis(&self) -> Vec<(&str, &[String])> {
        self.specs.iter().map(|spec| (spec.kind.as_str(), spec.joints.as_slice())).collect()
    }
}

/// All candidates, and their effects in the order that the candidates count them.
pub(super) struct Candidates {
    pub list: Vec<Candidate>,
    pub effects: Vec<Box<dyn Effect>>,
}

/// What is no candidate any more.
pub(super) struct Occupied<'a> {
    /// Effects in the model, declared or found.
    pub present: &'a [EffectSpec],
    /// Effects that were found, whether they are still in the model or not.
    pub closed: &'a [&'a EffectSpec],
    /// Whether the declared model is held: its effects may then have changed, if their kind may.
    pub held: bool,
}

/// Every hypothesis that is open.
pub(super) fn enumerate(
    catalogue: &Catalogue,
    tree: &Tree,
    ranges: &SignalRanges,
    occupied: &Occupied<'_>,
) -> Candidates {
    let present = occupied.present;
    let mut all = Candidates::none();
    for (rank, kind) in catalogue.kinds().enumerate() {
        if kind.needs_held_model() && !occupied.held {
            continue;
        }
        for site in kind.sites(tree) {
            let joints: Vec<String> = site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect();
            let is_this = |spec: &EffectSpec| spec.kind == kind.name() && spec.joints == joints;
            let changed = occupied.held && kind.may_change();
            if occupied.closed.iter().any(|spec| is_this(spec)) || (!changed && present.iter().any(is_this)) {
                continue;
            }
            for constants in scan(kind, &site, ranges, present, &joints) {
                all.push(rank, vec![kind.build(tree, &site, &constants)], constants.len());
            }
        }
    }
    add_pairs(catalogue, tree, ranges, present, &mut all);
    all
}

/// Constants to try; a sign's width is the one that the joint's declared friction has, where there is one.
fn scan(
    kind: &dyn EffectKind,
    site: &[usize],
    ranges: &SignalRanges,
    present: &[EffectSpec],
    joints: &[String],
) -> Vec<Constants> {
    const WIDTH: &str = "sign_width";
    let declared = present
        .iter()
        .find(|spec| spec.kind == "coulomb_friction" && spec.joints == joints)
        .and_then(|spec| spec.constants.get(WIDTH).copied());
    let mut scanned = kind.scan(site, ranges);
    let Some(width) = declared else { return scanned };
    if kind.name() != "coulomb_friction" {
        for constants in scanned.iter_mut().filter(|constants| constants.contains_key(WIDTH)) {
            constants.insert(WIDTH.to_owned(), width);
        }
        let mut unique: Vec<Constants> = Vec::new();
        scanned.into_iter().for_each(|constants| {
            if !unique.contains(&constants) {
                unique.push(constants);
            }
        });
        return unique;
    }
    scanned
}

/// Viscous and Coulomb friction of a joint go together: either alone mimics the other in part.
fn add_pairs(
    catalogue: &Catalogue,
    tree: &Tree,
    ranges: &SignalRanges,
    present: &[EffectSpec],
    all: &mut Candidates,
) {
    let (Ok(viscous), Ok(coulomb)) = (catalogue.kind("viscous_friction"), catalogue.kind("coulomb_friction"))
    else {
        return;
    };
    for site in coulomb.sites(tree) {
        let joint = &tree.joint(site[0]).joint;
        let is_friction =
            |spec: &EffectSpec| spec.kind == "viscous_friction" || spec.kind == "coulomb_friction";
        if present.iter().any(|spec| is_friction(spec) && spec.joints.contains(joint)) {
            continue;
        }
        for constants in coulomb.scan(&site, ranges) {
            let pair =
                vec![viscous.build(tree, &site, &Constants::new()), coulomb.build(tree, &site, &constants)];
            all.push(1, pair, constants.len());
        }
    }
}

impl Candidates {
    /// No hypothesis.
    pub fn none() -> Self {
        Candidates { list: Vec::new(), effects: Vec::new() }
    }

    /// Those that act on one of these torques.
    pub fn acting_on(self, torques: &[usize]) -> Self {
        let mut effects: Vec<Option<Box<dyn Effect>>> = self.effects.into_iter().map(Some).collect();
        let mut kept = Candidates::none();
        for candidate in self.list {
            let own: Vec<Box<dyn Effect>> =
                effects[candidate.effects].iter_mut().filter_map(Option::take).collect();
            if own.iter().flat_map(|effect| effect.entries()).any(|entry| torques.contains(&entry.row)) {
                kept.push(candidate.rank, own, candidate.constants);
            }
        }
        kept
    }

    fn push(&mut self, rank: usize, effects: Vec<Box<dyn Effect>>, constants: usize) {
        let first = self.effects.len();
        let specs = effects.iter().map(|effect| effect.spec()).collect();
        self.effects.extend(effects);
        self.list.push(Candidate { specs, rank, effects: first..self.effects.len(), constants });
    }
}
