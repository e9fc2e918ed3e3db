//! The loop closed by the estimator's own likelihood.

use crate::candidates::{candidates, is_alike, ranges};
use crate::completion::Fitted;
use crate::constants::with_foretold;
use crate::contest::{Contender, ScoreTestSettings, Winner};
use crate::hypothesis::Hypothesis;
use phiw_curriculum::CurriculumError;
use phiw_curriculum::growth::{Found, Growth};
use phiw_effects::Catalogue;
use phiw_estimation::{
    ConcentratedLikelihood, Estimator, Evidence, EvidenceSettings, Gain, MotionLikelihood, MotionLog, Robot,
    RobotModel, RowsAt,
};
use phiw_identification::{Design, EffectSpec};
use std::sync::Arc;

/// Asks of every effect of the catalogue what it would save of −log L ([`MotionLikelihood::gains`]), fits the
/// few best in full, adds the simplest of those that explain alike if it is worth its price, and asks again.
///
/// The likelihood knows that noise moves the robot, and needs no residual with a colour: what many rows say
/// together is enough, however far below the noise of one row an effect is. Effects whose columns look ahead
/// in time or need derivatives of the model's torque (delay, elasticity, an encoder's offset) are no
/// candidates: what is known when a period begins is not enough to identify them. [`crate::TraceResidual`]
/// asks for them.
#[derive(Clone)]
pub struct ScoreTest {
    /// The estimator that the curriculum runs with.
    pub estimator: MotionLikelihood,
    /// The effects that are asked for; the robot's own catalogue has to know them. Default: all that phiw
    /// knows.
    pub catalogue: Arc<Catalogue>,
    /// When an effect is believed.
    pub settings: ScoreTestSettings,
    /// Finds the noise that the estimator counts on, in the logs that are asked about; none where its own is
    /// known.
    pub noise: Option<ConcentratedLikelihood>,
}

impl ScoreTest {
    /// For a curriculum with this estimator.
    pub fn new(estimator: MotionLikelihood) -> Self {
        ScoreTest {
            estimator,
            catalogue: Arc::default(),
            settings: ScoreTestSettings::default(),
            noise: None,
        }
    }

    /// For a curriculum whose estimator is told no noise.
    pub fn of_unknown_noise(estimator: ConcentratedLikelihood) -> Self {
        let likelihood = MotionLikelihood::new(Vec::new()).standing_on(estimator.standing_on.clone());
        ScoreTest { noise: Some(estimator), ..ScoreTest::new(likelihood) }
    }

    /// The same with the noise that `model`, which has been fitted to them, leaves of these logs.
    ///
    /// # Errors
    /// The logs are not of this robot.
    pub fn knowing(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
    ) -> Result<Self, CurriculumError> {
        let Some(concentrated) = &self.noise else { return Ok(self.clone()) };
        let design = robot.design_of(model)?;
        let evidence = in_order(&design, logs)?;
        let noise = concentrated.noise(&design, &evidence, &model.parameters(robot)?)?;
        let torque_noise = noise.iter().map(|noise| noise.std).collect();
        let estimator = MotionLikelihood { torque_noise, ..self.estimator.clone() };
        Ok(ScoreTest { estimator, noise: None, ..self.clone() })
    }

    /// The same with the noise that is left once these effects are in the model, and the model fitted with
    /// it; `known` counts on the noise from before, with which the model was `fitted`.
    fn known_with(
        &self,
        robot: &Robot,
        known: &Self,
        fitted: RobotModel,
        effects: &[EffectSpec],
        logs: &[MotionLog],
    ) -> Result<(Self, RobotModel), CurriculumError> {
        let Some(concentrated) = &self.noise else { return Ok((known.clone(), fitted)) };
        let specs = fitted.specs();
        let design = robot.design_of(&fitted)?;
        let evidence = in_order(&design, logs)?;
        let estimate = concentrated.estimate(&design, &evidence, &fitted, &fitted.parameters(robot)?)?;
        let fitted = fitted.with_parameters(robot, &specs, &estimate.parameters)?;
        let test = self.knowing(robot, &fitted, logs)?;
        let fitted = test.fitted(robot, &fitted, effects, logs)?;
        Ok((test, fitted))
    }

    /// Every effect of the catalogue on every joint that a fit leaves something of, each with the constants
    /// that save most, the best first by gain less price. `model` has been fitted to the logs.
    ///
    /// # Errors
    /// The logs are not of this robot.
    pub fn rank(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
    ) -> Result<Vec<Gain>, CurriculumError> {
        let ranges = ranges(robot, logs);
        let present = model.specs();
        let candidates = candidates(robot, &self.catalogue, &ranges, &present);
        let gains = self.estimator.gains(robot, model, logs, &candidates)?;
        let mut best = Vec::new();
        // Constants of one effect on one site follow each other.
        let mut start = 0;
        for alike in candidates.chunk_by(is_alike) {
            let own = &gains[start..start + alike.len()];
            start += alike.len();
            let known = || own.iter().flatten();
            let Some(first) = known().max_by(|a, b| a.merit.total_cmp(&b.merit)) else { continue };
            let sum: f64 = known().map(|gain| (gain.merit - first.merit).exp()).sum();
            best.push(Gain { merit: first.merit + (sum / alike.len() as f64).ln(), ..first.clone() });
        }
        best.sort_by(|a, b| b.merit.total_cmp(&a.merit));
        Ok(best)
    }

