//! Forms of something simpler that do not do what they have their name for, and only bend what that makes.

use super::search::Search;
use phiw_effects::FittedEffect;
use phiw_identification::IdentificationError;

impl Search<'_> {
    /// Kinds and joints of the effects that, as they are fitted, are not what their name says beside those
    /// simpler ones of their joint of which they are forms
    /// ([`phiw_effects::EffectKind::is_itself_beside`]).
    pub(super) fn bent(&self) -> Result<Vec<(String, Vec<String>)>, IdentificationError> {
        let design = self.design()?;
        let infos: Vec<_> = design.effects().iter().map(|effect| effect.parameters()).collect();
        let fitted = |place: usize| {
            let values = &self.parameters[design.effect_parameters(place)];
            FittedEffect::new(&self.specs[place], &infos[place], values)
        };
        let mut bent = Vec::new();
        for (place, own) in self.specs.iter().enumerate() {
            let kind = self.fixed.catalogue.kind(&own.kind)?;
            let is_simpler = |other: &usize| {
                let other = &self.specs[*other];
                other.joints == own.joints && kind.form_of().contains(&other.kind.as_str())
            };
            let simpler: Vec<_> = (0..self.specs.len()).filter(is_simpler).map(fitted).collect();
            if !kind.is_itself_beside(&fitted(place), &simpler) {
                bent.push((own.kind.clone(), own.joints.clone()));
            }
        }
        Ok(bent)
    }
}
