//! What training logs have of their own, and the robot has not: sought last, beside all that the robot could
//! have.

use super::folds::{split, split_by_motion};
use super::search::Search;
use crate::selection::certainty;
use phiw_effects::EffectKind;
use phiw_identification::IdentificationError;

/// Parts of each log at least: what belongs to a log is told by one and foretold in another.
const PARTS_OF_LOG: usize = 2;

impl Search<'_> {
    /// Seeks it beside the model. Where nothing is certain and takes a share of what is left, the model stays
    /// as it was: that a log could have had something changes no answer.
    pub(super) fn ask_of_logs(&mut self) -> Result<(), IdentificationError> {
        if self.input.ranges.logs < 2 {
            return Ok(());
        }
        let folds = split_by_motion(self.fixed, split(&self.fixed.data.train, PARTS_OF_LOG))?;
        let mut asked = Search { asks_of_logs: true, folds, ..self.clone() };
        asked.choose()?;
        if asked.has_something_of_training_logs() {
            asked.settle()?;
            asked.leave_out_what_is_small_of_logs()?;
        }
        if asked.has_something_of_training_logs() {
            *self = asked;
        }
        Ok(())
    }

    fn has_something_of_training_logs(&self) -> bool {
        self.places_of_training_logs().next().is_some()
    }

    /// Whether an effect is one that training logs have of their own: motion held out says nothing of it.
    pub(super) fn is_of_training_logs(&self, place: usize) -> bool {
        self.fixed.catalogue.kind(&self.specs[place].kind).is_ok_and(EffectKind::is_of_training_logs)
    }

    fn places_of_training_logs(&self) -> impl Iterator<Item = usize> {
        (0..self.specs.len()).filter(|&place| self.is_of_training_logs(place))
    }

    fn leave_out_what_is_small_of_logs(&mut self) -> Result<(), IdentificationError> {
        if !self.has_something_of_training_logs() {
            return Ok(());
        }
        let trial = self.trial()?;
        let with = trial.foretold_squares(&trial.fit);
        let least_share = self.options.thresholds.least_share;
        let is_small = |&place: &usize| {
            let Some(member) = trial.member(place) else { return true };
            let without = trial.foretold_squares(&trial.fit_with(|other| other != place));
            let torques = &trial.problem.hypotheses[member.hypothesis].torques;
            let takes_share =
                |&torque: &usize| without[torque] - with[torque] >= least_share * without[torque];
            !torques.iter().any(takes_share)
                || certainty(&trial.problem, &trial.fit, member).tail > self.tail_of_a_name()
        };
        let small: Vec<usize> = self.places_of_training_logs().filter(is_small).collect();
        for place in small.into_iter().rev() {
            self.remove(place)?;
        }
        Ok(())
    }
}
