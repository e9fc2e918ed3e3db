//! One member with other constants in the place of two on the same torque.

use super::fit::Fit;
use super::problem::Member;
use super::screening::screen;
use super::search::Search;

impl Search<'_> {
    /// Whether what the textbook has does the work of another effect on its torque, too, with other
    /// constants, and takes the place of both: a friction that turned over the wrong speed had one of the
    /// load beside it, whose own speed was right, and neither could leave alone.
    pub(super) fn one_for_two(&mut self) -> bool {
        let members = &self.model.members;
        let own_torque = |member: &Member| self.problem.hypotheses[member.hypothesis].torques.as_slice();
        let is_bent = |member: &&Member| {
            let own = &self.problem.hypotheses[member.hypothesis];
            own.textbook && own.variants.len() > 1 && own.torques.len() == 1
        };
        let mut pairs: Vec<[Member; 2]> = Vec::new();
        for stays in members.iter().filter(is_bent) {
            let leaves = |other: &&Member| {
                *other != stays
                    && own_torque(other) == own_torque(stays)
                    && !self.is_declared(other)
                    && !self.is_required(other)
            };
            pairs.extend(members.iter().filter(leaves).map(|leaves| [*stays, *leaves]));
        }
        let with_one = |pair: [Member; 2]| {
            let mut others: Vec<Member> =
                members.iter().filter(|member| !pair.contains(member)).copied().collect();
            let active = self.problem.active(&others);
            let without = Fit::beside(self.problem, active, &self.rows, &self.model.fit);
            let best = screen(self.problem, &without, &self.rows, &[pair[0].hypothesis]).first()?.member;
            others.push(best);
            (best != pair[0]).then_some((others, ()))
        };
        let moves = pairs.into_iter().filter_map(with_one).collect();
        let models = self.ranked(moves, &self.model.fit, usize::MAX).into_iter();
        let best = models.map(|(model, ())| model).find(|model| model.settled);
        match best.filter(|best| best.value < self.model.value) {
            Some(best) => {
                self.model = best;
                true
            }
            None => false,
        }
    }
}
