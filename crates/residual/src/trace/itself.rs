//! Whether an effect does what it has its name for, and not only bends what simpler ones make.

use super::search::Search;
use phiw_effects::FittedEffect;
use phiw_identification::IdentificationError;
use std::ops::Range;

impl Search<'_> {
    /// Whether the effect at `place`, as it is fitted, is what its name says beside those simpler ones of its
    /// joint of which it is a form ([`phiw_effects::EffectKind::is_itself_beside`]).
    pub(super) fn is_itself(&self, place: usize) -> Result<bool, IdentificationError> {
        let own = &self.specs[place];
        let kind = self.fixed.catalogue.kind(&own.kind)?;
        let simpler: Vec<usize> = (0..self.specs.len())
            .filter(|&other| {
                let other = &self.specs[other];
                other.joints == own.joints && kind.form_of().contains(&other.kind.as_str())
            })
            .collect();
        if simpler.is_empty() {
            return Ok(true);
        }
        let design = self.design()?;
        let infos: Vec<_> = design.effects().iter().map(|effect| effect.parameters()).collect();
        let fitted = |place: usize| {
            let Range { start, end } = design.effect_parameters(place);
            FittedEffect::new(&self.specs[place], &infos[place], &self.parameters[start..end])
        };
        let simpler: Vec<FittedEffect<'_>> = simpler.into_iter().map(fitted).collect();
        Ok(kind.is_itself_beside(&fitted(place), &simpler))
    }
}
