//! Forward to the end, then prune, then swap, until nothing is better.

use super::criterion::{choice, price};
use super::cross_validation::cross_validated;
use super::design_effect::effective_rows;
use super::fit::Fit;
use super::problem::{Member, Problem};
use super::screening::{screen, unidentifiable};
use super::wald::{FoldScores, certainty_by, squares_of};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// How the search goes about, and when it believes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Policy {
    /// Hypotheses that are fitted in full at each step, after the quick look at all.
    pub finalists: usize,
    /// Probability at which a member stays in the model, if it were not there.
    pub keep_tail: f64,
    /// Members at most beside what was declared.
    pub most_members: usize,
    /// Whether anything may enter; otherwise members only leave.
    pub grows: bool,
}

/// What could stand in the place of a member.
#[derive(Clone, Debug)]
pub(crate) struct Alternative {
    pub member: Member,
    /// By how much the criterion is larger with it.
    pub excess: f64,
}

/// The model at which the criterion is smallest.
pub(crate) struct Outcome {
    /// Its members, the declared first.
    pub members: Vec<Member>,
    pub fit: Fit,
    /// Effective rows of each torque.
    pub rows: Vec<f64>,
    /// For each member what could stand in its place, best first.
    pub alternatives: Vec<Vec<Alternative>>,
    /// Hypotheses of which the model leaves nothing.
    pub unidentifiable: Vec<usize>,
}

/// Members with their variants chosen.
pub(crate) struct Variants {
    pub members: Vec<Member>,
    pub fit: Fit,
    /// By how much the criterion is smaller than with those of the start.
    pub gained: f64,
}

/// A model on its way.
#[derive(Clone)]
pub(super) struct Model {
    pub members: Vec<Member>,
    pub fit: Fit,
    pub value: f64,
    /// Whether it is fitted with its own weights, so that it may be taken; otherwise it has values only.
    pub settled: bool,
    /// How well it foretells what it is not fitted to ([`cross_validated`]), once that was asked.
    pub foretold: Option<f64>,
}

#[derive(Clone)]
pub(super) struct Search<'a> {
    pub problem: &'a Problem,
    pub policy: Policy,
    /// Hypotheses that were in and were not sure.
    closed: Vec<bool>,
    pub rows: Vec<f64>,
    pub model: Model,
}

/// Members whose replacements are looked at together.
const LOOKED_AT_TOGETHER: usize = 8;
/// Sweeps of swaps; each accepts whatever is better.
const SWEEPS: usize = 4;
/// Times that the effective rows are renewed while effects are added: the more is explained, the less
/// coloured is what is left.
const FORWARD_PHASES: usize = 4;
/// Times that forward, prune and swap follow each other.
const ROUNDS: usize = 6;
/// The criterion must fall by this much for a step: less says nothing.
pub(crate) const LEAST_STEP: f64 = 0.5;
/// By how much, and by which share, a hypothesis may gain less than the member whose place it would take, to
/// first order, and still be fitted in full.
pub(super) const NEAR: (f64, f64) = (20.0, 0.03);
/// Share of a member's gain that one in its place must have that is known to first order only.
const FIRST_ORDER: f64 = 0.5;

/// The set of members at which the criterion is smallest, from `start`.
pub(crate) fn select(problem: &Problem, start: Vec<Member>, policy: Policy) -> Outcome {
    let mut search = Search::new(problem, start, policy);
    search.run();
    search.outcome()
}

/// The variants of the members of `start` at which the criterion is smallest.
pub(crate) fn choose_variants(problem: &Problem, start: Vec<Member>, policy: Policy) -> Variants {
    let mut search = Search::new(problem, start, policy);
    let before = search.model.value;
    search.sweep();
    Variants { gained: before - search.model.value, members: search.model.members, fit: search.model.fit }
}

impl<'a> Search<'a> {
    fn new(problem: &'a Problem, start: Vec<Member>, policy: Policy) -> Self {
        let rows = problem.independent_rows();
        let fit = Fit::new(problem, problem.active(&start), &rows, None);
        let model = Model { members: start, fit, value: 0.0, settled: true, foretold: None };
        let mut search =
            Search { problem, policy, closed: vec![false; problem.hypotheses.len()], rows, model };
        search.renew();
        search
    }

