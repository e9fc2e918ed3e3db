//! Algorithm 1, lines 10 to 17: select, measure, estimate, relax; and, where the model may grow, look for
//! what it lacks.

use crate::constraint::{Certainty, Constraint};
use crate::end::{EndCriterion, FixedCount};
use crate::experiment::check_noise;
use crate::growth::{Found, Growth, Rivalry, rivals_to_separate, saved_by_family, unconfirmed};
use crate::motion::MotionDataset;
use crate::planner::{Belief, MeasuredSoFar, NoneAllowed, Plan, Policy, plan};
use crate::random::{Purpose, random};
use crate::relaxation::{ConditionRelaxation, Relaxation};
use crate::selection::{MotionCandidates, Selection, SmallestCondition, Triangle};
use crate::{CurriculumError, CurriculumRun, Experiment, IterationRecord};
use phiw_estimation::{
    Estimate, Estimator, Evidence, EvidenceSettings, MotionLog, Robot, RobotModel, RowsAt, TorqueMisfit,
};
use phiw_identification::EffectSpec;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::borrow::Cow;

/// A curriculum: what it is about, and who decides what.
pub struct Curriculum<'a> {
    /// The robot as declared.
    pub robot: &'a Robot,
    /// The motions to choose from.
    pub dataset: &'a MotionDataset,
    /// Their factors under the declared model, made once for all runs.
    pub candidates: &'a MotionCandidates,
    /// Where measurements come from.
    pub experiment: &'a dyn Experiment,
    /// Line 12: which motion.
    pub selection: &'a dyn Selection,
    /// The constraint (12).
    pub constraint: &'a dyn Constraint,
    /// Line 15: how it is relaxed.
    pub relaxation: &'a dyn Relaxation,
    /// Line 14: how parameters are estimated.
    pub estimator: &'a dyn Estimator,
    /// Who looks for what the model lacks; none in the paper.
    pub growth: Option<&'a dyn Growth>,
    /// When it is over.
    pub end: &'a dyn EndCriterion,
    /// Which instants of a log become rows.
    pub rows_at: RowsAt,
    /// What the loop itself decides.
    pub settings: CurriculumSettings,
}

/// What the loop itself decides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurriculumSettings {
    /// What happens where the constraint allows no motion. Default: [`NoneAllowed::Refuse`].
    pub none_allowed: NoneAllowed,
    /// Time between the samples by which rival beliefs are compared \[s\]. Shorter costs time; longer misses
    /// what is quick. Default: 0.02, since people move slowly against it.
    pub rivalry_period_s: f64,
    /// How often after one log [`Growth`] is asked again once the likelihood has refuted one of its answers,
    /// which is then excluded. Each time costs a search and some fits. Default: 3, a limit on the time and no
    /// finding.
    pub most_answers: usize,
}

impl Default for CurriculumSettings {
    fn default() -> Self {
        CurriculumSettings { none_allowed: NoneAllowed::default(), rivalry_period_s: 0.02, most_answers: 3 }
    }
}

/// A belief with what was measured, and how sure it is.
#[derive(Clone)]
struct Learning {
    evidence: Evidence,
    model: RobotModel,
    estimate: Estimate,
}

impl<'a> Curriculum<'a> {
    /// A curriculum with the paper's choices in everything that is not asked for here: the smallest cond
    /// (11), relaxed with cond (20), five iterations, no growth. Set what should be otherwise.
    ///
    /// A plan is refused where no motion keeps the robot standing; the paper's experiments run the least
    /// violation instead ([`CurriculumSettings::none_allowed`]).
    pub fn new(
        robot: &'a Robot,
        (dataset, candidates): (&'a MotionDataset, &'a MotionCandidates),
        experiment: &'a dyn Experiment,
        constraint: &'a dyn Constraint,
        estimator: &'a dyn Estimator,
    ) -> Self {
        Curriculum {
            robot,
            dataset,
            candidates,
            experiment,
            selection: &SmallestCondition,
            constraint,
            relaxation: &ConditionRelaxation::OF_THE_PAPER,
            estimator,
            growth: None,
            end: &FixedCount(5),
            rows_at: RowsAt::default(),
            settings: CurriculumSettings::default(),
        }
    }

