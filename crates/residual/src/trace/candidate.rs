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
            for constants in scan(catalogue, kind, &site, ranges, present, &joints) {
                all.push(rank, vec![kind.build(tree, &site, &constants)], constants.len());
            }
        }
    }
    add_pairs(catalogue, tree, ranges, present, &mut all);
    all
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
    let mut known = Constants::new();
    for other in catalogue.kinds().filter(|other| other.name() != kind.name()) {
        let spec = present.iter().find(|spec| spec.kind == other.name() && spec.joints == joints);
        let Some(spec) = spec else { continue };
        let constants =
            spec.constants.iter().filter(|(name, _)| other.constants_of_the_site().contains(&name.as_str()));
        known.extend(constants.map(|(name, value)| (name.clone(), *value)));
    }
    if known.is_empty() {
        return kind.scan(site, ranges);
    }
    let mut unique: Vec<Constants> = Vec::new();
    for mut constants in kind.scan(site, ranges) {
        for (name, value) in &mut constants {
            *value = known.get(name).copied().unwrap_or(*value);
        }
        if !unique.contains(&constants) {
            unique.push(constants);
        }
    }
    unique
}

/// Kinds that go together, where the model has none of them.
fn add_pairs(
    catalogue: &Catalogue,
    tree: &Tree,
    ranges: &SignalRanges,
    present: &[EffectSpec],
    all: &mut Candidates,
) {
    for (rank, kind) in catalogue.kinds().enumerate() {
        for partner in kind.goes_with().iter().filter_map(|name| catalogue.kind(name).ok()) {
            let is_either = |spec: &EffectSpec| [kind.name(), partner.name()].contains(&spec.kind.as_str());
            for site in kind.sites(tree) {
                let on_site = |spec: &EffectSpec| {
                    site.iter().any(|&joint| spec.joints.contains(&tree.joint(joint).joint))
                };
                if present.iter().any(|spec| is_either(spec) && on_site(spec)) {
                    continue;
                }
                for constants in kind.scan(&site, ranges) {
                    let alone = partner.build(tree, &site, &Constants::new());
                    all.push(rank, vec![alone, kind.build(tree, &site, &constants)], constants.len());
                }
            }
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

#[cfg(test)]
mod tests {
    use super::*;
    use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
    use phiw_effects::{JointRange, OwnTorque, ParameterKind};
    use phiw_identification::effect::Sample;

    /// A kind of two constants, of which one belongs to the joint.
    struct Rubbing;

    impl EffectKind for Rubbing {
        fn name(&self) -> &str {
            "rubbing"
        }
        fn scan(&self, _site: &[usize], _ranges: &SignalRanges) -> Vec<Constants> {
            let constants = |own: f64| Constants::from([("width".into(), 0.1 * own), ("own".into(), own)]);
            vec![constants(1.0), constants(2.0)]
        }
        fn constants_of_the_site(&self) -> &'static [&'static str] {
            &["width"]
        }
        fn telling_motion(&self) -> &'static str {
            "any"
        }
        fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
            one_column("rubbing", tree, site[0], constants)
        }
    }

    /// A kind that is tried together with the other, and has only the constant that belongs to the joint.
    struct Grinding;

    impl EffectKind for Grinding {
        fn name(&self) -> &str {
            "grinding"
        }
        fn scan(&self, _site: &[usize], _ranges: &SignalRanges) -> Vec<Constants> {
            [0.1, 0.2].map(|width| Constants::from([("width".into(), width)])).to_vec()
        }
        fn goes_with(&self) -> &'static [&'static str] {
            &["rubbing", "a kind that the catalogue lacks"]
        }
        fn telling_motion(&self) -> &'static str {
            "any"
        }
        fn build(&self, tree: &Tree, site: &[usize], constants: &Constants) -> Box<dyn Effect> {
            one_column("grinding", tree, site[0], constants)
        }
    }

    fn one_column(kind: &str, tree: &Tree, joint: usize, constants: &Constants) -> Box<dyn Effect> {
        let column = move |sample: &Sample<'_>, out: &mut [f64]| out[0] = sample.qd()[joint];
        let parameters = [("k", ParameterKind::Torque, 0.0)];
        Box::new(OwnTorque::new(kind, tree, joint, constants, &parameters, column))
    }

    /// Candidates with a rubbing or a grinding part beside `present`, each as the kinds and constants of its
    /// effects.
    fn candidates(present: &[EffectSpec]) -> Vec<Vec<(String, Vec<f64>)>> {
        let urdf = r#"<robot name="arm"><link name="base"/><link name="arm"/>
            <joint name="pivot" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>"#;
        let tree = read_urdf(urdf, &UrdfOptions::default()).unwrap().tree;
        let joint = JointRange { position: (-1.0, 1.0), velocity_rms: 1.0, ..JointRange::default() };
        let ranges = SignalRanges {
            joints: vec![joint],
            session: (0.0, 10.0),
            ripple_frequencies: vec![vec![]],
            ..SignalRanges::default()
        };
        let catalogue = Catalogue::default().with(Rubbing).with(Grinding);
        let occupied = Occupied { present, closed: &[], held: false };
        let all = enumerate(&catalogue, &tree, &ranges, &occupied);
        let parts = |candidate: Candidate| {
            let part = |spec: EffectSpec| (spec.kind, spec.constants.into_values().collect::<Vec<f64>>());
            candidate.specs.into_iter().map(part).collect::<Vec<_>>()
        };
        let ours = |parts: &Vec<(String, Vec<f64>)>| {
            parts.iter().any(|(kind, _)| kind == "rubbing" || kind == "grinding")
        };
        all.list.into_iter().map(parts).filter(ours).collect()
    }

    /// The parts of a candidate by kind and constants, in the order of the constants' names.
    fn parts(expected: &[(&str, &[f64])]) -> Vec<(String, Vec<f64>)> {
        expected.iter().map(|(kind, constants)| ((*kind).to_owned(), constants.to_vec())).collect()
    }

    #[test]
    fn kinds_that_go_together_are_tried_alone_and_together() {
        let expected = vec![
            parts(&[("rubbing", &[1.0, 0.1])]),
            parts(&[("rubbing", &[2.0, 0.2])]),
            parts(&[("grinding", &[0.1])]),
            parts(&[("grinding", &[0.2])]),
            parts(&[("rubbing", &[]), ("grinding", &[0.1])]),
            parts(&[("rubbing", &[]), ("grinding", &[0.2])]),
        ];
        assert_eq!(candidates(&[]), expected);
    }

    #[test]
    fn a_constant_of_the_joint_is_taken_of_the_effect_that_the_model_has() {
        let declared = EffectSpec::new("rubbing", &["pivot"]).with("width", 0.7).with("own", 3.0);
        assert_eq!(candidates(&[declared]), vec![parts(&[("grinding", &[0.7])])]);
        // Grinding says nothing of the joint: rubbing keeps its own constants.
        let declared = EffectSpec::new("grinding", &["pivot"]).with("width", 0.7);
        let expected = vec![parts(&[("rubbing", &[1.0, 0.1])]), parts(&[("rubbing", &[2.0, 0.2])])];
        assert_eq!(candidates(&[declared]), expected);
    }
}
