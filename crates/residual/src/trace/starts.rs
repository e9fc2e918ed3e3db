//! Where the search starts, whatever was declared, and how what was declared joins its end.

use super::harm::Harm;
use super::search::Search;
use super::tracing::Tracing;
use crate::selection::LEAST_STEP;
use phiw_identification::{EffectSpec, IdentificationError};

impl Search<'_> {
    /// The search from where it starts to its end.
    ///
    /// - Where the declared model lacks anything, the start has what the textbook has of every joint,
    ///   declared by nobody, and nothing of what was declared. What is chosen early, beside all that is still
    ///   missing, may stand for something else to the end; the more is there at the start, the less can be
    ///   taken for it. And the end is the same whatever was declared: that joins it afterwards, once what
    ///   does harm has left.
    /// - That start has the limits of drives beyond which a command was logged (`limits.rs`).
    /// - Where the torques agree better once one of them is a multiple of what is logged, and still do in the
    ///   end, another start has that in force, too: to first order a factor of two is no factor, and other
    ///   effects would stand for it.
    /// - Where the end leaves structure, it is searched again from there, with nothing refuted any more: what
    ///   was refuted beside all that was still missing may be right beside what was found since.
    /// - Where that leaves structure, too, another search from the same start seeks what makes frictions vary
    ///   at once (`variation.rs`): many effects together had stood for that, and left it no work. Whether
    ///   there is structure is asked of all logs, which end is the better one of the training logs alone,
    ///   unless it leaves more of the motion held out.
    pub(super) fn run(self) -> Result<Tracing, IdentificationError> {
        let start = if self.fixed.prior.is_none() { self.textbook_start()? } else { None };
        let end_of = |search: Self| match &start {
            Some(_) => self.with_declared(search.searched()?),
            None => search.searched(),
        };
        let beginning = start.as_ref().unwrap_or(&self);
        let mut best = end_of(beginning.clone())?;
        if let Some(with_multiples) = beginning.with_multiples()?
            && best.still_asks_for(&with_multiples.specs[beginning.specs.len()..])?
        {
            let other = end_of(with_multiples)?;
            if other.is_better_than(&best)? {
                best = other;
            }
        }
        let mut tracing = best.clone().finish()?;
        if tracing.remaining.joints.is_empty() {
            return Ok(tracing);
        }
        let mut again = Search { refuted: Vec::new(), ..best.clone() }.searched()?;
        again.forget_what_came_back();
        (best, tracing) = best.or_better((tracing, again))?;
        if tracing.remaining.joints.is_empty() || !beginning.may_vary() {
            return Ok(tracing);
        }
        let varying = end_of(Search { asks_of_variation: true, ..beginning.clone() })?;
        Ok(best.or_better((tracing, varying))?.1)
    }

    /// This end and what came of it, or another and what comes of that, where the training logs say that it
    /// is better and motion held out is no worse ([`super::Thresholds::same_error`]).
    fn or_better(self, (tracing, other): (Tracing, Self)) -> Result<(Self, Tracing), IdentificationError> {
        if !other.is_better_than(&self)? {
            return Ok((self, tracing));
        }
        let of_other = other.clone().finish()?;
        let [own, before] = [&of_other, &tracing].map(|end| self.counted(&end.model.held_out));
        Ok(if own <= before * self.options.thresholds.same_error {
            (other, of_other)
        } else {
            // Motion held out had its say here, too.
            (self, Tracing { held_out_had_a_say: true, ..tracing })
        })
    }

    /// The start that has what the textbook has of every joint and limits of drives, all of it declared by
    /// nobody; `None` where nothing is lacking in what is declared and no command was beyond a limit.
    fn textbook_start(&self) -> Result<Option<Self>, IdentificationError> {
        let mut start = self.clone();
        (start.specs, start.declared) = (Vec::new(), 0);
        start.parameters = vec![0.0; self.fixed.base.count()];
        for spec in start.textbook_of_other_joints()? {
            start.add(spec)?;
        }
        start.refine()?;
        let has_limits = start.add_limits()?;
        Ok((has_limits || self.lacks_something()?).then_some(start))
    }

    /// Whether anything is to be added to what is declared.
    fn lacks_something(&self) -> Result<bool, IdentificationError> {
        let mut search = self.clone();
        search.refine()?;
        search.choose()?;
        Ok(search.specs.len() > search.declared)
    }

    /// An end that was reached with nothing declared, with what was declared put into it: what that does the
    /// work of leaves, and nothing enters. What does harm leaves before that: with what was declared beside
    /// it, another effect may look harmful in its place.
    fn with_declared(&self, mut end: Self) -> Result<Self, IdentificationError> {
        if self.declared > 0 {
            end.refine_together()?;
            end.without_harm(Harm::EachTorque)?;
            let found = end.specs.len();
            end.put_in_front(&self.specs[..self.declared])?;
            if end.specs.len() > found {
                end.grows = false;
                end = end.searched()?;
                end.grows = true;
            }
        }
        Ok(end)
    }

    /// Whether the criterion is smaller here than there, and the motion says so throughout, with the
    /// effective rows of that end: what does no more than chance could do leaves the end that was there.
    fn is_better_than(&self, other: &Self) -> Result<bool, IdentificationError> {
        let rows = &other.chosen.rows;
        let (own, other) = (self.judged(rows)?, other.judged(rows)?);
        let tail = own.tail_of_being_better(&other, rows);
        let is_smaller = own.value() < other.value() - LEAST_STEP;
        Ok(is_smaller && tail < self.options.thresholds.false_name_probability)
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
        self.forget_what_came_back();
        Ok(())
    }

    /// What had left for what it does to motion held out, and is in the model again, has not left.
    fn forget_what_came_back(&mut self) {
        let specs = &self.specs;
        self.left_out_by_held_out
            .retain(|out| !specs.iter().any(|own| own.kind == out.kind && own.joints == out.joints));
    }
}
