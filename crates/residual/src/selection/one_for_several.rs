//! One member of a kind in the place of several of the same kind.

use super::fit::Fit;
use super::problem::Member;
use super::search::{LEAST_STEP, Search};
use std::collections::BTreeMap;

impl Search<'_> {
    /// Whether one of a kind does the work of all that the model has of it, and takes their place: where the
    /// other parameters take up what all joints have in common, a gain of one torque is the opposite gain of
    /// all others.
    pub(super) fn one_for_several(&mut self) -> bool {
        let mut kinds: BTreeMap<usize, Vec<Member>> = BTreeMap::new();
        for member in self.model.members.iter().filter(|member| !self.is_declared(member)) {
            let hypothesis = &self.problem.hypotheses[member.hypothesis];
            if hypothesis.familiar && !hypothesis.textbook && !self.is_required(member) {
                kinds.entry(hypothesis.kind).or_default().push(*member);
            }
        }
        let mut better = false;
        for (kind, group) in kinds.into_iter().filter(|(_, group)| group.len() > 1) {
            let others: Vec<Member> =
                self.model.members.iter().filter(|member| !group.contains(member)).copied().collect();
            let active = self.problem.active(&others);
            let without = Fit::beside(self.problem, active, &self.rows, &self.model.fit);
            let with = |member: Member| (others.iter().copied().chain([member]).collect(), ());
            let best = self
                .ranked(self.of_kind(kind).into_iter().map(with).collect(), &without, usize::MAX)
                .into_iter();
            if let Some((model, ())) = best.into_iter().find(|(model, ())| model.settled)
                && model.value < self.model.value - LEAST_STEP
            {
                self.model = model;
                better = true;
            }
        }
        better
    }

    /// What of a kind is not in the model, closed or not, where it is written in one way only: what is
    /// missing may show on torques that none of these acts on, and then a quick look sees nothing.
    pub(super) fn of_kind(&self, kind: usize) -> Vec<Member> {
        let own = |hypothesis: &usize| {
            let own = &self.problem.hypotheses[*hypothesis];
            own.kind == kind && own.variants.len() == 1 && !self.is_in(*hypothesis)
        };
        let hypotheses = (0..self.problem.hypotheses.len()).filter(own);
        hypotheses.map(|hypothesis| Member { hypothesis, variant: 0 }).collect()
    }
}