    /// Goes on with a run until it ends. `saved` is called after each iteration, with the run as it is then.
    ///
    /// # Errors
    /// As [`Self::step`], or what `saved` returns.
    pub fn run<E: From<CurriculumError>>(
        &self,
        run: &mut CurriculumRun,
        mut saved: impl FnMut(&CurriculumRun) -> Result<(), E>,
    ) -> Result<(), E> {
        while run.ended.is_none() {
            self.step(run)?;
            saved(run)?;
        }
        Ok(())
    }

    /// One iteration. After an error the run is as it was.
    ///
    /// The result depends on the run and its seed alone: not on threads, nor on whether the run was
    /// interrupted before.
    ///
    /// # Errors
    /// The run is not of this robot, the robot can not be run, or nothing can be estimated.
    pub fn step(&self, run: &mut CurriculumRun) -> Result<(), CurriculumError> {
        check_noise(self.robot, self.experiment, self.estimator)?;
        let Some(plan) = self.plan(run)? else { return Ok(()) };
        let motion = &self.dataset.motions()[plan.choice.motion];
        let mut noise = random(run.seed, run.history.len(), Purpose::Experiment);
        let trial = self.experiment.perform(self.robot, &run.model, motion, &mut noise)?;
        let mut next = run.clone();
        next.first_alpha = Some(plan.first_alpha);
        let (mut estimate, mut misfit) = (None, Vec::new());
        // A base that tilts is not the fixed base of the columns: the log of a fall is of another robot.
        if trial.fell_at_s.is_some() {
            next.excluded.push(plan.choice.motion);
        } else {
            let learning = self.learn(&mut next, &trial.measured)?;
            misfit = self.misfit(&learning)?;
            next.model = learning.model;
            next.evidence = Some(learning.evidence);
            next.certainty = Certainty::of(self.robot, &learning.estimate);
            estimate = Some(learning.estimate);
        }
        let condition_number = self.measured(&next)?.map(|measured| measured.condition_number());
        let (before, after) = (run.model.parameters(self.robot)?, next.model.parameters(self.robot)?);
        let torque_change = match run.model.specs() == next.model.specs() {
            true => self.candidates_of(&next.model)?.torque_change(&before, &after),
            false => None,
        };
        next.history.push(IterationRecord {
            motion: motion.name.clone(),
            allowed: if plan.forced { 0 } else { plan.allowed.len() },
            forced: plan.forced,
            alpha: plan.alpha,
            margin_m: Some(plan.safety.margin_m).filter(|margin| margin.is_finite()),
            sure_margin_m: Some(plan.safety.sure_margin_m).filter(|margin| margin.is_finite()),
            kept: trial.kept,
            fell_at_s: trial.fell_at_s,
            still_share: trial.measured.still_share(),
            tracking_error: trial.tracking_error,
            condition_number: condition_number.filter(|cond| cond.is_finite()),
            torque_change,
            torque_uncertainty: match &estimate {
                Some(estimate) => {
                    let candidates = self.candidates_of(&next.model)?;
                    let covariance = estimate.covariance.as_ref();
                    covariance.and_then(|known| candidates.whole().uncertainty_of(known, self.dataset.rows()))
                }
                None => run.history.last().and_then(|record| record.torque_uncertainty),
            },
            separates: plan.separates,
            model: next.model.clone(),
            standard_deviations: estimate
                .iter()
                .flat_map(|estimate| &estimate.standard_deviations)
                .map(|std| Some(*std).filter(|std| std.is_finite()))
                .collect(),
            choice: plan.choice,
            misfit,
        });
        next.ended = self.end.reason(&next.history);
        *run = next;
        Ok(())
    }

    fn evidence_settings(&self) -> EvidenceSettings {
        EvidenceSettings { in_order: self.estimator.in_order(), ..self.rows_at.into() }
    }

