//! The members of a torque, chosen anew: where several stand for one that no single exchange leads to.

use super::problem::Member;
use super::screening::screen;
use super::search::{LEAST_STEP, Search};

/// First members that are tried on each torque.
const BEGINNINGS: usize = 3;

impl Search<'_> {
    /// For each torque to which two or more members were added beside what the textbook has: whether others
    /// in the place of all of them make the criterion smaller. Each of the best hypotheses begins once; what
    /// else acts on this torque then follows as in a forward step, and what is not needed is left out.
    pub(super) fn choose_anew(&mut self) -> bool {
        let mut better = false;
        for torque in 0..self.problem.torques.len() {
            let own: Vec<Member> = self
                .model
                .members
                .iter()
                .filter(|member| self.was_added_to(torque, member))
                .copied()
                .collect();
            if own.len() < 2 {
                continue;
            }
            let others: Vec<Member> =
                self.model.members.iter().filter(|member| !own.contains(member)).copied().collect();
            let mut without = self.clone();
            without.model = self.evaluate(others, &self.model.fit);
            if !without.model.settled {
                continue;
            }
            let open = without.open_on(torque);
            let mut screened = screen(self.problem, &without.model.fit, &self.rows, &open);
            screened.retain(|screened| own.iter().all(|own| own.hypothesis != screened.member.hypothesis));
            for beginning in screened.iter().take(BEGINNINGS) {
                if let Some(branch) = without.begun_with(beginning.member, torque, own.len())
                    && branch.model.value < self.model.value - LEAST_STEP
                {
                    self.model = branch.model;
                    better = true;
                }
            }
        }
        better
    }

    /// Whether a member acts on this torque alone and neither is declared nor belongs to the textbook.
    fn was_added_to(&self, torque: usize, member: &Member) -> bool {
        let hypothesis = &self.problem.hypotheses[member.hypothesis];
        hypothesis.torques == [torque] && !hypothesis.declared && !hypothesis.textbook
    }

    fn open_on(&self, torque: usize) -> Vec<usize> {
        let mut open = self.open();
        open.retain(|&hypothesis| self.problem.hypotheses[hypothesis].torques.contains(&torque));
        open
    }

    /// The search after `beginning` and at most as many more as there were have entered.
    fn begun_with(&self, beginning: Member, torque: usize, most: usize) -> Option<Self> {
        let mut branch = self.clone();
        let members = branch.model.members.iter().copied().chain([beginning]).collect();
        let entered = branch.ranked(vec![(members, ())], &branch.model.fit, usize::MAX).into_iter().next();
        branch.model = entered.map(|(model, ())| model).filter(|model| model.settled)?;
        for _ in 1..most {
            let open = branch.open_on(torque);
            if !branch.forward_among(open) {
                break;
            }
        }
        while branch.prune() {}
        Some(branch)
    }
}
