//! Which models may be: members within their bounds, with what they require.

use super::criterion::criterion;
use super::fit::Fit;
use super::problem::Member;
use super::screening::screen;
use super::search::{Model, NEAR, Search};
use rayon::prelude::*;

/// Models of one step that are fitted with their own weights, after all have been fitted with those of the
/// present model.
const FITTED_IN_FULL: usize = 3;

impl Search<'_> {
    /// A model fitted, with what its members require; members that break their bounds, or say nothing, are
    /// left out.
    pub(super) fn evaluate(&self, mut members: Vec<Member>, start: &Fit) -> Model {
        self.add_required(&mut members, start);
        self.within_bounds(members, start)
    }

    /// The best first of models with these members. All are fitted with the weights of `start`, quickest
    /// where they begin with its members; the best few, where they may be taken, are then fitted with their
    /// own, their members in the order of the present model and new ones at `place`. What belongs to each is
    /// handed through.
    pub(super) fn ranked<T: Send>(
        &self,
        candidates: Vec<(Vec<Member>, T)>,
        start: &Fit,
        place: usize,
    ) -> Vec<(Model, T)> {
        let quickly = |(mut members, belongs): (Vec<Member>, T)| {
            self.add_required(&mut members, start);
            (self.quickly(members, start), belongs)
        };
        let mut models: Vec<(Model, T)> = candidates.into_par_iter().map(quickly).collect();
        models.sort_by(|a, b| a.0.value.total_cmp(&b.0.value));
        let near = |(model, _): &&(Model, T)| model.value < self.model.value + NEAR.0;
        let best = models.iter().take(FITTED_IN_FULL).take_while(near).count();
        models[..best].par_iter_mut().for_each(|(model, _)| {
            let mut members = std::mem::take(&mut model.members);
            let present = |member: &Member| self.model.members.iter().position(|other| other == member);
            members.sort_by_key(|member| present(member).unwrap_or(place));
            *model = self.within_bounds(members, &model.fit);
        });
        models.sort_by(|a, b| a.0.value.total_cmp(&b.0.value));
        models
    }

    /// A model with the weights of `start`; what breaks its bounds is absent, and what requires that stays.
    fn quickly(&self, mut members: Vec<Member>, start: &Fit) -> Model {
        let fitted = Fit::beside(self.problem, self.problem.active(&members), &self.rows, start);
        let mut absent: Vec<usize> = Vec::new();
        let mut fit = None;
        loop {
            let present = fit.as_ref().unwrap_or(&fitted);
            let breaks =
                |member: &Member| !self.is_declared(member) && !self.is_within_bounds(present, member);
            let broken: Vec<Member> = members.iter().filter(|member| breaks(member)).copied().collect();
            if broken.is_empty() {
                let fit = fit.unwrap_or(fitted);
                let value = criterion(self.problem, &members, &fit, &self.rows);
                return Model { members, fit, value, settled: false, foretold: None };
            }
            members.retain(|member| !broken.contains(member));
            let parameters =
                broken.iter().flat_map(|&member| self.problem.variant(member).parameters.iter().copied());
            absent.extend(parameters.filter_map(|parameter| fitted.place[parameter]));
            fit = fitted.pinned(self.problem, &absent);
            if fit.is_none() {
                return Model { members, fit: fitted, value: f64::INFINITY, settled: false, foretold: None };
            }
        }
    }

    /// A model fitted with its own weights; nothing is added.
    fn within_bounds(&self, mut members: Vec<Member>, start: &Fit) -> Model {
        loop {
            let fit = Fit::new(self.problem, self.problem.active(&members), &self.rows, Some(start));
            let breaks = |member: &Member| !self.is_declared(member) && !self.is_within_bounds(&fit, member);
            let broken: Vec<Member> = members.iter().filter(|member| breaks(member)).copied().collect();
            if broken.is_empty() {
                let value = criterion(self.problem, &members, &fit, &self.rows);
                return Model { members, fit, value, settled: true, foretold: None };
            }
            let depends = |other: &Member, on: &Member| {
                let other = &self.problem.hypotheses[other.hypothesis];
                !other.declared && other.requires.contains(&on.hypothesis)
            };
            let required = broken.iter().find(|broken| members.iter().any(|other| depends(other, broken)));
            let without_broken: Vec<Member> =
                members.iter().filter(|member| !broken.contains(member)).copied().collect();
            let Some(required) = required else {
                members = without_broken;
                continue;
            };
            let without_forms: Vec<Member> =
                members.iter().filter(|member| !depends(member, required)).copied().collect();
            // A friction may be bent where nothing is left of what it is a form of: what the criterion is
            // smaller without goes.
            let value = |members: &Vec<Member>| {
                let fit = Fit::beside(self.problem, self.problem.active(members), &self.rows, &fit);
                criterion(self.problem, members, &fit, &self.rows)
            };
            members =
                if value(&without_forms) <= value(&without_broken) { without_forms } else { without_broken };
        }
    }

    /// Whether another member requires it, or is made of it: then it stays as long as that does.
    pub(super) fn is_required(&self, member: &Member) -> bool {
        let own = &self.problem.hypotheses[member.hypothesis];
        self.model.members.iter().filter(|other| *other != member).any(|other| {
            let other = &self.problem.hypotheses[other.hypothesis];
            let made_of_it =
                other.made_of_model && own.torques.iter().any(|torque| other.torques.contains(torque));
            made_of_it || !other.declared && other.requires.contains(&member.hypothesis)
        })
    }

    fn add_required(&self, members: &mut Vec<Member>, start: &Fit) {
        let mut place = 0;
        while place < members.len() {
            let hypothesis = &self.problem.hypotheses[members[place].hypothesis];
            for &required in hypothesis.requires.iter().filter(|_| !hypothesis.declared) {
                if members.iter().all(|member| member.hypothesis != required) {
                    // The variant that says most now; in the middle where none says anything.
                    let says = screen(self.problem, start, &self.rows, &[required]);
                    let middle = self.problem.hypotheses[required].variants.len() / 2;
                    let middle = Member { hypothesis: required, variant: middle };
                    members.push(says.first().map_or(middle, |screened| screened.member));
                }
            }
            place += 1;
        }
    }

    /// What is known to first order only must not be larger than the torque itself: there the first order
    /// says nothing. A multiple of the model's torque is exact, however large.
    fn is_small_enough(&self, fit: &Fit, member: &Member) -> bool {
        let hypothesis = &self.problem.hypotheses[member.hypothesis];
        let parameters = &self.problem.variant(*member).parameters;
        !hypothesis.linearised
            || hypothesis.made_of_model
            || hypothesis.torques.iter().all(|&torque| {
                let rows = &self.problem.torques[torque];
                let values: Vec<(usize, f64)> = parameters
                    .iter()
                    .filter_map(|&parameter| Some((rows.column(parameter)?, fit.values[parameter])))
                    .collect();
                rows.whole.size_of(&values) <= rows.whole.right_hand_side()
            })
    }

    pub(super) fn is_within_bounds(&self, fit: &Fit, member: &Member) -> bool {
        let variant = self.problem.variant(*member);
        let determined = |parameter: usize| fit.place[parameter].is_some_and(|place| fit.determined[place]);
        let within = |(&parameter, (low, high)): (&usize, &(f64, f64))| {
            let value = fit.values[parameter];
            !determined(parameter) || (*low <= value && value <= *high)
        };
        self.is_small_enough(fit, member)
            && variant.parameters.iter().any(|&parameter| determined(parameter))
            && variant.parameters.iter().zip(&variant.bounds).all(within)
    }
}