    /// Line 14, and the search for what the model lacks.
    fn learn(&self, run: &mut CurriculumRun, measured: &MotionLog) -> Result<Learning, CurriculumError> {
        let evidence = match run.evidence.take() {
            Some(evidence) => evidence,
            None => Evidence::none(&self.robot.design_of(&run.model)?, self.evidence_settings())?,
        };
        let mut learning = self.believe(evidence, &run.model, std::slice::from_ref(measured))?;
        let Some(growth) = self.growth else { return Ok(learning) };
        run.logs.push(measured.clone());
        let mut doubted = open_rivalry(&run.rivals, &run.history).is_some();
        let (mut found, mut believed, mut refuted) = (Found::default(), Vec::new(), Vec::new());
        // Effects that the likelihood refutes are excluded, and the search is repeated without them.
        for _ in 0..self.settings.most_answers {
            found = growth.look(self.robot, &learning.model, &run.logs, doubted, &refuted)?;
            (learning, believed) = self.confirmed(learning, &found, &run.logs, growth.least_gain())?;
            let wrong: Vec<EffectSpec> =
                found.effects().into_iter().filter(|effect| !believed.contains(effect)).collect();
            if wrong.is_empty() {
                break;
            }
            refuted.extend(wrong);
            doubted = false;
        }
        run.rivals.clear();
        for effects in found.rivals.into_iter().filter(|[named, _]| believed.contains(named)) {
            let instead =
                |spec: &EffectSpec| if *spec == effects[0] { effects[1].clone() } else { spec.clone() };
            let other: Vec<EffectSpec> = believed.iter().map(instead).collect();
            let other = self.fitted(&learning, &learning.model, &other, &run.logs)?;
            run.rivals.push(Rivalry { beliefs: [learning.model.clone(), other.model], effects });
        }
        Ok(learning)
    }

    /// The model with those of the `answers` that the estimator's likelihood confirms: the least of them goes
    /// until each is worth `least_gain`.
    fn confirmed(
        &self,
        learning: Learning,
        found: &Found,
        logs: &[MotionLog],
        least_gain: f64,
    ) -> Result<(Learning, Vec<EffectSpec>), CurriculumError> {
        let mut answers = found.answers.clone();
        let from = found.fitted.as_ref().unwrap_or(&learning.model);
        let mut with = self.fitted(&learning, from, &answers.concat(), logs)?;
        while let Some(negative_log_likelihood) = self.negative_log_likelihood(&with)? {
            let (mut gains, mut without) = (Vec::new(), Vec::new());
            for place in 0..answers.len() {
                let others = [&answers[..place], &answers[place + 1..]].concat().concat();
                let learning = self.fitted(&learning, &with.model, &others, logs)?;
                let grown = self.negative_log_likelihood(&learning)?.unwrap_or(f64::INFINITY)
                    - negative_log_likelihood;
                gains.push(saved_by_family(grown, answers[place].len()));
                without.push(learning);
            }
            let Some(place) = unconfirmed(&gains, least_gain) else { break };
            answers.remove(place);
            with = without.swap_remove(place);
        }
        Ok((with, answers.concat()))
    }

    /// −log L of what was learnt, if the estimator knows it.
    fn negative_log_likelihood(&self, learning: &Learning) -> Result<Option<f64>, CurriculumError> {
        let design = self.robot.design_of(&learning.model)?;
        Ok(self.estimator.negative_log_likelihood(
            &design,
            &learning.evidence,
            &learning.estimate.parameters,
        )?)
    }

    /// Whether the estimator's story of the noise holds, torque by torque.
    fn misfit(&self, learning: &Learning) -> Result<Vec<TorqueMisfit>, CurriculumError> {
        let design = self.robot.design_of(&learning.model)?;
        let Learning { evidence, estimate, .. } = learning;
        Ok(self.estimator.misfit(&design, evidence, estimate)?.unwrap_or_default())
    }

    /// The same with other `effects` beside the declared ones, fitted to all logs again from a model on.
    fn fitted(
        &self,
        learning: &Learning,
        from: &RobotModel,
        effects: &[EffectSpec],
        logs: &[MotionLog],
    ) -> Result<Learning, CurriculumError> {
        let specs = &[self.robot.declared(), effects].concat();
        if learning.model.specs() == *specs {
            return Ok(learning.clone());
        }
        let model = from.with_effects(self.robot, specs)?;
        let evidence = Evidence::none(&self.robot.design_of(&model)?, self.evidence_settings())?;
        self.believe(evidence, &model, logs)
    }

    /// Takes in logs and estimates.
    fn believe(
        &self,
        mut evidence: Evidence,
        present: &RobotModel,
        logs: &[MotionLog],
    ) -> Result<Learning, CurriculumError> {
        let design = self.robot.design_of(present)?;
        for log in logs {
            evidence.add(&design, log)?;
        }
        let parameters = present.parameters(self.robot)?;
        let estimate = self.estimator.estimate(&design, &evidence, present, &parameters)?;
        let model = present.with_parameters(self.robot, &present.specs(), &estimate.parameters)?;
        Ok(Learning { evidence, model, estimate })
    }

