//! Kinds that make the size of others vary: sought once all that is simpler has been.

use super::search::Search;
use phiw_identification::IdentificationError;

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

    /// Whether the model has anything that such a kind makes vary, and may grow.
    pub(super) fn may_vary(&self) -> bool {
        let is_in_model = |kind: &str| self.specs.iter().any(|spec| spec.kind == kind);
        self.grows && self.fixed.catalogue.kinds().filter_map(|kind| kind.varies()).any(is_in_model)
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
