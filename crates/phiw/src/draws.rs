//! Would other training motion have led to other names? All of it again on bootstrap draws of the training
//! motion (Efron 1979).

use crate::Error;
use phiw_identification::{Data, EffectSpec};
use phiw_report::json::{DrawsJson, NamedInDrawsJson};
use phiw_residual::trace::{LEAST_RIVAL, RivalEffect, Tracing};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What was named on each draw.
pub struct Draws {
    /// For each draw the effects that were named.
    named: Vec<Vec<EffectSpec>>,
}

impl Draws {
    /// Names the effects again on `count` draws, each of as many training folds as there are, with
    /// replacement.
    ///
    /// # Errors
    /// Those of `name`, which identifies and traces on other data.
    pub fn take(
        count: u32,
        data: &Data<'_>,
        mut name: impl FnMut(&Data<'_>) -> Result<Vec<EffectSpec>, Error>,
    ) -> Result<Self, Error> {
        let mut random = ChaCha8Rng::seed_from_u64(0);
        let mut named = Vec::new();
        for _ in 0..count {
            let drawn = Data {
                train: data
                    .train
                    .iter()
                    .map(|_| data.train[random.random_range(0..data.train.len())])
                    .collect(),
                held_out: data.held_out.clone(),
                sources: data.sources.clone(),
                rest_speeds: data.rest_speeds.clone(),
            };
            named.push(name(&drawn)?);
        }
        Ok(Draws { named })
    }

    /// Each effect's stability becomes the share of draws in which it is named; what is named where it is not
    /// becomes its rival.
    pub fn weigh(&self, tracing: &mut Tracing) {
        if self.named.is_empty() {
            return;
        }
        let found: Vec<EffectSpec> = tracing.effects.iter().map(|effect| effect.spec.clone()).collect();
        let is_found = |spec: &EffectSpec| found.iter().any(|found| is_same(found, spec));
        for effect in &mut tracing.effects {
            effect.stability = self.share(&effect.spec, |_| true);
            let without = |names: &[EffectSpec]| !names.iter().any(|name| is_same(name, &effect.spec));
            for other in self.all() {
                let share = self.share(&other, without);
                let is_known = effect.rivals.iter().any(|rival| is_same(&rival.spec, &other));
                if !is_found(&other) && !is_known && share >= LEAST_RIVAL {
                    effect.rivals.push(RivalEffect { spec: other, confidence: share });
                }
            }
        }
    }

    /// How often each name came up, the most frequent first.
    pub fn json(&self) -> Option<DrawsJson> {
        let mut named: Vec<NamedInDrawsJson> = self
            .all()
            .into_iter()
            .map(|spec| {
                let draws =
                    self.named.iter().filter(|names| names.iter().any(|name| is_same(name, &spec))).count();
                NamedInDrawsJson { kind: spec.kind, joints: spec.joints, draws }
            })
            .collect();
        named.sort_by_key(|named| std::cmp::Reverse(named.draws));
        (!self.named.is_empty()).then_some(DrawsJson { count: self.named.len(), named })
    }

    /// Share of the draws that name `spec` and of whose names `also` is true.
    fn share(&self, spec: &EffectSpec, also: impl Fn(&[EffectSpec]) -> bool) -> f64 {
        let counts = |names: &&Vec<EffectSpec>| names.iter().any(|name| is_same(name, spec)) && also(names);
        self.named.iter().filter(counts).count() as f64 / self.named.len() as f64
    }

    /// Every name once, in the order in which they came up.
    fn all(&self) -> Vec<EffectSpec> {
        let mut all: Vec<EffectSpec> = Vec::new();
        for name in self.named.iter().flatten() {
            if !all.iter().any(|other| is_same(other, name)) {
                all.push(name.clone());
            }
        }
        all
    }
}

/// The same kind on the same joints, whatever the constants.
fn is_same(a: &EffectSpec, b: &EffectSpec) -> bool {
    a.kind == b.kind && a.joints == b.joints
}

#[cfg(test)]
mod tests {
    use super::Draws;
    use phiw_identification::EffectSpec;

    #[test]
    fn names_are_counted_once_a_draw() {
        let name = |kind: &str| EffectSpec::new(kind, &["elbow"]);
        let both = vec![name("joint_spring"), name("torque_offset")];
        let draws = Draws { named: vec![both, vec![name("joint_spring")], vec![]] };
        let json = draws.json().expect("there are draws");
        let counts: Vec<(&str, usize)> =
            json.named.iter().map(|named| (named.kind.as_str(), named.draws)).collect();
        assert_eq!((json.count, counts), (3, vec![("joint_spring", 2), ("torque_offset", 1)]));
        let without_spring = |names: &[EffectSpec]| !names.iter().any(|name| name.kind == "joint_spring");
        assert_eq!(draws.share(&name("torque_offset"), without_spring), 0.0);
    }
}