    fn sweep(&mut self) {
        for _ in 0..SWEEPS {
            if !self.swap() {
                break;
            }
        }
    }

    fn run(&mut self) {
        if !self.policy.grows {
            self.renew();
            while self.prune() {}
            self.renew();
            self.doubt();
            return;
        }
        for round in 0..ROUNDS {
            let before = self.model.members.clone();
            // What the textbook has first, or a form of it takes its place. The effective rows are renewed
            // between the phases: within one the criterion falls with each step, so that each ends.
            for textbook in [true, false] {
                for _ in 0..FORWARD_PHASES {
                    self.renew();
                    if !self.forward(textbook) {
                        break;
                    }
                    while self.forward(textbook) {}
                }
            }
            self.renew();
            while self.prune() {}
            self.sweep();
            if round == 0 && self.choose_anew() {
                self.sweep();
            }
            if self.one_for_several() {
                self.sweep();
            }
            while self.one_for_two() {
                self.sweep();
            }
            while self.prune() {}
            self.renew();
            self.doubt();
            if self.model.members == before {
                break;
            }
        }
    }

    /// The effective rows as the present residual tells them, and the criterion with them.
    fn renew(&mut self) {
        self.rows = effective_rows(self.problem, &self.model.fit);
        let members = std::mem::take(&mut self.model.members);
        self.model = self.evaluate(members, &self.model.fit);
    }

    pub(super) fn is_declared(&self, member: &Member) -> bool {
        self.problem.hypotheses[member.hypothesis].declared
    }

    pub(super) fn is_in(&self, hypothesis: usize) -> bool {
        self.model.members.iter().any(|member| member.hypothesis == hypothesis)
    }

    pub(super) fn open(&self) -> Vec<usize> {
        (0..self.problem.hypotheses.len())
            .filter(|&hypothesis| !self.closed[hypothesis] && !self.is_in(hypothesis))
            .collect()
    }

    /// Takes the best of all models that have more in them, if it is better.
    fn forward(&mut self, textbook: bool) -> bool {
        if self.model.members.len() >= self.policy.most_members {
            return false;
        }
        let mut open = self.open();
        open.retain(|&hypothesis| !textbook || self.problem.hypotheses[hypothesis].textbook);
        self.forward_among(open)
    }

    /// The same with hypotheses of `open` alone.
    pub(super) fn forward_among(&mut self, open: Vec<usize>) -> bool {
        let screened = screen(self.problem, &self.model.fit, &self.rows, &open);
        let mut moves = self.moves(&screened);
        // What gains most and foretells nothing must not bar what gains less.
        while !moves.is_empty() {
            let larger = |added: Vec<Member>| {
                (self.model.members.iter().copied().chain(added.clone()).collect(), added)
            };
            let models = self.ranked(moves.into_iter().map(larger).collect(), &self.model.fit, usize::MAX);
            let better = |(model, _): &(Model, Vec<Member>)| {
                model.value < self.model.value - LEAST_STEP && model.members != self.model.members
            };
            let (fitted, rest): (Vec<_>, Vec<_>) =
                models.into_iter().filter(better).partition(|(model, _)| model.settled);
            if fitted.is_empty() {
                return false;
            }
            let fitted = fitted.into_iter().map(|(model, _)| model).collect();
            if let Some(best) = self.first_that_foretells(fitted) {
                self.model = best;
                return true;
            }
            moves = rest.into_iter().map(|(_, added)| added).collect();
        }
        false
    }

    /// The first of these that foretells what it is not fitted to better than the present model.
    fn first_that_foretells(&self, models: Vec<Model>) -> Option<Model> {
        if models.is_empty() {
            return None;
        }
        let foretold = |model: &Model| {
            model.foretold.unwrap_or_else(|| cross_validated(self.problem, &model.fit, &self.rows))
        };
        let present = foretold(&self.model);
        models.into_iter().find_map(|model| {
            let value = foretold(&model);
            (value < present).then_some(Model { foretold: Some(value), ..model })
        })
    }

