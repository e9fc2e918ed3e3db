//! Kinds of effects on given joints: what is declared, and what is excluded.

use crate::{Catalogue, Constants, EffectKind, SignalRanges};
use phiw_dynamics::Tree;
use phiw_identification::effect::{EffectError, EffectSelector};
use phiw_identification::{EffectSpec, Variants};

/// Edits that a name may be away from a known one to be taken for a slip of it; half its letters at most.
const MOST_EDITS: usize = 5;

/// Joints, or groups of joints, by their places in the tree.
type Sites = Vec<Vec<usize>>;

impl Catalogue {
    /// The effects of `KIND[:JOINT[+JOINT…]]` on a robot, each with the constants that the data may choose
    /// from.
    ///
    /// `KIND` alone is declared wherever it can act. If the joints together are what the kind acts on, it is
    /// declared on them together (`transmission_coupling:a+b`), else on each by itself.
    ///
    /// # Errors
    /// The kind or a joint is unknown, or the kind cannot act there.
    pub fn declare(
        &self,
        declared: &str,
        tree: &Tree,
        ranges: &SignalRanges,
    ) -> Result<Vec<Variants>, EffectError> {
        let selector = EffectSelector::read(declared);
        let kind = self.kind(&selector.kind)?;
        let fixed = kind.declared_constants().unwrap_or_default();
        let is_open = |constants: &Constants| {
            fixed.iter().all(|(name, value)| constants.get(name).is_none_or(|other| other == value))
        };
        let variants = |site: Vec<usize>| -> Variants {
            let mut scanned = kind.scan(&site, ranges);
            scanned.retain(is_open);
            if scanned.is_empty() {
                // The logs show nothing to choose from: the kind's defaults.
                scanned.push(fixed.clone());
            }
            scanned.iter().map(|constants| kind.build(tree, &site, constants)).collect()
        };
        Ok(declared_sites(kind, &selector, tree)?.into_iter().map(variants).collect())
    }

    /// Whether these ranges show constants to choose from wherever this is declared; what cannot be declared
    /// needs none.
    pub fn is_scanned(&self, declared: &str, tree: &Tree, ranges: &SignalRanges) -> bool {
        let selector = EffectSelector::read(declared);
        let Ok(kind) = self.kind(&selector.kind) else { return true };
        let sites = declared_sites(kind, &selector, tree).unwrap_or_default();
        sites.iter().all(|site| !kind.scan(site, ranges).is_empty())
    }

    /// A kind that can be declared, by its name.
    ///
    /// # Errors
    /// There is none of that name, or it is only ever found.
    pub fn declarable(&self, name: &str) -> Result<&dyn EffectKind, EffectError> {
        let kind = self.kind(name)?;
        if kind.is_of_training_logs() {
            return Err(EffectError::NotDeclared { kind: name.to_owned() });
        }
        Ok(kind)
    }

    /// Declarations in the syntax of [`declare`](Self::declare), each kind's united and its joints in the
    /// order of the robot; empty ones and `rigid_body`, which is always there, are left out.
    ///
    /// # Errors
    /// A kind or a joint is unknown, or a kind cannot act where it is declared, or not be declared.
    pub fn united(&self, declared: &[String], tree: &Tree) -> Result<Vec<String>, EffectError> {
        let mut united: Vec<(&dyn EffectKind, Sites)> = Vec::new();
        let texts = declared.iter().map(|text| text.trim());
        for text in texts.filter(|text| !text.is_empty() && *text != "rigid_body") {
            let selector = EffectSelector::read(text);
            let kind = self.declarable(&selector.kind)?;
            let sites = declared_sites(kind, &selector, tree)?;
            match united.iter_mut().find(|(other, _)| other.name() == kind.name()) {
                Some((_, own)) => own.extend(sites),
                None => united.push((kind, sites)),
            }
        }
        let written = |(kind, chosen): (&dyn EffectKind, Sites)| written(kind, &chosen, tree);
        Ok(united.into_iter().flat_map(written).collect())
    }

    /// The effects that `KIND[:JOINT[+JOINT…]]` takes out of the candidates: the kind wherever it can act, on
    /// the joints together if they are what it acts on, else wherever it acts on one of them.
    ///
    /// # Errors
    /// The kind or a joint is unknown, or the kind cannot act there.
    pub fn excluded(&self, text: &str, tree: &Tree) -> Result<Vec<EffectSpec>, EffectError> {
        let selector = EffectSelector::read(text);
        let kind = self.kind(&selector.kind)?;
        let sites = match &selector.joints {
            None => kind.sites(tree),
            Some(joints) => {
                let named = joint_indices(kind.name(), joints, tree)?;
                let sites = kind.sites(tree);
                let touched = |site: &Vec<usize>| site.iter().any(|joint| named.contains(joint));
                let untouched = |joint: &usize| !sites.iter().any(|site| site.contains(joint));
                match together(&sites, &named) {
                    Some(site) => vec![site],
                    None if named.iter().any(untouched) => return Err(cannot_act(kind, tree, joints)),
                    None => sites.into_iter().filter(touched).collect(),
                }
            }
        };
        if sites.is_empty() {
            return Err(cannot_act(kind, tree, &[]));
        }
        let spec = |site: Vec<usize>| EffectSpec {
            kind: kind.name().to_owned(),
            joints: names(&site, tree),
            constants: Constants::new(),
        };
        Ok(sites.into_iter().map(spec).collect())
    }
}