    /// The model fitted to all logs with these effects in the place of its own.
    ///
    /// # Errors
    /// The logs are not of this robot.
    pub fn fitted(
        &self,
        robot: &Robot,
        model: &RobotModel,
        effects: &[EffectSpec],
        logs: &[MotionLog],
    ) -> Result<RobotModel, CurriculumError> {
        Ok(self.fit(robot, model, effects, logs)?.0)
    }

    /// [`Self::fitted`], and −log L of it.
    pub(crate) fn fit(
        &self,
        robot: &Robot,
        model: &RobotModel,
        effects: &[EffectSpec],
        logs: &[MotionLog],
    ) -> Result<(RobotModel, f64), CurriculumError> {
        let specs = [robot.declared(), effects].concat();
        let model = model.with_effects(robot, &specs)?;
        let design = robot.design_of(&model)?;
        let mut evidence = Evidence::none(&design, RowsAt::Periods)?;
        for log in logs {
            evidence.add(&design, log)?;
        }
        let present = model.parameters(robot)?;
        let estimate = self.estimator.estimate(&design, &evidence, &model, &present)?;
        let negative_log_likelihood =
            self.estimator.negative_log_likelihood(&design, &evidence, &estimate.parameters)?;
        let negative_log_likelihood = negative_log_likelihood
            .filter(|negative_log_likelihood| negative_log_likelihood.is_finite())
            .unwrap_or(f64::INFINITY);
        Ok((model.with_parameters(robot, &specs, &estimate.parameters)?, negative_log_likelihood))
    }

    /// Effects and families that may be missing, the best first; those that are `refuted` are none.
    fn hypotheses(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        refuted: &[EffectSpec],
    ) -> Result<Vec<Hypothesis>, CurriculumError> {
        let mut ranked = self.rank(robot, model, logs)?;
        ranked.retain(|gain| !refuted.iter().any(|effect| is_alike(effect, &gain.effect)));
        let present = model.specs();
        let mut all: Vec<Hypothesis> = ranked.iter().cloned().map(Hypothesis::of_one).collect();
        for kind in self.catalogue.kinds().filter(|kind| kind.joint_property().is_some()) {
            let is_kind = |spec: &EffectSpec| spec.kind == kind.name();
            let members = ranked.iter().filter(|gain| is_kind(&gain.effect)).cloned().collect();
            let present = present.iter().filter(|spec| is_kind(spec)).count();
            let asked = kind.sites(robot.tree()).len().saturating_sub(present);
            all.extend(Hypothesis::of_family(members, asked, self.estimator.score.parameter_price));
        }
        all.sort_by(|a, b| b.merit.total_cmp(&a.merit));
        Ok(all)
    }

    /// The effects of the hypothesis that is believed of `all`, the best first, and pairs of them and what is
    /// as likely; none where none is worth its price.
    ///
    /// Where those that promise most hold nothing once they are fitted, the next are: far from nothing, the
    /// score may promise anything.
    fn best(
        &self,
        robot: &Robot,
        model: &RobotModel,
        known: &[EffectSpec],
        mut all: &[Hypothesis],
        logs: &[MotionLog],
    ) -> Result<Option<Answer>, CurriculumError> {
        loop {
            let merits: Vec<f64> = all.iter().map(|hypothesis| hypothesis.merit).collect();
            let (near, others) = all.split_at(self.settings.shortlist(&merits));
            if near.is_empty() {
                return Ok(None);
            }
            let (_, without) = self.fit(robot, model, known, logs)?;
            let (mut answers, contenders) = self.contenders((robot, model), known, near, (logs, without))?;
            let Some(Winner { winner, rivals }) = self.settings.contest(&contenders) else {
                all = others;
                continue;
            };
            // A family has no rival that one motion could tell it from.
            let pair = |rival: usize| match (
                answers[winner].effects.as_slice(),
                answers[rival].effects.as_slice(),
            ) {
                ([own], [other]) => Some([own.clone(), other.clone()]),
                _ => None,
            };
            let rivals = rivals.into_iter().filter_map(pair).collect();
            let found = answers.swap_remove(winner);
            let (Fitted { effects, model: fitted, .. }, more) =
                self.completed(robot, found, (known, logs), without)?;
            let merit = contenders[winner].merit + more;
            return Ok(Some(Answer { effects, fitted, merit, rivals }));
        }
    }