    /// Leaves out what the criterion is better without: one member, or all of a kind.
    pub(super) fn prune(&mut self) -> bool {
        let removable: Vec<Member> =
            self.model.members.iter().filter(|member| !self.is_declared(member)).copied().collect();
        let mut kinds: BTreeMap<usize, Vec<Member>> = BTreeMap::new();
        for member in &removable {
            let hypothesis = &self.problem.hypotheses[member.hypothesis];
            if hypothesis.familiar {
                kinds.entry(hypothesis.kind).or_default().push(*member);
            }
        }
        let families = kinds.into_values().filter(|members| members.len() > 1);
        let loss = |member: &Member| {
            let hypothesis = &self.problem.hypotheses[member.hypothesis];
            let rows: f64 = hypothesis.torques.iter().map(|&torque| self.rows[torque]).sum();
            let squares = squares_of(self.problem, &self.model.fit, *member);
            rows * (squares / rows).ln_1p() - price(self.problem, *member, Some(&self.model.fit), &self.rows)
        };
        let mut singles: Vec<(f64, Member)> = removable
            .par_iter()
            .filter(|member| !self.is_required(member))
            .map(|member| (loss(member), *member))
            .collect();
        singles.sort_by(|a, b| a.0.total_cmp(&b.0));
        let worst = 2.0 * choice(self.problem) + NEAR.0;
        let singles =
            singles.into_iter().take_while(|(loss, _)| *loss < worst).take(self.policy.finalists / 2);
        let moves: Vec<Vec<Member>> = singles.map(|(_, member)| vec![member]).chain(families).collect();
        let smaller = |removed: Vec<Member>| {
            let stays = self.model.members.iter().filter(|member| !removed.contains(member));
            (stays.copied().collect(), ())
        };
        let models = self.ranked(moves.into_iter().map(smaller).collect(), &self.model.fit, usize::MAX);
        match models.into_iter().find(|(model, ())| model.settled) {
            Some((best, ())) if best.value <= self.model.value && best.members != self.model.members => {
                self.model = best;
                true
            }
            _ => false,
        }
    }

    /// Puts in the place of each member what the criterion is smaller with, one after the other. The next few
    /// places are looked at together; what was looked at beyond one that is taken is looked at again.
    fn swap(&mut self) -> bool {
        let mut swapped = false;
        let mut place = 0;
        while place < self.model.members.len() {
            let ahead = self.model.members.len().min(place + LOOKED_AT_TOGETHER);
            let better: Vec<Option<Model>> =
                (place..ahead).into_par_iter().map(|place| self.better_in_place_of(place)).collect();
            match better.into_iter().enumerate().find_map(|(at, model)| Some((at, model?))) {
                Some((at, model)) => {
                    self.model = model;
                    swapped = true;
                    place += at + 1;
                }
                None => place = ahead,
            }
        }
        swapped
    }

    /// The best model with something else in the place of a member, if the criterion is smaller with it.
    fn better_in_place_of(&self, place: usize) -> Option<Model> {
        let member = self.model.members[place];
        // What is declared stays in the model with constants at which it can be: a stop where it pushes.
        let is_within = |fit: &Fit, member: &Member| self.is_within_bounds(fit, member);
        let stays_possible = self.is_declared(&member) && is_within(&self.model.fit, &member);
        let may_enter = |model: &Model, entering: &[Member]| {
            !stays_possible || entering.iter().all(|entering| is_within(&model.fit, entering))
        };
        let models = self.in_place_of(place).into_iter();
        let models = models.filter(|(model, entering)| model.settled && may_enter(model, entering));
        let parameters = |member: &Member| self.problem.variant(*member).parameters.len();
        // Of two that explain alike, the one with fewer parameters.
        let is_simpler =
            |entering: &[Member]| matches!(entering, [own] if parameters(own) < parameters(&member));
        let better = |(model, entering): &(Model, Vec<Member>)| {
            let step = if is_simpler(entering) { 0.0 } else { LEAST_STEP };
            model.value < self.model.value - step
        };
        for (model, entering) in models.filter(better) {
            let is_more = match entering.as_slice() {
                [own] => own.hypothesis == member.hypothesis && parameters(own) > parameters(&member),
                _ => true,
            };
            // More in the place of one must foretell more, as whatever is added: the knots of a map are
            // more until each is of one stretch alone.
            if !is_more {
                return Some(model);
            }
            if let Some(model) = self.first_that_foretells(vec![model]) {
                return Some(model);
            }
        }
        None
    }

