//! Algorithm 1, lines 10 to 17: select, measure, estimate, relax.

use crate::estimation::RowsAt;
use crate::selection::{Choice, Question};
use crate::triangle::Triangle;
use crate::{
    Candidates, Constraint, CurriculumError, EndCriterion, Estimator, Evidence, Experiment, IterationRecord,
    Learnt, MotionDataset, Relaxation, Robot, RobotModel, Run, Safety, Selection,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// A curriculum: what it is about, and who decides what.
pub struct Curriculum<'a> {
    /// The robot as declared.
    pub robot: &'a Robot,
    /// The motions to choose from.
    pub dataset: &'a MotionDataset,
    /// Their factors, made once for all runs.
    pub candidates: &'a Candidates,
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
    /// When it is over.
    pub end: &'a dyn EndCriterion,
    /// Which instants of a log become rows.
    pub rows_at: RowsAt,
}

/// What a stream of random numbers is for. Each iteration has its own, so that nothing has to be remembered.
#[derive(Clone, Copy)]
enum Purpose {
    Selection = 1,
    Experiment = 2,
}

fn random(seed: u64, iteration: usize, purpose: Purpose) -> ChaCha8Rng {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(16 * (iteration as u64 + 1) + purpose as u64);
    random
}

impl Curriculum<'_> {
    /// Goes on with a run until it ends. `saved` is called after each iteration, with the run as it is then.
    ///
    /// # Errors
    /// As [`Self::step`], or what `saved` returns.
    pub fn run<E: From<CurriculumError>>(
        &self,
        run: &mut Run,
        mut saved: impl FnMut(&Run) -> Result<(), E>,
    ) -> Result<(), E> {
        while run.ended.is_none() {
            self.step(run)?;
            saved(run)?;
        }
        Ok(())
    }

    /// One iteration. After an error the run is as it was.
    ///
    /// The result depends on the run and its seed alone: not on threads, nor on whether the run was interrupted before.
    ///
    /// # Errors
    /// The run is not of this robot, the robot can not be run, or nothing can be estimated.
    pub fn step(&self, run: &mut Run) -> Result<(), CurriculumError> {
        let Some(plan) = self.plan(run)? else { return Ok(()) };
        let motion = &self.dataset.motions()[plan.choice.motion];
        let mut noise = random(run.seed, run.history.len(), Purpose::Experiment);
        let trial = self.experiment.perform(self.robot, &run.model, motion, &mut noise)?;
        let specs = run.model.specs();
        let design = self.robot.design(&specs)?;
        let before = run.model.parameters(self.robot)?;
        let mut evidence = match &run.evidence {
            Some(evidence) => evidence.clone(),
            None => Evidence::none(&design, self.rows_at)?,
        };
        let mut model = run.model.clone();
        let mut standard_deviations = Vec::new();
        // A base that tilts is not the fixed base of the columns: the log of a fall is of another robot.
        if trial.fell_at_s.is_none() {
            evidence.add(&design, &trial.measured)?;
            let estimate = self.estimator.estimate(&design, &evidence, &run.model, &before)?;
            model = run.model.with_parameters(self.robot, &specs, &estimate.parameters)?;
            let finite = |value: &f64| value.is_finite().then_some(*value);
            standard_deviations = estimate.standard_deviations.iter().map(finite).collect();
        }
        let condition_number = match evidence.is_empty() {
            true => None,
            false => Some(self.candidates.measured(evidence.factor())?.condition_number())
                .filter(|c| c.is_finite()),
        };
        let after = model.parameters(self.robot)?;
        let record = IterationRecord {
            motion: motion.name.clone(),
            allowed: if plan.forced { 0 } else { plan.allowed.len() },
            forced: plan.forced,
            alpha: plan.alpha,
            margin_m: Some(plan.safety.margin_m).filter(|margin| margin.is_finite()),
            fell_at_s: trial.fell_at_s,
            still_share: trial.measured.still_share(),
            tracking_error: trial.tracking_error,
            condition_number,
            torque_change: self.candidates.torque_change(&before, &after),
            model: model.clone(),
            standard_deviations,
            choice: plan.choice,
        };
        if record.fell_at_s.is_some() {
            run.excluded.push(record.choice.motion);
        }
        run.first_alpha = Some(plan.first_alpha);
        run.model = model;
        run.evidence = Some(evidence);
        run.history.push(record);
        run.ended = self.end.reason(&run.history);
        Ok(())
    }

    /// What the next iteration would do; none once the run has ended. For a real robot this is all there is to do before it moves.
    ///
    /// # Errors
    /// The run is not of this robot or these motions.
    pub fn plan(&self, run: &Run) -> Result<Option<Plan>, CurriculumError> {
        if run.ended.is_some() {
            return Ok(None);
        }
        let safety = self.constraint.all(self.robot, &run.model, self.dataset)?;
        let first_alpha = run.first_alpha.unwrap_or_else(|| self.relaxation.first(&safety));
        let measured = match &run.evidence {
            Some(evidence) if !evidence.is_empty() => Some(self.candidates.measured(evidence.factor())?),
            _ => None,
        };
        let first = run.history.iter().find_map(|record| record.condition_number);
        let alpha = match (first, run.history.last().and_then(|record| record.condition_number)) {
            (Some(first_condition_number), Some(condition_number)) => {
                self.relaxation.next(&Learnt { first_alpha, first_condition_number, condition_number })
            }
            _ => first_alpha,
        };
        // Where the robot has fallen on all of them, all are open again.
        let all_fell = run.excluded.len() >= self.dataset.len();
        let open = (0..self.dataset.len()).filter(|motion| all_fell || !run.excluded.contains(motion));
        let mut allowed: Vec<usize> =
            open.clone().filter(|&motion| safety[motion].largest_reduction >= alpha).collect();
        let forced = allowed.is_empty();
        if forced {
            allowed.extend(
                open.max_by(|&a, &b| safety[a].largest_reduction.total_cmp(&safety[b].largest_reduction)),
            );
        }
        let question =
            Question { candidates: self.candidates, allowed: &allowed, measured: measured.as_ref() };
        let mut dice = random(run.seed, run.history.len(), Purpose::Selection);
        let choice = self.selection.choose(&question, &mut dice);
        let safety = safety[choice.motion];
        Ok(Some(Plan { choice, allowed, forced, alpha, first_alpha, safety }))
    }
}

/// What an iteration is going to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The motion, and why.
    pub choice: Choice,
    /// The motions that could be chosen, ascending.
    pub allowed: Vec<usize>,
    /// The constraint allows none, and the safest is the only one.
    pub forced: bool,
    /// The reduction coefficient α.
    pub alpha: f64,
    /// α of the first iteration.
    pub first_alpha: f64,
    /// How safe the motion is under the present belief.
    pub safety: Safety,
}

/// The first belief of a run: [`RobotModel::unreliable`] about `truth`, the same for the same seed.
pub fn unreliable_model(truth: &RobotModel, seed: u64) -> RobotModel {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    random.set_stream(0);
    truth.unreliable(&mut random)
}

impl Candidates {
    /// RMS over all motions of how far the torques move from one parameter vector to another, over their RMS; none if they are of different
    /// models.
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
