//! Where the search starts. Its end is the best of those that several starts lead to.

use super::search::Search;
use super::tracing::Tracing;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// The search from where it starts to its end, or to a better one from another start.
    ///
    /// - Where the torques agree better once one of them is a multiple of what is logged, and still do in the
    ///   end, a start has that in force: to first order a factor of two is no factor, and other effects would
    ///   stand for it.
    /// - Where anything was found, a start has what the textbook has of every joint, declared by nobody. What is
    ///   chosen early, beside all that is still missing, may stand for something else to the end; the more is
    ///   there at the start, the less can be taken for it. It has the limits of drives, too, beyond which the
    ///   command was logged (`limits.rs`).
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
        if is_found
            && let Some(other) = self.searched_from_the_textbook()?
            && other.is_better_than(&best)?
        {
            best = other;
        }
        best.finish()
    }

    /// Whether the criterion is smaller here than there, with the effective rows of that end.
    fn is_better_than(&self, other: &Self) -> Result<bool, IdentificationError> {
        let rows = &other.chosen.rows;
        Ok(self.value(rows)? < other.value(rows)?)
    }

    /// The end from the start that has what the textbook has of every joint, declared by nobody, with what
    /// was declared put into it only then: so the end hardly depends on what was declared. `None` for a held
    /// model, and where that is the start of all.
    fn searched_from_the_textbook(&self) -> Result<Option<Self>, IdentificationError> {
        if self.fixed.prior.is_some() {
            return Ok(None);
        }
        let more = self.textbook_of_other_joints()?;
        let mut search = self.clone();
        search.declared = 0;
        search.chosen.alternatives = vec![Vec::new(); search.specs.len()];
        for spec in more {
            search.add(spec)?;
        }
        search.add_limits()?;
        if search.specs.len() == self.specs.len() && self.declared == 0 {
            return Ok(None);
        }
        let mut end = search.searched()?;
        if self.declared > 0 {
            end.put_in_front(&self.specs[..self.declared])?;
            end = end.searched()?;
        }
        Ok(Some(end))
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
