//! What is certain to be impossible leaves the model.

use super::search::Search;
use super::tracing::Withdrawn;
use phiw_identification::fitting::Fit;
use phiw_identification::{Design, EffectSpec, IdentificationError};

impl Search<'_> {
    /// The places, ascending, of the effects of which a parameter is certain to be beyond its bounds: its
    /// 95 % interval is. Constants that were refined since it was chosen may have led there, or a point of
    /// linearisation that has moved; or it was declared. Of declared effects none where these stay.
    pub(super) fn impossible(&self, design: &Design, fit: &Fit) -> Vec<(usize, Withdrawn)> {
        let first = if self.declared_stays { self.declared } else { 0 };
        let beyond = |place: usize| {
            let effect = &design.effects()[place];
            let mut own = design.effect_parameters(place).zip(effect.parameters());
            own.find_map(|(parameter, info)| {
                let interval_95 = fit.intervals_95[parameter];
                let (low, high) = info.bounds;
                (interval_95[1] < low || interval_95[0] > high).then(|| Withdrawn {
                    spec: self.specs[place].clone(),
                    name: info.name,
                    unit: info.unit,
                    interval_95,
                    bounds: info.bounds,
                    kept: false,
                })
            })
        };
        (first..self.specs.len()).filter_map(|place| Some((place, beyond(place)?))).collect()
    }

    /// Removes effects that are certain to be impossible, and remembers those that were declared.
    pub(super) fn remove_impossible(
        &mut self,
        impossible: Vec<(usize, Withdrawn)>,
    ) -> Result<(), IdentificationError> {
        for (place, withdrawn) in impossible.into_iter().rev() {
            if place < self.declared {
                self.withdrawn.push(withdrawn);
            }
            self.remove(place)?;
        }
        Ok(())
    }

    /// Takes out of the model what was declared and is certain to be impossible beside all that was found.
    /// Whether there was any.
    pub(super) fn withdraw(&mut self) -> Result<bool, IdentificationError> {
        if self.declared == 0 || self.declared_stays {
            return Ok(false);
        }
        let fitted = self.final_fit(false)?;
        let mut impossible = self.impossible(&fitted.design, &fitted.fit);
        impossible.retain(|(place, _)| *place < self.declared);
        let any = !impossible.is_empty();
        self.remove_impossible(impossible)?;
        if any {
            self.refine()?;
        }
        Ok(any)
    }

    /// Counts as declared again what left since it was impossible beside something else that was declared,
    /// and was found anew: it is nothing that nobody declared.
    pub(super) fn take_back(&mut self) -> Result<(), IdentificationError> {
        let back = came_back(&self.specs, self.declared, &self.withdrawn);
        if back.is_empty() {
            return Ok(());
        }
        let others = (self.declared..self.specs.len()).filter(|place| !back.contains(place));
        let order: Vec<usize> = (0..self.declared).chain(back.iter().copied()).chain(others).collect();
        self.reorder(&order)?;
        self.chosen.alternatives.drain(..back.len());
        self.declared += back.len();
        let declared = &self.specs[..self.declared];
        self.withdrawn.retain(|left| !declared.iter().any(|spec| is_of(spec, left)));
        Ok(())
    }
}

/// Whether an effect is the kind on the joints that left.
fn is_of(spec: &EffectSpec, left: &Withdrawn) -> bool {
    left.spec.kind == spec.kind && left.spec.joints == spec.joints
}

/// The places, among the effects from `declared` on, of those that had left.
fn came_back(specs: &[EffectSpec], declared: usize, withdrawn: &[Withdrawn]) -> Vec<usize> {
    (declared..specs.len()).filter(|&place| withdrawn.iter().any(|left| is_of(&specs[place], left))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A viscous friction that was declared, left with a rotor inertia, and was found again without it, had a
    /// name on a right model (`cargo xtask undeclared --case 2500028`).
    #[test]
    fn what_was_declared_and_comes_back_is_nothing_that_nobody_declared() {
        let viscous = |joint: &str| EffectSpec::new("viscous_friction", &[joint]);
        let left = |spec: EffectSpec| Withdrawn {
            spec: spec.with("sign_width", 0.01),
            name: "fv".to_owned(),
            unit: "N·m·s/rad".to_owned(),
            interval_95: [-4.2, -1.2],
            bounds: (0.0, f64::INFINITY),
            kept: false,
        };
        let withdrawn = [left(viscous("a")), left(EffectSpec::new("rotor_inertia", &["a"]))];
        let specs = [viscous("b"), EffectSpec::new("joint_spring", &["a"]), viscous("a"), viscous("c")];
        assert_eq!(came_back(&specs, 1, &withdrawn), [2]);
        assert_eq!(came_back(&specs, 3, &withdrawn), [0; 0]);
    }
}
