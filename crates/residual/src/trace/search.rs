//! The loop: choose, refine, make again, until nothing changes.

use super::folds::{split, split_by_motion};
use super::hypotheses::{Candidates, Present};
use super::input::{TraceInput, TraceOptions};
use super::kept_columns::Keep;
use super::residuals::ranges_of_residual;
use super::sample::Sample;
use super::special_cases::Refined;
use super::stage::{Fixed, Stage, specs_and_values};
use super::tracing::{Tracing, Withdrawn};
use crate::selection::{Judged, Member, Policy, Problem, select};
use phiw_effects::{Constants, EffectKind, SignalRanges};
use phiw_identification::{Data, Design, Effect, EffectCatalogue, EffectSpec, Fold, IdentificationError};

/// Times that all is chosen anew: columns that are made of the model's torque need a second, what they bring
/// about a third.
const ROUNDS: usize = 4;
/// Effects that are put into force to see what they explain, at most.
const CONTESTS: usize = 4;
/// What the criterion may lose with an effect that leaves, if the constants of the others can make up for it.
const MADE_UP_BY_CONSTANTS: f64 = 50.0;
/// Candidates that are fitted in full at each step.
const FINALISTS: usize = 12;

/// Traces the residual of the declared (or held) model.
///
/// What is declared is where the search starts, and stays in the model however little it does. An effect that
/// the logs refute, since a constant of it is certain to be one that no such effect has (a friction that
/// drives), leaves it, unless the model is better on motion held out with it.
///
/// # Errors
/// A log cannot be read, or holds too little for the declared model.
pub fn trace(input: TraceInput<'_>, options: &TraceOptions) -> Result<Tracing, IdentificationError> {
    let sample = Sample::of(input.data, input.ranges.period)?;
    let data = sample.data(&input.data.rest_speeds);
    let fixed = Fixed::new(&input, &data, options)?;
    // Pieces of long logs are searched, and all of them fitted in the end.
    let whole = if data.train == input.data.train { &data } else { input.data };
    let search = Search::of_declared(&fixed, whole, &input, options)?;
    let tracing = search.clone().run()?;
    if tracing.withdrawn.is_empty() || search.is_no_worse_than_declared(&tracing) {
        return Ok(tracing);
    }
    // What leaves is still refuted, whether or not the model can do without it.
    let withdrawn = tracing.withdrawn.into_iter().map(|own| Withdrawn { kept: true, ..own }).collect();
    Ok(Tracing { withdrawn, ..Search { declared_stays: true, ..search }.run()? })
}

/// What the last choice knew beside what it chose.
#[derive(Clone, Default)]
pub(super) struct Chosen {
    /// Effective rows of each torque.
    pub rows: Vec<f64>,
    /// Rows of each torque over its effective ones.
    pub rows_per_effective: Vec<f64>,
    /// Number of hypotheses that there were.
    pub hypotheses: usize,
    /// For each effect that was found, what could stand in its place, and by how much the criterion is larger
    /// with it.
    pub alternatives: Vec<Vec<(EffectSpec, f64)>>,
    /// Hypotheses of which the model leaves nothing.
    pub unidentifiable: Vec<EffectSpec>,
}

