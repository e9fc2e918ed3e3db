//! Effects of several joints that do what frictions of each of them do.
//!
//! Where joints move one after the other, what turns with the sum of two speeds turns with the one or with
//! the other: a coupling is two frictions that turn over another speed. It may refine them, and takes no name
//! from them.

use super::search::Search;
use super::trial::Trial;
use crate::selection::Member;

impl Search<'_> {
    /// Whether an effect that was found acts on several torques and is not to be seen on any of them beyond
    /// what the textbook's effects of that torque could do.
    pub(super) fn leans_on_textbook(&self, trial: &Trial, member: Member) -> bool {
        let own = &trial.problem.hypotheses[member.hypothesis];
        let stands_alone = !own.declared && !own.textbook && own.requires.is_empty();
        let least = self.options.thresholds.least_visible.powi(2);
        let is_done_by_others = |&torque: &usize| {
            let rows = trial.torque(torque);
            let others: Vec<Member> = trial
                .members
                .iter()
                .filter(|other| trial.is_of_textbook(**other, &[torque]))
                .copied()
                .collect();
            !others.is_empty() && trial.size_beside(member, &others, torque) < least * rows.right_hand_side()
        };
        stands_alone && own.torques.len() > 1 && own.torques.iter().all(is_done_by_others)
    }

    /// Whether an effect is one of the textbook's on which another leans.
    pub(super) fn is_leaned_on(&self, trial: &Trial, member: Member) -> bool {
        let leans = |other: &&Member| {
            let torques = &trial.problem.hypotheses[other.hypothesis].torques;
            trial.is_of_textbook(member, torques) && self.leans_on_textbook(trial, **other)
        };
        trial.members.iter().any(|other| leans(&other))
    }
}
