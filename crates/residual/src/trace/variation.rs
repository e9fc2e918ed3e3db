//! Kinds that make the size of others vary: sought once all that is simpler has been, and at once in another
//! search where that leaves structure (`starts.rs`).

use super::search::Search;
use phiw_effects::EffectKind;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// Seeks them beside the model, and chooses all anew where one was found: what had done its work badly
    /// leaves.
    pub(super) fn ask_of_variation(&mut self) -> Result<(), IdentificationError> {
        if !self.may_vary() {
            return Ok(());
        }
        // What is in the model stays as it is until one is found.
        let mut asked = Search { asks_of_variation: true, ..self.clone() };
        asked.choose_among(|kind| kind.varies().is_some())?;
        if asked.varies()? {
            asked.settle()?;
        }
        if asked.varies()? {
            *self = asked;
        }
        Ok(())
    }

    /// Whether the model has anything that such a kind may make vary, and may grow.
    pub(super) fn may_vary(&self) -> bool {
        let may_vary = |kind: &dyn EffectKind| {
            let is_excluded = |varied: &EffectSpec| {
                let mut excluded = self.options.excluded.iter();
                excluded.any(|own| own.kind == kind.name() && own.joints == varied.joints)
            };
            let mut varied = self.specs.iter().filter(|spec| Some(spec.kind.as_str()) == kind.varies());
            varied.any(|varied| !is_excluded(varied))
        };
        self.grows && self.fixed.catalogue.kinds().any(may_vary)
    }

    /// Whether an effect was found that makes the size of another vary.
    fn varies(&self) -> Result<bool, IdentificationError> {
        for spec in &self.specs[self.declared..] {
            if self.fixed.catalogue.kind(&spec.kind)?.varies().is_some() {
                return Ok(true);
            }
        }
        Ok(false)
    }
}