/// A model on its way.
#[derive(Clone)]
pub(super) struct Search<'a> {
    pub fixed: &'a Fixed<'a>,
    /// All logs: `fixed` has those pieces of long ones that are searched.
    pub whole: &'a Data<'a>,
    /// Effects of the model: those declared, then those found.
    pub specs: Vec<EffectSpec>,
    /// The base parameters, then those of the effects.
    pub parameters: Vec<f64>,
    /// Number of effects that were declared and have not left.
    pub declared: usize,
    /// Whether declared effects stay whatever the logs say.
    pub declared_stays: bool,
    /// Declared effects that the logs refute.
    pub withdrawn: Vec<Withdrawn>,
    /// Stretches of the training motion.
    pub folds: Vec<Fold>,
    /// Whether anything may be added; otherwise effects only leave.
    pub grows: bool,
    pub chosen: Chosen,
    /// Whether what training logs may have of their own is sought, too.
    pub asks_of_logs: bool,
    /// Whether kinds that make the size of others vary are sought, too.
    pub asks_of_variation: bool,
    /// Effects that are not sought again: they promised more to first order than they held in force, or gave
    /// way to simpler forms.
    pub refuted: Vec<EffectSpec>,
    /// Kinds and joints of which no parameter is certain once their constants are free: they have no name.
    pub uncertain: Vec<(String, Vec<String>)>,
    /// Kinds and joints that only bend what is simpler, as the model is when names are given: they have none.
    pub bent: Vec<(String, Vec<String>)>,
    /// Effects that gave way to their special cases and refine them.
    pub refined: Vec<Refined>,
    /// What counts as noise of each torque where names are judged, RMS \[N·m, N\].
    pub noise: Vec<f64>,
    /// What was left out since motion held out had a say.
    pub left_out_by_held_out: Vec<EffectSpec>,
    /// Effects whose constants were told by motion held out, since the training log could not.
    pub told_by_held_out: Vec<EffectSpec>,
    /// Whether this end was taken before another since that leaves more of the motion held out.
    pub held_out_had_a_say: bool,
    pub input: &'a TraceInput<'a>,
    pub options: &'a TraceOptions,
}

impl<'a> Search<'a> {
    /// The declared (or held) model, before anything is sought.
    pub(super) fn of_declared(
        fixed: &'a Fixed<'a>,
        whole: &'a Data<'a>,
        input: &'a TraceInput<'a>,
        options: &'a TraceOptions,
    ) -> Result<Self, IdentificationError> {
        Ok(Search {
            fixed,
            whole,
            specs: input.declared.clone(),
            parameters: input.parameters.clone(),
            declared: input.declared.len(),
            declared_stays: fixed.prior.is_some(),
            withdrawn: Vec::new(),
            folds: split_by_motion(fixed, split(&fixed.data.train, 1))?,
            grows: true,
            chosen: Chosen::default(),
            asks_of_logs: false,
            asks_of_variation: false,
            refuted: Vec::new(),
            uncertain: Vec::new(),
            bent: Vec::new(),
            refined: Vec::new(),
            noise: input.noise_floor.clone(),
            left_out_by_held_out: Vec::new(),
            told_by_held_out: Vec::new(),
            held_out_had_a_say: false,
            input,
            options,
        })
    }
}