/// Where a kind is declared, in the order of its sites.
fn declared_sites(
    kind: &dyn EffectKind,
    selector: &EffectSelector,
    tree: &Tree,
) -> Result<Sites, EffectError> {
    let Some(joints) = &selector.joints else {
        let sites = own_sites(kind, tree);
        return if sites.is_empty() { Err(cannot_act(kind, tree, &[])) } else { Ok(sites) };
    };
    let named = joint_indices(kind.name(), joints, tree)?;
    let sites = kind.sites(tree);
    if let Some(site) = together(&sites, &named) {
        return Ok(vec![site]);
    }
    let single = |joint: &usize| sites.iter().any(|site| site == &[*joint]);
    match named.iter().all(single) && !named.is_empty() {
        true => Ok(sites
            .into_iter()
            .filter(|site| matches!(site[..], [joint] if named.contains(&joint)))
            .collect()),
        false => Err(cannot_act(kind, tree, joints)),
    }
}

/// The sites of a kind, but those on whose joints it can act one by one as well.
fn own_sites(kind: &dyn EffectKind, tree: &Tree) -> Sites {
    let mut sites = kind.sites(tree);
    let single: Vec<usize> = sites.iter().filter(|site| site.len() == 1).map(|site| site[0]).collect();
    sites.retain(|site| site.len() < 2 || !site.iter().all(|joint| single.contains(joint)));
    sites
}

/// The site of several joints that is these joints, in any order.
fn together(sites: &Sites, named: &[usize]) -> Option<Vec<usize>> {
    let is_these = |site: &&Vec<usize>| {
        site.len() > 1 && site.len() == named.len() && site.iter().all(|joint| named.contains(joint))
    };
    sites.iter().find(is_these).cloned()
}

/// A kind's declarations: one for all of its single joints, one for each group.
fn written(kind: &dyn EffectKind, chosen: &Sites, tree: &Tree) -> Vec<String> {
    let text = |site: &[usize]| {
        let joints = (!site.is_empty()).then(|| names(site, tree));
        EffectSelector { kind: kind.name().to_owned(), joints }.to_string()
    };
    let own = own_sites(kind, tree);
    let (whole, rest): (Sites, Sites) = match own.iter().all(|site| chosen.contains(site)) {
        true => (vec![Vec::new()], kind.sites(tree).into_iter().filter(|site| !own.contains(site)).collect()),
        false => (Vec::new(), kind.sites(tree)),
    };
    let rest: Sites = rest.into_iter().filter(|site| chosen.contains(site)).collect();
    let (single, groups): (Sites, Sites) = rest.into_iter().partition(|site| site.len() == 1);
    let single = if single.is_empty() { Vec::new() } else { vec![single.concat()] };
    [whole, single, groups].concat().iter().map(|site| text(site)).collect()
}

/// The places of joints in the tree, each once.
pub(crate) fn joint_indices(kind: &str, joints: &[String], tree: &Tree) -> Result<Vec<usize>, EffectError> {
    let mut indices = Vec::new();
    for joint in joints {
        let Some(index) = tree.joint_index(joint) else {
            let known: Vec<String> = tree.joint_names().map(str::to_owned).collect();
            let nearest = nearest(joint, &known);
            return Err(EffectError::UnknownJoint {
                kind: kind.to_owned(),
                joint: joint.clone(),
                nearest,
                known,
            });
        };
        if !indices.contains(&index) {
            indices.push(index);
        }
    }
    Ok(indices)
}

/// The error of a kind that cannot act on these joints.
pub(crate) fn cannot_act(kind: &dyn EffectKind, tree: &Tree, joints: &[String]) -> EffectError {
    EffectError::CannotActThere {
        kind: kind.name().to_owned(),
        needed: kind.acts_on(),
        joints: joints.to_vec(),
        sites: kind.sites(tree).iter().map(|site| names(site, tree)).collect(),
    }
}

/// The known name that is most like `name`, if it can be a slip of it.
pub(crate) fn nearest(name: &str, known: &[String]) -> Option<String> {
    let distance = |other: &&String| strsim::damerau_levenshtein(other, name);
    let most = MOST_EDITS.min(name.chars().count().div_ceil(2));
    known.iter().min_by_key(distance).filter(|other| distance(other) <= most).cloned()
}

fn names(site: &[usize], tree: &Tree) -> Vec<String> {
    site.iter().map(|&joint| tree.joint(joint).joint.clone()).collect()
}
