//! What may be added in one step.

use super::criterion::{choices, price};
use super::fit::Fit;
use super::problem::Member;
use super::screening::{Beside, Screened, gain_of, most_of};
use super::search::Search;
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Hypotheses of a torque whose pairs are looked at.
const PAIRED: usize = 6;

impl Search<'_> {
    /// What may be added in one step: one hypothesis, two that act on one torque, and either on all torques
    /// where it says something.
    pub(super) fn moves(&self, screened: &[Screened]) -> Vec<Vec<Member>> {
        let now = choices(self.problem, &self.model.members);
        let worth = |added: &[Member], gain: f64| {
            let members: Vec<Member> = self.model.members.iter().chain(added).copied().collect();
            gain - (choices(self.problem, &members) - now)
        };
        let mut moves: Vec<(f64, Vec<Member>)> = Vec::new();
        let mut families: BTreeMap<Vec<usize>, (f64, Vec<Member>)> = BTreeMap::new();
        let mut join = |kinds: Vec<usize>, gain: f64, members: &[Member]| {
            let family = families.entry(kinds).or_default();
            family.0 += gain;
            for member in members {
                if !family.1.iter().any(|other| other.hypothesis == member.hypothesis) {
                    family.1.push(*member);
                }
            }
        };
        let of = |screened: &Screened| &self.problem.hypotheses[screened.member.hypothesis];
        for screened in screened {
            moves.push((worth(&[screened.member], screened.gain), vec![screened.member]));
            if of(screened).familiar {
                join(vec![of(screened).kind], screened.gain, &[screened.member]);
            }
        }
        for (gain, pair) in self.pairs(&self.model.fit, screened) {
            moves.push((worth(&pair, gain), pair.to_vec()));
            let kinds = pair.map(|member| self.problem.hypotheses[member.hypothesis].kind);
            join(kinds.to_vec(), gain, &pair);
        }
        moves.sort_by(|a, b| b.0.total_cmp(&a.0));
        moves.truncate(self.policy.finalists);
        let mut families: Vec<(f64, Vec<Member>)> = families
            .into_values()
            .filter(|(_, members)| members.len() > 1)
            .map(|(gain, members)| (worth(&members, gain), members))
            .collect();
        families.sort_by(|a, b| b.0.total_cmp(&a.0));
        families.truncate(self.policy.finalists);
        moves.into_iter().chain(families).map(|(_, members)| members).collect()
    }

    /// On each torque the best pair of each two kinds among the best few hypotheses, where the two say more
    /// than either.
    pub(super) fn pairs(&self, fit: &Fit, screened: &[Screened]) -> Vec<(f64, [Member; 2])> {
        let of_torque = |torque: usize| -> Vec<(f64, [Member; 2])> {
            let hypothesis = |screened: &&Screened| &self.problem.hypotheses[screened.member.hypothesis];
            let own = screened
                .iter()
                .filter(|screened| hypothesis(screened).torques == [torque] && hypothesis(screened).familiar);
            let own: Vec<&Screened> = own.take(PAIRED).collect();
            let mut pairs = Vec::new();
            for (place, first) in own.iter().enumerate() {
                for second in &own[place + 1..] {
                    let members = [first.member, second.member];
                    let parameters: Vec<usize> = members
                        .iter()
                        .flat_map(|&member| self.problem.variant(member).parameters.iter().copied())
                        .collect();
                    let beside = Beside::new(self.problem, fit, &parameters, &[torque]);
                    let (squares, values) = beside.solve(fit);
                    let bounds = members.iter().flat_map(|&member| &self.problem.variant(member).bounds);
                    let within = values.iter().zip(bounds).all(|(value, (low, high))| {
                        value.is_none_or(|value| *low <= value && value <= *high)
                    });
                    let prices: f64 =
                        members.iter().map(|&member| price(self.problem, member, None, &self.rows)).sum();
                    let most = most_of(self.problem, fit, &self.rows, &[torque]);
                    let gain = gain_of(fit, squares, self.rows[torque], &[torque]).min(most) - prices;
                    if within && gain > first.gain && gain > second.gain {
                        let mut members = members;
                        members.sort_by_key(|member| self.problem.hypotheses[member.hypothesis].kind);
                        pairs.push((gain, members));
                    }
                }
            }
            pairs
        };
        (0..self.problem.torques.len()).into_par_iter().flat_map_iter(of_torque).collect()
    }
}