    /// Models with something else in the place of a member, best first.
    fn in_place_of(&self, place: usize) -> Vec<(Model, Vec<Member>)> {
        let member = self.model.members[place];
        let own = &self.problem.hypotheses[member.hypothesis];
        if own.declared && own.variants.len() == 1 {
            return Vec::new();
        }
        let others: Vec<Member> =
            self.model.members.iter().filter(|other| **other != member).copied().collect();
        let without = Fit::beside(self.problem, self.problem.active(&others), &self.rows, &self.model.fit);
        let mut open: Vec<usize> = match own.declared {
            true => Vec::new(),
            false => self.open(),
        };
        open.retain(|&other| {
            let other = &self.problem.hypotheses[other];
            (!other.made_of_model || other.kind == own.kind)
                && other.torques.iter().any(|torque| own.torques.contains(torque))
        });
        open.push(member.hypothesis);
        let mut screened = screen(self.problem, &without, &self.rows, &open);
        let own_gain = screened.iter().find(|screened| screened.member.hypothesis == member.hypothesis);
        let least = own_gain.map_or(0.0, |own| own.gain * (1.0 - NEAR.1) - NEAR.0);
        let mut pairs = match own.declared {
            true => Vec::new(),
            false => self.pairs(&without, &screened),
        };
        let first_order = own_gain.map_or(0.0, |own| own.gain * FIRST_ORDER);
        screened.retain(|screened| {
            let linearised = self.problem.hypotheses[screened.member.hypothesis].linearised;
            screened.gain >= if linearised { least.min(first_order) } else { least }
        });
        pairs.retain(|(gain, _)| *gain >= least);
        pairs.sort_by(|a, b| b.0.total_cmp(&a.0));
        let singles =
            screened.iter().map(|screened| vec![screened.member]).filter(|single| *single != [member]);
        let singles = singles.take(self.policy.finalists / 2);
        let pairs = pairs.iter().map(|(_, pair)| pair.to_vec()).take(self.policy.finalists / 4);
        let scaled = if own.made_of_model && !own.declared { self.of_kind(own.kind) } else { Vec::new() };
        let scaled = scaled.into_iter().map(|other| vec![other]);
        let moves: Vec<Vec<Member>> = singles.chain(pairs).chain(scaled).collect();
        let swapped = |entering: Vec<Member>| {
            let members = others.iter().chain(&entering).copied().collect();
            (members, entering)
        };
        let mut models = self.ranked(moves.into_iter().map(swapped).collect(), &without, place);
        models.retain(|(model, entering)| entering.iter().all(|member| model.members.contains(member)));
        models
    }

    /// Leaves out what is not sure, the least sure first.
    fn doubt(&mut self) {
        loop {
            let scores = FoldScores::new(self.problem, &self.model.fit);
            let tail_of =
                |member: &Member| certainty_by(&scores, self.problem, &self.model.fit, *member).tail;
            let tails = self.model.members.par_iter().enumerate();
            let tails = tails.filter(|(_, member)| !self.is_declared(member) && !self.is_required(member));
            let worst =
                tails.map(|(place, member)| (tail_of(member), place)).max_by(|a, b| a.0.total_cmp(&b.0));
            let Some((tail, place)) = worst else { return };
            if tail <= self.policy.keep_tail {
                return;
            }
            let mut members = self.model.members.clone();
            self.closed[members.remove(place).hypothesis] = true;
            let model = self.evaluate(members, &self.model.fit);
            self.model = model;
        }
    }

    fn outcome(self) -> Outcome {
        let alternatives = (0..self.model.members.len())
            .into_par_iter()
            .map(|place| {
                let models = self.in_place_of(place).into_iter();
                let own = self.model.members[place].hypothesis;
                models
                    .filter_map(|(model, entering)| match entering.as_slice() {
                        [member] if member.hypothesis != own => {
                            Some(Alternative { member: *member, excess: model.value - self.model.value })
                        }
                        _ => None,
                    })
                    .collect()
            })
            .collect();
        Outcome {
            alternatives,
            unidentifiable: unidentifiable(self.problem, &self.model.fit, &self.open()),
            members: self.model.members,
            fit: self.model.fit,
            rows: self.rows,
        }
    }
}
