//! A model on trial: what it foretells of training motion that it was not fitted to.

use super::hypotheses::{Candidates, Present};
use super::kept_columns::Keep;
use super::search::Search;
use crate::selection::{Fit, Foretelling, Member, Parts, Problem, Products};
use phiw_identification::IdentificationError;

/// The chosen model, fitted to the training motion.
///
/// What has a name is judged on parts of that motion which a fit to the other parts foretells; motion held
/// out is for the errors that are reported.
pub(super) struct Trial {
    pub problem: Problem,
    pub members: Vec<Member>,
    pub rows: Vec<f64>,
    pub fit: Fit,
    pub held_out: Vec<Products>,
    /// The place of each member among the model's effects.
    pub places: Vec<usize>,
}

/// What is left of each torque where it is foretold.
pub(super) struct Squares {
    /// By the declared effects alone.
    pub initial: Vec<f64>,
    /// Without an effect.
    pub without: Vec<f64>,
    /// With it.
    pub with: Vec<f64>,
}

impl Search<'_> {
    /// The model as it is, fitted to the training motion.
    pub(super) fn trial(&self) -> Result<Trial, IdentificationError> {
        let present = Present { specs: &self.specs, declared: self.declared };
        let mut candidates = Candidates::of_model(self.fixed, present);
        let folds: Vec<_> = self.folds.iter().chain(&self.fixed.data.held_out).copied().collect();
        let reference = self.fixed.reference(&self.specs, &self.parameters)?;
        let mut stage =
            self.fixed.pass(&self.specs, Vec::new(), reference, &folds, Keep::WhileThereIsRoom)?;
        let training = self.folds.len();
        let held_out =
            stage.torques.iter_mut().map(|folds| Products::sum(&folds.split_off(training))).collect();
        let problem = self.fixed.problem(stage, &mut candidates)?;
        let fit = Fit::new(&problem, problem.active(&candidates.present), &self.chosen.rows, None);
        Ok(Trial {
            held_out,
            places: candidates.list.iter().map(|candidate| candidate.effects[0]).collect(),
            rows: self.chosen.rows.clone(),
            members: candidates.present,
            problem,
            fit,
        })
    }
}

impl Trial {
    /// The member at a place among the model's effects.
    pub fn member(&self, place: usize) -> Option<Member> {
        self.places.iter().position(|other| *other == place).map(|at| self.members[at])
    }

    /// Whether it is one of the textbook's effects, and acts on none but these torques.
    pub fn is_of_textbook(&self, member: Member, torques: &[usize]) -> bool {
        let own = &self.problem.hypotheses[member.hypothesis];
        own.textbook && own.torques.iter().all(|torque| torques.contains(torque))
    }

    /// Whether another effect is a form of it.
    pub fn is_required(&self, member: &Member) -> bool {
        let requires = |other: &Member| &self.problem.hypotheses[other.hypothesis].requires;
        self.members.iter().any(|other| requires(other).contains(&member.hypothesis))
    }

    /// Whether the columns of another effect among those of `is_in` are made of the model's torque, with what
    /// this one adds to it: as long as that stays, it would do the work of whatever leaves.
    pub fn is_material_of_another(&self, member: &Member, is_in: impl Fn(usize) -> bool) -> bool {
        let own = &self.problem.hypotheses[member.hypothesis];
        let others = self.members.iter().zip(&self.places).filter(|(other, _)| *other != member);
        others.filter(|(_, place)| is_in(**place)).any(|(other, _)| {
            let other = &self.problem.hypotheses[other.hypothesis];
            let shares_torque = || own.torques.iter().any(|torque| other.torques.contains(torque));
            other.made_of_model && !other.declared && !own.made_of_model && shares_torque()
        })
    }

    /// What the logarithms of the foretold errors gain: Σ rows·log(without/with).
    pub fn gain(&self, without: &[f64], with: &[f64]) -> f64 {
        let of_torque = |torque: usize| self.torque(torque).rows() * (without[torque] / with[torque]).ln();
        (0..self.problem.torques.len()).map(of_torque).sum()
    }

    /// The products of a torque over all training motion.
    pub fn torque(&self, torque: usize) -> &Products {
        &self.problem.torques[torque].whole
    }

