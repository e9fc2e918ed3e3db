//! What of the chosen effects has a name, and what only refines the model.
//!
//! All of it is decided on training motion: parts of it are foretold by fits to the other parts. Motion held
//! out is for the errors that are reported.

use super::harm::Harm;
use super::search::Search;
use super::tracing::FoundEffect;
use super::trial::{Squares, Trial};
use crate::selection::{Member, certainty};
use phiw_effects::EffectKind;
use phiw_identification::{EffectSpec, IdentificationError};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The model without the forms of something simpler from a level on, constants refined.
struct Simpler {
    trial: Trial,
    /// What it leaves of each torque where it is foretold.
    squares: Vec<f64>,
    /// The places, among the effects of the whole model, of the forms that are left out, ascending.
    left_out: Vec<usize>,
}

/// What leaving out an effect does.
pub(super) struct Judged {
    /// Place among the model's effects.
    pub place: usize,
    pub significance: f64,
    /// What the logarithms of the foretold errors gain with it: Σ rows·log(without/with).
    pub gain: f64,
    /// Share of the stretches of training motion that it makes better.
    pub folds: f64,
    /// RMS of what it takes over the RMS of a torque that it acts on, the largest.
    pub size: f64,
    /// Whether its certainty is that of a name.
    pub certain: bool,
    pub named: bool,
}

