//! Effects that could do each other's work: a spring and a balancer that cancel each other on a short arc are
//! both large by themselves, and together next to nothing.

use super::hypotheses::rank_of;
use super::naming::Judged;
use super::search::Search;
use super::trial::{Squares, Trial};
use crate::selection::{Hypothesis, Member};
use phiw_effects::EffectKind;

impl Search<'_> {
    /// Of effects that could do each other's work, and of which none has a name since none is missed beside
    /// the others, one has it: that which leaves least without these, where that is material.
    pub(super) fn judge_interchangeable(&self, trial: &Trial, judged: &mut [Judged]) {
        let initial = trial.foretold_squares(&trial.fit_with(|place| place < self.declared));
        let mut asked = vec![false; judged.len()];
        for index in 0..judged.len() {
            let Some(member) = trial.member(judged[index].place) else { continue };
            let others = self.interchangeable(trial, member);
            let is_of_group = |other: &Judged| {
                let of_other = trial.member(other.place);
                of_other.is_some_and(|other| other == member || others.contains(&other))
            };
            let group: Vec<usize> = (0..judged.len()).filter(|&other| is_of_group(&judged[other])).collect();
            if others.is_empty() || asked[index] || group.iter().any(|&other| judged[other].named) {
                continue;
            }
            group.iter().for_each(|&other| asked[other] = true);
            let is_of_group = |place: usize| group.iter().any(|&other| judged[other].place == place);
            let without = trial.foretold_squares(&trial.fit_with(|place| !is_of_group(place)));
            let may = |&&other: &&usize| judged[other].certain && self.may_have_a_name(judged[other].place);
            let alone = group.iter().filter(may).filter_map(|&other| {
                let place = judged[other].place;
                let fit = trial.fit_with(|other| other == place || !is_of_group(other));
                let with = trial.foretold_squares(&fit);
                Some((other, trial.member(place)?, trial.gain(&without, &with), with))
            });
            let Some((best, member, _, with)) = alone.max_by(|a, b| a.2.total_cmp(&b.2)) else { continue };
            let squares = Squares { initial: initial.clone(), without, with };
            let own = |torque: usize| trial.size_beside(member, &[], torque);
            let (seen, absorbed) = self.is_seen_or_absorbed(trial, member, &squares, own);
            judged[best].named = seen || absorbed;
        }
    }

    /// Other members that were found and could do some of a member's work: they act on the same torques and
    /// are of the same signal, and none of them is of the textbook or a form of another.
    pub(super) fn interchangeable(&self, trial: &Trial, member: Member) -> Vec<Member> {
        let signal = |hypothesis: &Hypothesis| {
            self.fixed.catalogue.kinds().nth(rank_of(hypothesis.kind)).map(EffectKind::seen_against)
        };
        let stands_alone = |member: &Member| {
            let hypothesis = &trial.problem.hypotheses[member.hypothesis];
            !hypothesis.declared && !hypothesis.textbook && hypothesis.requires.is_empty()
        };
        if !stands_alone(&member) {
            return Vec::new();
        }
        let own = &trial.problem.hypotheses[member.hypothesis];
        let is_alike = |other: &&Member| {
            let hypothesis = &trial.problem.hypotheses[other.hypothesis];
            **other != member && hypothesis.torques == own.torques && signal(hypothesis) == signal(own)
        };
        trial.members.iter().filter(|other| stands_alone(other)).filter(is_alike).copied().collect()
    }
}