    /// The effects of each of `near` once everything has been fitted again beside `known`, with their
    /// constants refined, and what it is then worth. The score predicts the gain of a large effect only
    /// roughly, and may predict as much for an effect that explains half of it.
    fn contenders(
        &self,
        (robot, model): (&Robot, &RobotModel),
        known: &[EffectSpec],
        near: &[Hypothesis],
        (logs, without): (&[MotionLog], f64),
    ) -> Result<(Vec<Fitted>, Vec<Contender>), CurriculumError> {
        let (mut answers, mut contenders) = (Vec::new(), Vec::new());
        for hypothesis in near {
            let found = self.fitted_best((robot, model), known, hypothesis, (logs, without))?;
            let merit = hypothesis.merit_of(without - found.cost);
            let effects = &found.effects;
            let size = effects.iter().map(|effect| size(robot, effect)).fold(0, usize::saturating_add);
            let rank = effects.first().and_then(|effect| self.catalogue.rank(&effect.kind));
            let rank = rank.unwrap_or(usize::MAX);
            contenders.push(Contender { merit, size, rank });
            answers.push(found);
        }
        Ok((answers, contenders))
    }

    /// The effects of a hypothesis with their best constants, fitted with what is `known`; −log L is
    /// `without` the hypothesis so large.
    fn fitted_best(
        &self,
        (robot, model): (&Robot, &RobotModel),
        known: &[EffectSpec],
        hypothesis: &Hypothesis,
        (logs, without): (&[MotionLog], f64),
    ) -> Result<Fitted, CurriculumError> {
        let specs = |gains: &[Gain]| gains.iter().map(|gain| gain.effect.clone()).collect::<Vec<_>>();
        let fit = |from: &RobotModel, foretold: &[Gain]| {
            let effects = [known, &specs(foretold)].concat();
            self.fit(robot, &with_foretold(from, foretold), &effects, logs)
        };
        let mut effects = self.refined(robot, model, logs, hypothesis.effects.clone())?;
        // What a score foretells may be far off; the fit begins with nothing.
        let (mut fitted, mut with) = self.fit(robot, model, &[known, &specs(&effects)].concat(), logs)?;
        for round in 0..self.settings.most_exchanges {
            let exchanged = self.exchanged(robot, &fitted, logs, &specs(&effects), round)?;
            let saved: f64 = exchanged.iter().map(|gain| gain.gain).sum();
            let is_worth = hypothesis.merit_of(without - with + saved) >= self.settings.least_merit;
            if saved < self.settings.least_exchange || !is_worth {
                break;
            }
            let (other, better) = fit(&fitted, &exchanged)?;
            if better >= with {
                break;
            }
            (effects, fitted, with) = (exchanged, other, better);
        }
        Ok(Fitted { effects: specs(&effects), model: fitted, cost: with })
    }
}

/// What is believed to be missing.
struct Answer {
    effects: Vec<EffectSpec>,
    /// The model fitted with them and with what was known before.
    fitted: RobotModel,
    /// −log L that they save, less their price.
    merit: f64,
    /// Pairs of them and their rivals.
    rivals: Vec<[EffectSpec; 2]>,
}

impl Growth for ScoreTest {
    fn name(&self) -> &'static str {
        "score_test"
    }

    fn look(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        _doubted: bool,
        refuted: &[EffectSpec],
    ) -> Result<Found, CurriculumError> {
        self.found(robot, model, logs, refuted)
    }

    fn least_gain(&self) -> f64 {
        self.settings.least_merit
    }
}

impl ScoreTest {
    fn found(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        refuted: &[EffectSpec],
    ) -> Result<Found, CurriculumError> {
        let mut found = Found::default();
        let mut test = self.knowing(robot, model, logs)?;
        // From the declared model on: what was found before may have been the wrong half of the truth.
        let mut model = match model.effects.len() == robot.declared().len() {
            true => model.clone(),
            false => test.fitted(robot, model, &[], logs)?,
        };
        let mut saved = 0.0;
        while found.answers.len() < self.settings.most_effects {
            let all = test.hypotheses(robot, &model, logs, refuted)?;
            let known = found.effects();
            let Some(answer) = test.best(robot, &model, &known, &all, logs)? else { break };
            found.rivals.extend(answer.rivals);
            found.answers.push(answer.effects);
            // What was missing was in the noise.
            (test, model) = self.known_with(robot, &test, answer.fitted, &found.effects(), logs)?;
            found.fitted = Some(model.clone());
            saved += answer.merit;
            test.settings = self.settings.beside(saved);
        }
        Ok(found)
    }
}

/// Logs with rows that are taken in order.
fn in_order(design: &Design, logs: &[MotionLog]) -> Result<Evidence, CurriculumError> {
    let settings = EvidenceSettings { in_order: true, ..RowsAt::Periods.into() };
    let mut evidence = Evidence::none(design, settings)?;
    for log in logs {
        evidence.add(design, log)?;
    }
    Ok(evidence)
}

/// Parameters and constants of an effect.
fn size(robot: &Robot, effect: &EffectSpec) -> usize {
    let built = robot.catalogue().build(effect, robot.tree());
    built.map_or(usize::MAX, |built| built.parameters().len() + effect.constants.len())
}