impl Search<'_> {
    /// The model at the end, with nothing yet left out for what it does on motion that it is not fitted to.
    pub(super) fn searched(mut self) -> Result<Self, IdentificationError> {
        // A width that is wrong is a friction that is missing.
        self.refine()?;
        loop {
            self.settle()?;
            // Only once nothing else is missing: what is missing makes up for itself by impossible constants.
            if !self.withdraw()? {
                break;
            }
        }
        self.ask_of_variation()?;
        self.ask_of_logs()?;
        self.prefer_simpler_forms()?;
        self.prefer_special_cases()?;
        self.take_back()?;
        Ok(self)
    }

    /// Chooses and refines until nothing changes.
    pub(super) fn settle(&mut self) -> Result<(), IdentificationError> {
        let mut uncontested: Option<Self> = None;
        for round in 1..=ROUNDS {
            let before = self.names();
            self.choose()?;
            self.refine()?;
            self.leave_out_what_is_not_realised()?;
            // What won a contest may lead the next choice astray.
            if let Some(uncontested) = uncontested.take() {
                let rows = uncontested.chosen.rows.clone();
                if self.value(&rows)? >= uncontested.value(&rows)? {
                    *self = uncontested;
                    break;
                }
            }
            let is_settled = self.names() == before;
            // What has not settled is not chosen again, and its frictions may still turn over a way.
            if is_settled || round == ROUNDS {
                let over_a_way = self.turn_over_a_way()?;
                if self.turn_together()? || over_a_way {
                    continue;
                }
            }
            if is_settled {
                uncontested = Some(self.clone());
                if !self.grows || !self.contest()? {
                    break;
                }
            }
        }
        Ok(())
    }

    pub fn policy(&self) -> Policy {
        Policy {
            finalists: FINALISTS,
            keep_tail: self.options.thresholds.false_name_probability,
            most_members: self.options.most_effects + self.declared,
            grows: self.grows,
        }
    }

    pub fn is_held(&self, place: usize) -> bool {
        self.fixed.prior.is_some() && place < self.declared
    }

    pub(super) fn names(&self) -> Vec<(String, Vec<String>)> {
        let mut names: Vec<_> =
            self.specs.iter().map(|spec| (spec.kind.clone(), spec.joints.clone())).collect();
        names.sort();
        names
    }

    pub fn design(&self) -> Result<Design, IdentificationError> {
        let effects = self.fixed.build(&self.specs)?;
        Ok(Design::new(self.fixed.tree.clone(), self.fixed.base.clone(), effects)
            .with_rest_speeds(self.fixed.data.rest_speeds.clone())
            .with_reference(self.fixed.reference(&self.specs, &self.parameters)?))
    }

    /// One pass over the training motion with the model's columns and those of `effects`.
    pub fn pass(&self, effects: Vec<Box<dyn Effect>>, keep: Keep) -> Result<Stage, IdentificationError> {
        let reference = self.fixed.reference(&self.specs, &self.parameters)?;
        self.fixed.pass(&self.specs, effects, reference, &self.folds, keep)
    }

    /// Chooses among all hypotheses, from the present model on.
    pub(super) fn choose(&mut self) -> Result<(), IdentificationError> {
        let (logs, variation) = (self.asks_of_logs, self.asks_of_variation);
        self.choose_among(|kind| {
            (logs || !kind.is_of_training_logs()) && (variation || kind.varies().is_none())
        })
    }

    /// Chooses among the effects of the model and the hypotheses of the kinds that are `sought`.
    pub(super) fn choose_among(
        &mut self,
        sought: impl Fn(&dyn EffectKind) -> bool,
    ) -> Result<(), IdentificationError> {
        let present = Present { specs: &self.specs, declared: self.declared };
        let mut options = self.options.clone();
        options.excluded.extend(self.refuted.iter().cloned());
        let mut candidates = Candidates::all(self.fixed, present, &self.ranges()?, &options, sought)?;
        let effects = std::mem::take(&mut candidates.effects);
        let stage = self.pass(effects, Keep::Always)?;
        let problem = self.fixed.problem(stage, &mut candidates)?;
        let outcome = select(&problem, candidates.present.clone(), self.policy());
        let spec = |member: &Member| candidates.list[member.hypothesis].specs[member.variant].clone();
        let found = outcome.members.iter().zip(&outcome.alternatives);
        let found = found.filter(|(member, _)| !candidates.list[member.hypothesis].declared);
        self.chosen = Chosen {
            alternatives: found
                .map(|(_, others)| others.iter().map(|other| (spec(&other.member), other.excess)).collect())
                .collect(),
            unidentifiable: outcome
                .unidentifiable
                .iter()
                .map(|&unidentifiable| candidates.list[unidentifiable].specs[0].clone())
                .collect(),
            hypotheses: problem.hypotheses.iter().filter(|hypothesis| !hypothesis.declared).count(),
            rows_per_effective: problem
                .torques
                .iter()
                .zip(&outcome.rows)
                .map(|(torque, effective)| (torque.whole.rows() / effective).max(1.0))
                .collect(),
            rows: outcome.rows,
        };
        self.take(&problem, &candidates, &outcome.members, &outcome.fit.values);
        Ok(())
    }

    /// Leaves out what was chosen for what it does to first order and, now that it is in force, makes the
    /// criterion no smaller than it is without it: noise that moves a robot looks like a delay, until the
    /// signals are shifted. A delay or a filter may stand for how the frictions of its joints turn, which
    /// nobody looked for beside it.
    pub(super) fn leave_out_what_is_not_realised(&mut self) -> Result<(), IdentificationError> {
        let mut own = None;
        for place in (self.declared..self.specs.len()).rev() {
            if self.fixed.absent(&self.specs[place])?.is_none() {
                continue;
            }
            let value = match own {
                Some(own) => own,
                None => *own.insert(self.value(&self.chosen.rows)?),
            };
            let mut branch = self.clone();
            branch.remove(place)?;
            let joints = &self.specs[place].joints;
            branch.scan_those(|spec| spec.joints.iter().all(|joint| joints.contains(joint)))?;
            if branch.value(&branch.chosen.rows)? > value + MADE_UP_BY_CONSTANTS {
                continue;
            }
            branch.refine()?;
            if branch.value(&branch.chosen.rows)? <= value {
                branch.refuted.push(EffectSpec { constants: Constants::new(), ..self.specs[place].clone() });
                *self = branch;
                own = None;
            }
        }
        Ok(())
    }

    /// Puts in the place of an effect what is known to first order only and, once it is in force, explains
    /// more. Whether anything was.
    fn contest(&mut self) -> Result<bool, IdentificationError> {
        let mut own = None;
        let mut tried = 0;
        for index in 0..self.chosen.alternatives.len() {
            for (spec, _) in self.chosen.alternatives[index].clone() {
                if tried == CONTESTS || self.fixed.absent(&spec)?.is_none() {
                    continue;
                }
                tried += 1;
                let own = match own {
                    Some(own) => own,
                    None => *own.insert(self.value(&self.chosen.rows)?),
                };
                let mut branch = self.clone();
                branch.replace(self.declared + index, spec)?;
                branch.refine()?;
                if branch.value(&branch.chosen.rows)? < own {
                    *self = branch;
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// The criterion of the model as it is, with these effective rows of each torque.
    pub(super) fn value(&self, rows: &[f64]) -> Result<f64, IdentificationError> {
        Ok(self.judged(rows)?.value())
    }

    /// The model as it is, fitted with these effective rows of each torque.
    pub(super) fn judged(&self, rows: &[f64]) -> Result<Judged, IdentificationError> {
        let mut candidates =
            Candidates::of_model(self.fixed, Present { specs: &self.specs, declared: self.declared });
        let stage = self.pass(Vec::new(), Keep::WhileThereIsRoom)?;
        let problem = self.fixed.problem(stage, &mut candidates)?;
        Ok(Judged::new(problem, &candidates.present, rows))
    }

    /// Puts another effect, with its parameters at nothing, in the place of one.
    pub(super) fn replace(&mut self, place: usize, spec: EffectSpec) -> Result<(), IdentificationError> {
        let own = self.design()?.effect_parameters(place);
        self.specs[place] = spec;
        let count = self.parameters_of(&self.specs[place])?;
        self.parameters.splice(own, vec![0.0; count]);
        Ok(())
    }

    /// How many parameters an effect has.
    fn parameters_of(&self, spec: &EffectSpec) -> Result<usize, IdentificationError> {
        Ok(self.fixed.catalogue.build(spec, self.fixed.tree)?.parameters().len())
    }

    /// Adds an effect, with its parameters at nothing.
    pub(super) fn add(&mut self, spec: EffectSpec) -> Result<(), IdentificationError> {
        let count = self.parameters_of(&spec)?;
        self.specs.push(spec);
        self.parameters.extend(std::iter::repeat_n(0.0, count));
        self.chosen.alternatives.push(Vec::new());
        Ok(())
    }

    /// Makes what was chosen the model.
    pub fn take(&mut self, problem: &Problem, candidates: &Candidates, members: &[Member], values: &[f64]) {
        let held = if self.fixed.prior.is_some() { self.declared } else { 0 };
        let of_held = if held > 0 { self.input.parameters.len() } else { self.fixed.base.count() };
        let held = self.specs[..held].to_vec();
        (self.specs, self.parameters) =
            specs_and_values(problem, candidates, &held, members, values, 0..of_held);
    }

    /// What the training motion covers, with the frequencies of what the present model leaves.
    fn ranges(&self) -> Result<SignalRanges, IdentificationError> {
        let ranges = self.input.ranges.clone();
        ranges_of_residual(&self.design()?, &self.parameters, self.fixed.data, ranges)
    }
}
