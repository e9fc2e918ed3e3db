//! What a single training log cannot tell: how an effect is in the next.

use super::search::Search;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// Takes, where there is one training log, the constants that are the same within it and foretell motion
    /// held out better ([`super::Thresholds::same_error`]): a robot may have been cold again before that.
    /// Of all such effects at once, since it was one robot.
    pub(super) fn settle_between_logs(&mut self) -> Result<(), IdentificationError> {
        let train = &self.whole.train;
        if self.fixed.prior.is_some() || train.iter().any(|fold| fold.log != train[0].log) {
            return Ok(());
        }
        let mut branch = self.clone();
        let mut told: Vec<EffectSpec> = Vec::new();
        for spec in &mut branch.specs {
            let kind = self.fixed.catalogue.kind(&spec.kind)?;
            if let Some(constants) = kind.alike_within_one_log(&spec.constants, &self.input.ranges) {
                spec.constants = constants;
                told.push(spec.clone());
            }
        }
        if told.is_empty() {
            return Ok(());
        }
        let [own, other] = [&*self, &branch].map(Self::held_out_error_as_fitted);
        if branch.counted(&other?) * self.options.thresholds.same_error < self.counted(&own?) {
            branch.told_by_held_out = told;
            *self = branch;
        }
        Ok(())
    }
}