    /// RMS of what a member takes over the RMS of a torque that it acts on, the largest.
    pub fn size(&self, member: Member, squares: &Squares) -> f64 {
        let of_torque = |&torque: &usize| {
            let whole = self.torque(torque).right_hand_side().max(f64::MIN_POSITIVE);
            ((squares.without[torque] - squares.with[torque]).max(0.0) / whole).sqrt()
        };
        self.problem.hypotheses[member.hypothesis].torques.iter().map(of_torque).fold(0.0, f64::max)
    }

    /// The fit with the declared members and those found that `stays` keeps, by their place among the model's
    /// effects.
    pub fn fit_with(&self, stays: impl Fn(usize) -> bool) -> Fit {
        let members: Vec<Member> = self
            .members
            .iter()
            .zip(&self.places)
            .filter(|(member, place)| self.problem.hypotheses[member.hypothesis].declared || stays(**place))
            .map(|(member, _)| *member)
            .collect();
        Fit::new(&self.problem, self.problem.active(&members), &self.rows, Some(&self.fit))
    }

    /// Fits to four fifths of the training motion each, which foretell the fifth that is left.
    pub fn foretelling(&self, fit: &Fit) -> Foretelling<'_> {
        Foretelling::new(&self.problem, fit, Parts::Spread)
    }

    /// What is left of each torque of the training motion where each fifth is foretold by a fit to the
    /// others.
    pub fn foretold_squares(&self, fit: &Fit) -> Vec<f64> {
        self.foretelling(fit).squares()
    }

    /// What is left of each torque on motion held out, for the errors that are reported.
    pub fn held_out_squares(&self, fit: &Fit) -> Vec<f64> {
        let of_torque = |(torque, held_out): (usize, &Products)| match held_out.rows() > 0.0 {
            true => held_out.residual(&fit.columns(torque)),
            false => 1.0,
        };
        self.held_out.iter().enumerate().map(of_torque).collect()
    }

    /// The same for a fit without a member; the others are fitted again, with the same weights.
    pub fn held_out_squares_without(&self, fit: &Fit, member: Member) -> Vec<f64> {
        let own = &self.problem.variant(member).parameters;
        let places: Vec<usize> = own.iter().filter_map(|&parameter| fit.place[parameter]).collect();
        let pinned = fit.pinned(&self.problem, &places);
        let without = pinned.unwrap_or_else(|| fit.without_parameters(&self.problem, &places, &[]));
        self.held_out_squares(&without)
    }

    /// What the textbook has of the joint of a member that is not of the textbook: what these could do of its
    /// work has their names.
    pub fn textbook_beside(&self, member: Member) -> impl Iterator<Item = Member> {
        let own = &self.problem.hypotheses[member.hypothesis];
        let is_beside = |other: &&Member| {
            let hypothesis = &self.problem.hypotheses[other.hypothesis];
            !own.textbook && hypothesis.textbook && hypothesis.torques == own.torques
        };
        self.members.iter().filter(is_beside).copied()
    }

    /// The squares of what a member adds to a torque, beyond what others could add.
    pub fn size_beside(&self, member: Member, others: &[Member], torque: usize) -> f64 {
        let rows = &self.problem.torques[torque];
        let columns = others.iter().flat_map(|&other| &self.problem.variant(other).parameters);
        let columns: Vec<usize> = columns.filter_map(|&parameter| rows.column(parameter)).collect();
        self.torque(torque).size_beside(&self.values_of(member, torque), &columns)
    }

    /// What a member adds to a torque, as (column, value) pairs.
    pub fn values_of(&self, member: Member, torque: usize) -> Vec<(usize, f64)> {
        let rows = &self.problem.torques[torque];
        let value = |parameter: usize| self.fit.values[parameter] - self.problem.absent[parameter];
        let parameters = &self.problem.variant(member).parameters;
        parameters.iter().filter_map(|&parameter| Some((rows.column(parameter)?, value(parameter)))).collect()
    }

    /// Share of the stretches of training motion in which the error of `without` is larger than the model's.
    pub fn better_folds(&self, without: &Fit) -> f64 {
        let count = self.problem.torques.first().map_or(0, |torque| torque.folds.len());
        let loss = |fit: &Fit, fold: usize| -> f64 {
            (0..self.problem.torques.len())
                .map(|torque| {
                    let rows = &self.problem.torques[torque].folds[fold];
                    let squares = rows.residual(&fit.columns(torque));
                    self.fit.weights[torque] * squares
                })
                .sum()
        };
        let better = (0..count).filter(|&fold| loss(&self.fit, fold) < loss(without, fold)).count();
        better as f64 / count.max(1) as f64
    }
}