    /// The factors of the motions under all columns of a belief: those made once, unless the model has grown.
    ///
    /// # Errors
    /// The belief is of another robot.
    pub fn candidates_of(&self, model: &RobotModel) -> Result<Cow<'_, MotionCandidates>, CurriculumError> {
        if model.specs() == self.robot.declared() {
            return Ok(Cow::Borrowed(self.candidates));
        }
        MotionCandidates::of_model(self.robot, model, self.dataset, self.candidates.weights()).map(Cow::Owned)
    }

    /// R of all that was measured over the declared parameters, whose cond decides: the next motion (11), and
    /// how far the constraint is relaxed (20).
    ///
    /// The columns of effects that were found are left out. With them cond is that of other parameters, in
    /// other units, than before they were found; the offset of a spring is so nearly a weight that cond grows
    /// five-fold, the constraint is never relaxed again, and the same safe motion is asked for until the end.
    /// Motions that distinguish effects are chosen by [`Rivalry`].
    ///
    /// # Errors
    /// The run is not of this robot.
    pub fn measured(&self, run: &CurriculumRun) -> Result<Option<Triangle>, CurriculumError> {
        let Some(evidence) = run.evidence.as_ref().filter(|evidence| !evidence.is_empty()) else {
            return Ok(None);
        };
        Ok(Some(self.candidates.measured(evidence)?))
    }

    /// What the next iteration would do; none once the run has ended. For a real robot this is all there is
    /// to do before it moves.
    ///
    /// # Errors
    /// As [`plan()`], or the run is not of this robot or these motions.
    pub fn plan(&self, run: &CurriculumRun) -> Result<Option<Plan>, CurriculumError> {
        if run.ended.is_some() {
            return Ok(None);
        }
        let triangle = self.measured(run)?;
        let condition_numbers: Vec<_> = run.history.iter().map(|record| record.condition_number).collect();
        let torque_uncertainties: Vec<_> =
            run.history.iter().map(|record| record.torque_uncertainty).collect();
        let belief = Belief {
            robot: self.robot,
            dataset: self.dataset,
            candidates: self.candidates,
            model: &run.model,
            certainty: run.certainty.as_ref(),
            initial: &run.initial,
            rivalry: open_rivalry(&run.rivals, &run.history),
        };
        let measured = MeasuredSoFar {
            triangle: triangle.as_ref(),
            condition_numbers: &condition_numbers,
            torque_uncertainties: &torque_uncertainties,
            first_alpha: run.first_alpha,
            excluded: &run.excluded,
            history: &run.history,
        };
        plan(&belief, &measured, &self.policy(run.seed)).map(Some)
    }

    /// Who decides what in a plan of this curriculum.
    fn policy(&self, seed: u64) -> Policy<'_> {
        Policy {
            selection: self.selection,
            constraint: self.constraint,
            relaxation: self.relaxation,
            none_allowed: self.settings.none_allowed,
            rivalry_period_s: self.settings.rivalry_period_s,
            seed,
        }
    }
}

/// The rivals that the next motion is to tell apart.
fn open_rivalry<'a>(rivals: &'a [Rivalry], history: &[IterationRecord]) -> Option<&'a Rivalry> {
    let names: Vec<[String; 2]> = rivals.iter().map(Rivalry::names).collect();
    let separated: Vec<Option<[String; 2]>> = history.iter().map(|record| record.separates.clone()).collect();
    rivals_to_separate(&names, &separated).map(|index| &rivals[index])
}

/// The first belief of a run: [`RobotModel::unreliable`] about `truth`, the same for the same seed.
pub fn unreliable_model(truth: &RobotModel, seed: u64) -> RobotModel {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(0);
    truth.unreliable(&mut rng)
}

impl MotionCandidates {
    /// RMS over all motions of how far the torques move from one parameter vector to another, over their RMS;
    /// none if they are of different models.
    pub fn torque_change(&self, before: &[f64], after: &[f64]) -> Option<f64> {
        let everything: &Triangle = self.everything();
        if before.len() != after.len() || after.len() != everything.size() {
            return None;
        }
        let difference: Vec<f64> = after.iter().zip(before).map(|(after, before)| after - before).collect();
        let change = (everything.product_squared(&difference) / everything.product_squared(after)).sqrt();
        change.is_finite().then_some(change)
    }
}
