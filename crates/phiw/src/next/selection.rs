//! The choice: constraint (12), relaxation (20), selection (11).

use super::estimate::Estimate;
use super::standing::Standing;
use crate::Error;
use crate::arguments::NextArguments;
use phiw_curriculum::selection::{Question, SmallestCondition};
use phiw_curriculum::{
    Candidates, ConditionRelaxation, Constraint, CurriculumError, Learnt, MotionDataset, Relaxation, Robot,
    Safety, Selection, Triangle, Unconstrained, ZmpConstraint,
};
use phiw_identification::{Design, EffectSpec};
use phiw_regressor::least_squares::GroupedFactor;
use phiw_zmp::ZmpModel;
use rand::SeedableRng;

/// The chosen motion and the reason.
pub struct Choice {
    /// Index of the motion.
    pub motion: usize,
    /// Number of motions that are allowed.
    pub allowed: usize,
    /// None is; the safest was taken.
    pub forced: bool,
    /// The reduction coefficient; none without a floor to fall on.
    pub alpha: Option<f64>,
    /// cond(Φ) of all that has been measured; none before anything has been. Infinite while something is not determined.
    pub before: Option<f64>,
    /// cond(Φ) once this motion has been measured as it is planned.
    pub after: f64,
    /// The next best motion, and cond(Φ) with it.
    pub runner_up: Option<(usize, f64)>,
}

/// Chooses the motion.
pub fn choose(
    arguments: &NextArguments,
    robot: &Robot,
    estimate: &Estimate,
    standing: &Standing,
    dataset: &MotionDataset,
) -> Result<Choice, Error> {
    let columns = Columns::of_plan(robot, &estimate.design, dataset)?;
    let measured = estimate.measured.as_ref();
    let stack = |factor: &GroupedFactor| columns.measured(factor, estimate, dataset);
    let all = measured.map(|measured| stack(&measured.factor)).transpose()?;
    let before = all.as_ref().map(Triangle::condition_number);
    let constraint: Box<dyn Constraint> = match &standing.stance {
        Some(stance) => {
            // What a force plate sees, at every sample.
            Box::new(ZmpConstraint { stance: stance.clone(), model: ZmpModel::MultiBody, period_s: 0.0 })
        }
        None => Box::new(Unconstrained),
    };
    let safety = constraint.all(robot, &estimate.model, dataset)?;
    let alpha = match (&standing.stance, arguments.alpha) {
        (None, _) => None,
        (_, Some(alpha)) => Some(alpha),
        (Some(_), None) => {
            let relaxation = ConditionRelaxation::default();
            let first_alpha = relaxation.first(&constraint.all(robot, &estimate.initial, dataset)?);
            Some(match (before, measured) {
                (Some(condition_number), Some(measured)) => relaxation.next(&Learnt {
                    first_alpha,
                    first_condition_number: stack(&measured.first)?.condition_number(),
                    condition_number,
                    torque_uncertainty: None,
                }),
                _ => first_alpha,
            })
        }
    };
    let (allowed, forced) = allowed(dataset, &safety, alpha)?;
    let question = Question { candidates: &columns.candidates, allowed: &allowed, measured: all.as_ref() };
    // This selection draws nothing.
    let chosen = SmallestCondition.choose(&question, &mut rand_chacha::ChaCha8Rng::seed_from_u64(0));
    Ok(Choice {
        motion: chosen.motion,
        allowed: if forced { 0 } else { allowed.len() },
        forced,
        alpha,
        before,
        after: question.stack(chosen.motion).condition_number(),
        runner_up: chosen.runner_up,
    })
}

/// The columns that a plan has numbers for: those of the rigid body, and of the effects that follow from the motion alone.
struct Columns {
    candidates: Candidates,
    /// The design's parameters that they belong to.
    parameters: Vec<usize>,
}

impl Columns {
    fn of_plan(robot: &Robot, design: &Design, dataset: &MotionDataset) -> Result<Self, CurriculumError> {
        let weights = vec![1.0; robot.tree().joint_count()];
        // An effect that needs torques, or measured signals, says nothing of a motion that has not been run.
        let mut effects: Vec<usize> = (0..design.effects().len())
            .filter(|&effect| design.effects()[effect].needs().is_empty())
            .collect();
        loop {
            let specs: Vec<EffectSpec> =
                effects.iter().map(|&effect| design.effects()[effect].spec()).collect();
            let candidates = Candidates::new(robot, &specs, dataset, &weights)?;
            let mut parameters: Vec<usize> = (0..robot.base().count()).collect();
            let mut felt = Vec::new();
            for &effect in &effects {
                let columns = parameters.len()..parameters.len() + design.effect_parameters(effect).len();
                let size = |column| candidates.everything().column(column).iter().map(|x| x * x).sum::<f64>();
                if columns.clone().all(|column| (f64::MIN_POSITIVE..f64::INFINITY).contains(&size(column))) {
                    felt.push(effect);
                }
                parameters.extend(design.effect_parameters(effect));
            }
            if felt.len() == effects.len() {
                return Ok(Columns { candidates, parameters });
            }
            effects = felt;
        }
    }

    /// R of what has been measured in these columns, its rows as dense in time as those of the motions.
    fn measured(
        &self,
        factor: &GroupedFactor,
        estimate: &Estimate,
        dataset: &MotionDataset,
    ) -> Result<Triangle, CurriculumError> {
        let mut rates: Vec<f64> = dataset.motions().iter().map(|motion| 1.0 / motion.period_s()).collect();
        rates.sort_by(f64::total_cmp);
        let rate_hz = estimate.measured.as_ref().map_or(1.0, |measured| measured.rate_hz);
        let weight = (rates[rates.len() / 2] / rate_hz).sqrt();
        let factor = factor.select(&self.parameters)?;
        Ok(Triangle::of_factor(&factor.combine(&vec![weight; factor.groups().len()])?))
    }
}

/// The motions that the constraint allows; if there is none, the safest of those that stay on the support.
fn allowed(
    dataset: &MotionDataset,
    safety: &[Safety],
    alpha: Option<f64>,
) -> Result<(Vec<usize>, bool), Error> {
    let Some(alpha) = alpha else { return Ok(((0..safety.len()).collect(), false)) };
    let allowed: Vec<usize> =
        (0..safety.len()).filter(|&motion| safety[motion].largest_reduction >= alpha).collect();
    if !allowed.is_empty() {
        return Ok((allowed, false));
    }
    let by_safety =
        |a: &usize, b: &usize| safety[*a].largest_reduction.total_cmp(&safety[*b].largest_reduction);
    match (0..safety.len()).max_by(by_safety) {
        Some(safest) if safety[safest].largest_reduction >= 0.0 => Ok((vec![safest], true)),
        safest => Err(Error::NothingSafe {
            motions: safety.len(),
            safest: safest.map(|motion| dataset.motions()[motion].name.clone()).unwrap_or_default(),
            outside_m: safest.map_or(f64::NAN, |motion| -safety[motion].margin_m),
        }),
    }
}
