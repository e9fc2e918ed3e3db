//! Lines 11 and 12 of Algorithm 1: what to do next, from what is believed and what has been measured.

mod permission;
mod safer;

pub use permission::{NoneAllowed, Permission, permission};

use crate::constraint::{Believed, Certainty, Constraint, Safety};
use crate::growth::Rivalry;
use crate::motion::MotionDataset;
use crate::random::{Purpose, random};
use crate::relaxation::{Learnt, Relaxation};
use crate::selection::{Best, Choice, MotionCandidates, Question, Scored, Selection, Triangle, decide};
use crate::{CurriculumError, IterationRecord};
use phiw_estimation::{Robot, RobotModel};

/// What is believed of a robot, and the motions that it may do.
#[derive(Clone, Copy)]
pub struct Belief<'a> {
    /// The robot as declared.
    pub robot: &'a Robot,
    /// The motions to choose from.
    pub dataset: &'a MotionDataset,
    /// Their factors, in the columns by which motions are compared.
    pub candidates: &'a MotionCandidates,
    /// What is believed now. The constraint judges motions by it.
    pub model: &'a RobotModel,
    /// How sure that is; none where nothing has been measured. A constraint that counts uncertainty asks.
    pub certainty: Option<&'a Certainty>,
    /// What was believed before anything was measured. α of the first iteration follows from it.
    pub initial: &'a RobotModel,
    /// Two beliefs that the motion has to distinguish; none if it is chosen for the parameters.
    pub rivalry: Option<&'a Rivalry>,
}

/// What has been measured when a plan is made.
#[derive(Clone, Copy, Default)]
pub struct MeasuredSoFar<'a> {
    /// R of all that has been measured, in the columns of the candidates; none before the first measurement.
    pub triangle: Option<&'a Triangle>,
    /// cond(Φ) of all that had been measured after each iteration; none where something was not determined.
    pub condition_numbers: &'a [Option<f64>],
    /// How uncertain the torques were after each iteration ([`crate::IterationRecord::torque_uncertainty`]);
    /// may be empty.
    pub torque_uncertainties: &'a [Option<f64>],
    /// α of the first iteration; none if this is the first.
    pub first_alpha: Option<f64>,
    /// Motions on which the robot fell.
    pub excluded: &'a [usize],
    /// The iterations so far, for selections that ask for them; may be empty.
    pub history: &'a [IterationRecord],
}

/// Who decides what in a plan.
#[derive(Clone, Copy)]
pub struct Policy<'a> {
    /// Line 12: which of the allowed motions.
    pub selection: &'a dyn Selection,
    /// The constraint (12).
    pub constraint: &'a dyn Constraint,
    /// Line 15: how it is relaxed.
    pub relaxation: &'a dyn Relaxation,
    /// What happens where it allows no motion.
    pub none_allowed: NoneAllowed,
    /// Time between the samples by which rival beliefs are compared \[s\].
    pub rivalry_period_s: f64,
    /// Seed of a selection that draws.
    pub seed: u64,
}

/// What an iteration is going to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// The motion, and why.
    pub choice: Choice,
    /// The two beliefs that it is to tell apart, in words; none if it is chosen for the parameters.
    pub separates: Option<[String; 2]>,
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

/// What to do next: the constraint judges all motions, the relaxation gives α, and the selection takes one of
/// the motions that are allowed then.
///
/// It changes nothing and reads nothing: the same belief, measurements and policy give the same plan.
/// [`crate::Curriculum`] and `phiw next` both follow it.
///
/// # Errors
/// [`CurriculumError::NothingSafe`] or [`CurriculumError::FellOnAll`] where the policy refuses; the belief or
/// a motion is of another robot.
pub fn plan(
    belief: &Belief<'_>,
    measured: &MeasuredSoFar<'_>,
    policy: &Policy<'_>,
) -> Result<Plan, CurriculumError> {
    let Belief { robot, dataset, .. } = *belief;
    let believed = Believed { model: belief.model, certainty: belief.certainty };
    let safety = policy.constraint.all(robot, &believed, dataset)?;
    let first_alpha = match measured.first_alpha {
        Some(alpha) => alpha,
        None if belief.initial == belief.model => policy.relaxation.first(&safety),
        None => {
            let initial = Believed::unmeasured(belief.initial);
            policy.relaxation.first(&policy.constraint.all(robot, &initial, dataset)?)
        }
    };
    let learnt = Learnt::of(first_alpha, measured.condition_numbers, measured.torque_uncertainties);
    let alpha = learnt.map_or(first_alpha, |learnt| policy.relaxation.next(&learnt));
    let (allowed, forced) = match permission(&safety, measured.excluded, alpha, policy.none_allowed) {
        Permission::Allowed(motions) => (motions, false),
        Permission::Forced(safest) => (vec![safest], true),
        Permission::Refused(Some(safest)) => {
            return Err(CurriculumError::NothingSafe {
                motions: dataset.len(),
                safest: dataset.motions()[safest].name.clone(),
                outside_m: -safety[safest].sure_margin_m,
                safer: safer::in_words(policy.constraint, robot, &believed, (dataset, &safety))?,
            });
        }
        Permission::Refused(None) => return Err(CurriculumError::FellOnAll { motions: dataset.len() }),
    };
    let (choice, separates) = match belief.rivalry {
        Some(rivalry) => (separating(belief, rivalry, &allowed, policy)?, Some(rivalry.names())),
        None => {
            let question = Question {
                dataset,
                candidates: belief.candidates,
                allowed: &allowed,
                measured: measured.triangle,
                history: measured.history,
            };
            let mut rng = random(policy.seed, measured.condition_numbers.len(), Purpose::Selection);
            (policy.selection.choose(&question, &mut rng), None)
        }
    };
    let safety = safety[choice.motion];
    Ok(Plan { choice, separates, allowed, forced, alpha, first_alpha, safety })
}

/// The motion on which two rivals differ most, torques counted by their limits.
fn separating(
    belief: &Belief<'_>,
    rivalry: &Rivalry,
    allowed: &[usize],
    policy: &Policy<'_>,
) -> Result<Choice, CurriculumError> {
    let tree = belief.robot.tree();
    let scale: Vec<f64> = (0..tree.joint_count())
        .map(|joint| tree.joint(joint).limits.effort)
        .map(|effort| if effort.is_finite() && effort > 0.0 { effort } else { 1.0 })
        .collect();
    let mut differences = Vec::with_capacity(allowed.len());
    for &motion in allowed {
        let motion_of = &belief.dataset.motions()[motion];
        let score = rivalry.difference(belief.robot, motion_of, &scale, policy.rivalry_period_s)?;
        differences.push(Scored { motion, score });
    }
    Ok(decide(&differences, Best::Largest).unwrap_or(Choice { motion: 0, merit: None, runner_up: None }))
}