impl Search<'_> {
    /// The effects that were found, in the order in which they count: those that have a name, then those that
    /// refine. `self.specs` are put in that order.
    ///
    /// What does harm is left out.
    pub(super) fn name(&mut self, harm: Harm) -> Result<(Vec<FoundEffect>, usize), IdentificationError> {
        self.noise.clone_from(&self.input.noise_floor);
        let trial = self.without_harm(harm)?;
        self.bent = self.bent()?;
        let levels = self.levels(&trial);
        let simpler = self.simpler(&levels)?;
        let mut judged = self.judge_all(&trial, &levels, &simpler)?;
        if self.take_for_noise(&trial, &judged)? {
            judged = self.judge_all(&trial, &levels, &simpler)?;
        }
        self.in_order(&trial, judged)
    }

    /// Leaves out what does harm, with the trial of what is left.
    pub(super) fn without_harm(&mut self, harm: Harm) -> Result<Trial, IdentificationError> {
        let mut as_fitted = None;
        loop {
            self.call_by_the_frictions_name()?;
            let trial = self.trial()?;
            let harmful = self.harmful(&trial, harm);
            if harmful.is_empty() {
                match self.without_what_misleads(&trial, &mut as_fitted)? {
                    Some(without) => *self = without,
                    None => return Ok(trial),
                }
                continue;
            }
            for place in harmful.into_iter().rev() {
                self.remove(place)?;
            }
            self.refine()?;
        }
    }

    /// The effects that were found, with or without a name, beside the noise as it is known.
    fn judge_all(
        &self,
        trial: &Trial,
        levels: &BTreeMap<usize, usize>,
        simpler: &[Simpler],
    ) -> Result<Vec<Judged>, IdentificationError> {
        let mut judged = self.judge(trial, levels, simpler);
        self.judge_beside_forms(trial, &mut judged);
        self.judge_small(trial, &mut judged)?;
        self.judge_interchangeable(trial, &mut judged);
        self.name_families(trial, &mut judged);
        Ok(judged)
    }

    /// For each effect of the model how many simpler ones on the same joints it stands on, by its place: what
    /// the textbook has stands on none, the first form of it on one level, the next on two.
    fn levels(&self, trial: &Trial) -> BTreeMap<usize, usize> {
        let rank = |place: usize| self.fixed.catalogue.rank(&self.specs[place].kind);
        let is_form = |member: &Member| {
            let hypothesis = &trial.problem.hypotheses[member.hypothesis];
            !hypothesis.declared && !hypothesis.requires.is_empty()
        };
        let forms = trial.members.iter().zip(&trial.places);
        let forms = forms.filter(|(member, place)| {
            is_form(member) || self.refines_special_case(**place) || self.leans_on_textbook(trial, **member)
        });
        let forms: Vec<usize> = forms.map(|(_, place)| *place).collect();
        let simpler = |place: usize| {
            let own = &self.specs[place].joints;
            forms
                .iter()
                .filter(|&&other| self.specs[other].joints == *own && rank(other) < rank(place))
                .count()
        };
        forms.iter().map(|&place| (place, 1 + simpler(place))).collect()
    }

    /// The models with the forms below each level only. An effect is judged against what is as simple or
    /// simpler: beside all forms of it, none is missed.
    fn simpler(&self, levels: &BTreeMap<usize, usize>) -> Result<Vec<Simpler>, IdentificationError> {
        let highest = levels.values().copied().max().unwrap_or(0);
        let below = |level: usize| {
            let mut branch = self.clone();
            let left_out: Vec<usize> =
                levels.iter().filter(|(_, own)| **own > level).map(|(place, _)| *place).collect();
            for &place in left_out.iter().rev() {
                branch.remove(place)?;
            }
            branch.refine()?;
            let trial = branch.trial()?;
            Ok(Simpler { squares: trial.foretold_squares(&trial.fit), trial, left_out })
        };
        (0..highest).map(below).collect()
    }

    /// Asks again of what others are forms of, now beside these: a friction that falls with the speed hides a
    /// viscous friction that rises with it. It has a name of its own where a form of it has one; where none
    /// has, it is certain, and may be named with its family.
    fn judge_beside_forms(&self, trial: &Trial, judged: &mut [Judged]) {
        let requires = |form: &Judged, place: usize| {
            let members = (trial.member(form.place), trial.member(place));
            let (Some(form), Some(simpler)) = members else { return false };
            trial.problem.hypotheses[form.hypothesis].requires.contains(&simpler.hypothesis)
        };
        let forms_of = |own: &Judged| -> Option<bool> {
            let forms: Vec<&Judged> = judged.iter().filter(|form| requires(form, own.place)).collect();
            (!forms.is_empty()).then(|| forms.iter().any(|form| form.named))
        };
        let hidden = judged.iter().enumerate();
        let hidden = hidden.filter(|(_, own)| !own.named && self.may_have_a_name(own.place));
        let hidden: Vec<(usize, bool)> =
            hidden.filter_map(|(index, own)| Some((index, forms_of(own)?))).collect();
        let initial = trial.foretold_squares(&trial.fit_with(|place| place < self.declared));
        let with = trial.foretold_squares(&trial.fit);
        for (index, form_is_named) in hidden {
            let own = &mut judged[index];
            let Some(member) = trial.member(own.place) else { continue };
            let squares = Squares {
                initial: initial.clone(),
                without: trial.foretold_squares(&trial.fit_with(|place| place != own.place)),
                with: with.clone(),
            };
            let certainty = certainty(&trial.problem, &trial.fit, member);
            own.significance = certainty.significance;
            own.certain = certainty.tail <= self.tail_of_a_name();
            own.named = own.certain && form_is_named && self.is_material(trial, member, &squares);
            own.size = trial.size(member, &squares);
        }
    }

    /// Asks again of small effects on joints where another effect has constants, now that these are refined
    /// without it: a sign that turns over another speed looks like some viscous friction.
    fn judge_small(&self, trial: &Trial, judged: &mut [Judged]) -> Result<(), IdentificationError> {
        let initial = trial.foretold_squares(&trial.fit_with(|place| place < self.declared));
        for judged in judged
            .iter_mut()
            .filter(|judged| judged.named && judged.size < self.options.thresholds.least_visible)
        {
            let own = &self.specs[judged.place];
            let has_constants = |spec: &EffectSpec| spec.joints == own.joints && !spec.constants.is_empty();
            let others = self.specs.iter().enumerate().filter(|(place, _)| *place != judged.place);
            let mut others = others.filter(|(place, _)| !self.refines_special_case(*place));
            if !others.any(|(_, spec)| has_constants(spec)) || self.fixed.absent(own)?.is_some() {
                continue;
            }
            let mut branch = self.clone();
            branch.remove(judged.place)?;
            branch.refine_those(|spec| spec.joints.iter().any(|joint| own.joints.contains(joint)))?;
            let refined = branch.trial()?;
            let squares = Squares {
                initial: initial.clone(),
                without: refined.foretold_squares(&refined.fit),
                with: trial.foretold_squares(&trial.fit),
            };
            let member = trial.member(judged.place);
            judged.named = member.is_some_and(|member| self.is_material(trial, member, &squares));
        }
        Ok(())
    }

    /// Names with a kind of the textbook what is as certain of it on other joints, and not as good as nothing
    /// beside their torques, where it has a name on most of them: where joints rub, all do that are seen to.
    fn name_families(&self, trial: &Trial, judged: &mut [Judged]) {
        let least = self.options.thresholds.negligible_share().powi(2);
        let is_there = |place: usize, torque: usize| {
            let whole = trial.torque(torque).right_hand_side();
            trial.member(place).is_some_and(|member| trial.size_beside(member, &[], torque) >= least * whole)
        };
        for kind in self.fixed.catalogue.kinds().filter(|kind| kind.joint_property().is_some()) {
            let is_member = |judged: &&mut Judged| {
                let is_of_kind = self.specs[judged.place].kind == kind.name();
                let mut torques = 0..trial.problem.torques.len();
                judged.certain
                    && is_of_kind
                    && self.may_have_a_name(judged.place)
                    && torques.any(|torque| is_there(judged.place, torque))
            };
            let members: Vec<&mut Judged> = judged.iter_mut().filter(is_member).collect();
            let named = members.iter().filter(|member| member.named).count();
            if 2 * named >= members.len() {
                members.into_iter().for_each(|member| member.named = true);
            }
        }
    }

    pub(super) fn remove(&mut self, place: usize) -> Result<(), IdentificationError> {
        let design = self.design()?;
        self.parameters.drain(design.effect_parameters(place));
        self.specs.remove(place);
        match place.checked_sub(self.declared) {
            Some(found) => drop(self.chosen.alternatives.remove(found)),
            None => self.declared -= 1,
        }
        Ok(())
    }

    /// Whether an effect is one of the robot, and not of its log, was not found to be uncertain, does what
    /// its name says, and refines neither its special case nor a friction by how that turns.
    pub(super) fn may_have_a_name(&self, place: usize) -> bool {
        let EffectSpec { kind, joints, .. } = &self.specs[place];
        let of_the_log = self.fixed.catalogue.kind(kind).is_ok_and(EffectKind::is_of_the_log);
        let without_a_name = self.uncertain.iter().chain(&self.bent);
        !of_the_log
            && !self.refines_special_case(place)
            && !self.is_how_a_friction_turns(place)
            && !without_a_name.into_iter().any(|(other, on)| other == kind && on == joints)
    }

    /// How improbable an effect must be by chance to have a name: for all hypotheses together it is
    /// `false_name_probability`.
    pub(super) fn tail_of_a_name(&self) -> f64 {
        self.options.thresholds.false_name_probability / self.chosen.hypotheses.max(1) as f64
    }

    fn judge(&self, whole: &Trial, levels: &BTreeMap<usize, usize>, simpler: &[Simpler]) -> Vec<Judged> {
        let limit = self.tail_of_a_name();
        let all = whole.foretold_squares(&whole.fit);
        let judged = |(&member, &place): (&Member, &usize)| -> Option<Judged> {
            if place < self.declared {
                return None;
            }
            let level = levels.get(&place).copied();
            // What others are forms of is judged without these; a form beside the simpler ones only.
            let beside = match level {
                Some(level) => simpler.get(level),
                None if whole.is_required(&member)
                    || self.is_refined(place)
                    || self.is_leaned_on(whole, member) =>
                {
                    simpler.first()
                }
                None => None,
            };
            let (trial, own) = match beside {
                Some(beside) => (&beside.trial, beside.place(place)),
                None => (whole, place),
            };
            let own_member = trial.member(own)?;
            let with = trial.foretold_squares(&trial.fit);
            let mut without = trial.foretold_squares(&trial.fit_with(|other| other != own));
            let below = level.map(|level| simpler[level - 1].squares.as_slice()).unwrap_or_default();
            lower(&mut without, below);
            let initial = trial.foretold_squares(&trial.fit_with(|place| place < self.declared));
            let squares = Squares { initial, without, with };
            let material = match level {
                Some(_) => {
                    self.is_form_material(trial, own_member, &squares)
                        || self.is_form_material_beside_all(whole, member, place, below)
                }
                None => self.is_material(trial, own_member, &squares),
            };
            let certainty = certainty(&trial.problem, &trial.fit, own_member);
            let material = material && self.may_have_a_name(place);
            let without = whole.fit_with(|other| other != place);
            Some(Judged {
                place,
                size: trial.size(own_member, &squares),
                significance: certainty.significance,
                gain: whole.gain(&whole.foretold_squares(&without), &all),
                folds: whole.better_folds(&without),
                certain: certainty.tail <= limit,
                named: certainty.tail <= limit && material,
            })
        };
        whole.members.par_iter().zip(&whole.places).filter_map(judged).collect()
    }

    /// Whether a form of something simpler is worth a name of its own: it must take away most of what the
    /// simpler ones leave beyond the noise, be a share of the torque, and be large beside what it is a form
    /// of or leave next to nothing but noise.
    pub(super) fn is_form_material(&self, trial: &Trial, member: Member, squares: &Squares) -> bool {
        let hypothesis = &trial.problem.hypotheses[member.hypothesis];
        hypothesis.torques.iter().any(|&torque| {
            let whole = trial.torque(torque).right_hand_side().max(f64::MIN_POSITIVE);
            let (without, with) = (squares.without[torque], squares.with[torque]);
            let taken = (without - with).max(0.0);
            let simpler =
                trial.members.iter().filter(|other| hypothesis.requires.contains(&other.hypothesis));
            let simpler: Vec<(usize, f64)> =
                simpler.flat_map(|&other| trial.values_of(other, torque)).collect();
            let of_simpler = trial.torque(torque).size_of(&simpler);
            let [left_without, left_with] =
                [without, with].map(|squares| self.beyond_noise(trial, torque, squares));
            !self.is_as_it_was(torque, (without / trial.torque(torque).rows().max(1.0)).sqrt())
                && taken >= self.options.thresholds.least_share * without
                && taken >= self.options.thresholds.least_share_of_kin * left_without
                && taken * left_without >= self.options.thresholds.least_of_others * of_simpler * left_with
                && (taken / whole).sqrt() >= self.options.thresholds.least_size
        })
    }

    /// What of the squares left of a torque is no noise. Noise cannot be taken away, and what is left is
    /// known no better than errors are told apart.
    fn beyond_noise(&self, trial: &Trial, torque: usize, squares: f64) -> f64 {
        let noise = trial.torque(torque).rows() * self.noise[torque].powi(2);
        let unknown = (self.options.thresholds.same_error.powi(2) - 1.0) * noise;
        (squares - noise).max(unknown).max(f64::MIN_POSITIVE)
    }

    /// The same beside all other forms: where two of them are there, neither takes most of what the simpler
    /// ones leave. `simpler` is what these leave of each torque.
    fn is_form_material_beside_all(
        &self,
        whole: &Trial,
        member: Member,
        place: usize,
        simpler: &[f64],
    ) -> bool {
        let mut without = whole.foretold_squares(&whole.fit_with(|other| other != place));
        lower(&mut without, simpler);
        let squares = Squares { initial: Vec::new(), without, with: whole.foretold_squares(&whole.fit) };
        self.is_form_material(whole, member, &squares)
    }

    /// Whether a torque's residual is no larger than it was when the held model was identified: then nothing
    /// has changed there since.
    pub(super) fn is_as_it_was(&self, torque: usize, rmse: f64) -> bool {
        let margin = self.options.thresholds.same_error;
        self.input.held.as_ref().is_some_and(|held| rmse <= margin * held.left[torque])
    }

    /// Whether what an effect takes away where it is foretold is worth a name.
    ///
    /// It must take away a share of the residual of a torque that it acts on, be a share of that torque, and
    /// be large beside what others took or leave next to nothing but noise. Where the other parameters have
    /// taken up most of it, it is to be seen on any torque, and must be a share of its torque by itself.
    pub(super) fn is_material(&self, trial: &Trial, member: Member, squares: &Squares) -> bool {
        let others = self.interchangeable(trial, member);
        let own = |torque: usize| trial.size_beside(member, &others, torque);
        let (seen, absorbed) = self.is_seen_or_absorbed(trial, member, squares, own);
        seen || absorbed
    }

    /// Whether what an effect takes is to be seen on a torque that it acts on; and whether the other
    /// parameters have taken up most of what it is, which is `own` squares of each torque.
    pub(super) fn is_seen_or_absorbed(
        &self,
        trial: &Trial,
        member: Member,
        squares: &Squares,
        own: impl Fn(usize) -> f64,
    ) -> (bool, bool) {
        let thresholds = &self.options.thresholds;
        let Squares { initial, without, with } = squares;
        let hypothesis = &trial.problem.hypotheses[member.hypothesis];
        let (mut largest_share, mut size): (f64, f64) = (0.0, 0.0);
        let mut seen = false;
        for torque in 0..trial.problem.torques.len() {
            let rows = trial.torque(torque);
            let (before, after) = (without[torque], with[torque]);
            let rmse = (initial[torque] / rows.rows().max(1.0)).sqrt();
            if rows.rows() == 0.0 || self.is_as_it_was(torque, rmse) {
                continue;
            }
            let whole = rows.right_hand_side().max(f64::MIN_POSITIVE);
            let taken = (before - after).max(0.0);
            let share = taken / before;
            largest_share = largest_share.max(share);
            let by_others = (initial[torque] - before).max(0.0);
            let together = ((initial[torque] - with[torque]).max(0.0) / whole).sqrt();
            seen |= hypothesis.torques.contains(&torque)
                && together >= thresholds.least_size
                && share >= thresholds.least_share
                && taken * self.beyond_noise(trial, torque, before)
                    >= thresholds.least_of_others * by_others * self.beyond_noise(trial, torque, after)
                && (taken / whole).sqrt() >= thresholds.least_size;
            size = size.max((own(torque) / whole).sqrt());
        }
        (seen, largest_share >= thresholds.least_share && size >= thresholds.least_visible)
    }
}

impl Simpler {
    /// The place in it of an effect at `place` in the whole model.
    fn place(&self, place: usize) -> usize {
        place - self.left_out.iter().filter(|left_out| **left_out < place).count()
    }
}

/// What is less of what two models leave of each torque: constants as they are with a form, and as they are
/// without.
fn lower(squares: &mut [f64], others: &[f64]) {
    squares.iter_mut().zip(others).for_each(|(own, other)| *own = own.min(*other));
}
