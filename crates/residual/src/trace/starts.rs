//! Where the search starts. Its end is the best of those that several starts lead to.

use super::search::Search;
use super::tracing::Tracing;
use phiw_identification::{EffectSpec, IdentificationError};

/// How much smaller the criterion is to be at the end from another start: of two ends that are about as good
/// the first is kept, and names do not change for what some constants do. Where joints moved one after the
/// other (`frictions_of_joints_that_move_in_turn_keep_their_names`) an end with a coupling that is not there
/// was better by 52; those of the KR300 differ by up to 600. Made of these two, and calibrated on nothing
/// else.
const ANOTHER_END_IS_WORTH: f64 = 100.0;

impl Search<'_> {
    /// The search from where it starts to its end, or to a better one from another start.
    ///
    /// - Where the torques agree better once one of them is a multiple of what is logged, and still do in the
    ///   end, a start has that in force: to first order a factor of two is no factor, and other effects would
    ///   stand for it.
    /// - Where anything was found, a start has what the textbook has of every joint, declared by nobody. What
    ///   is chosen early, beside all that is still missing, may stand for something else to the end; the more
    ///   is there at the start, the less can be taken for it.
    /// - That start has the limits of drives beyond which a command was logged (`limits.rs`); where there are
    ///   any, it is searched from in any case.
    pub(super) fn run(self) -> Result<Tracing, IdentificationError> {
        let mut best = self.clone().searched()?;
        if let Some(start) = self.with_multiples()?
            && best.still_asks_for(&start.specs[self.specs.len()..])?
        {
            let other = start.searched()?;
            if other.is_better_than(&best)? {
                best = other;
            }
        }
        let is_found = best.specs.len() > best.declared;
        if self.fixed.prior.is_none()
            && let Some(start) = self.with_the_textbook(is_found)?
        {
            let other = self.searched_from(start)?;
            if other.is_better_than(&best)? {
                best = other;
            }
        }
        best.finish()
    }

    /// Whether the criterion is clearly smaller here than there, with the effective rows of that end.
    fn is_better_than(&self, other: &Self) -> Result<bool, IdentificationError> {
        let rows = &other.chosen.rows;
        Ok(self.value(rows)? < other.value(rows)? - ANOTHER_END_IS_WORTH)
    }

    /// The start that has what the textbook has of every joint and limits of drives, all of it declared by
    /// nobody; `None` where that is the start of all, and without limits where it is not `asked` for.
    fn with_the_textbook(&self, asked: bool) -> Result<Option<Self>, IdentificationError> {
        let mut start = self.clone();
        start.declared = 0;
        start.chosen.alternatives = vec![Vec::new(); start.specs.len()];
        for spec in self.textbook_of_other_joints()? {
            start.add(spec)?;
        }
        let is_other = start.specs.len() > self.specs.len() || self.declared > 0;
        let has_limits = start.add_limits()?;
        Ok((has_limits || (asked && is_other)).then_some(start))
    }

    /// The end from a start that has declared nothing, with what was declared put into it only then: so the
    /// end hardly depends on what was declared.
    fn searched_from(&self, start: Self) -> Result<Self, IdentificationError> {
        let mut end = start.searched()?;
        if self.declared > 0 {
            end.put_in_front(&self.specs[..self.declared])?;
            end = end.searched()?;
        }
        Ok(end)
    }

    /// Counts effects as declared, and adds those that the model lacks.
    fn put_in_front(&mut self, declared: &[EffectSpec]) -> Result<(), IdentificationError> {
        let mut front = Vec::new();
        for spec in declared {
            let is_it = |own: &EffectSpec| own.kind == spec.kind && own.joints == spec.joints;
            front.push(match self.specs.iter().position(is_it) {
                Some(place) => place,
                None => {
                    self.add(spec.clone())?;
                    self.specs.len() - 1
                }
            });
        }
        let others = (0..self.specs.len()).filter(|place| !front.contains(place));
        let order: Vec<usize> = front.iter().copied().chain(others).collect();
        self.reorder(&order)?;
        self.chosen.alternatives.drain(..declared.len());
        self.declared = declared.len();
        Ok(())
    }
}
