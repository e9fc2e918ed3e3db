//! How good a belief is, against the truth that no curriculum sees.

use super::setup::{Setup, Validation};
use phiw_curriculum::selection::Question;
use phiw_curriculum::{Curriculum, CurriculumError, CurriculumRun};
use phiw_estimation::{
    EstimationError, Estimator, Evidence, LeastSquares, MotionLog, RobotModel, RowsAt, WeightedLeastSquares,
};
use phiw_identification::accuracy::{parameter_rmse, torque_rmse};
use phiw_identification::fitting::{TorqueError, torque_error};
use phiw_regressor::RegressorError;
use phiw_zmp::{ZmpModel, ZmpWorkspace, standing_parameters};
use serde::{Deserialize, Serialize};

/// Scores of a belief.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Score {
    /// w.
    pub parameters: Vec<f64>,
    /// RMSE_w, equation (17).
    pub rmse_w: f64,
    /// RMSE_τ, equation (19) \[N·m\].
    pub rmse_torque: f64,
    /// RMSE_w of equation (4) on the same logs; none without logs.
    pub rmse_w_least_squares: Option<f64>,
    /// RMSE_w of weighted least squares on the same logs.
    pub rmse_w_weighted: Option<f64>,
}

/// What one iteration of the run that stands for all chose from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detail {
    /// The motion.
    pub chosen: usize,
    /// Those that could be chosen.
    pub allowed: Vec<usize>,
    /// cond of the stack with each motion.
    #[serde(deserialize_with = "super::infinite::numbers")]
    pub condition_numbers: Vec<f64>,
    /// α.
    pub alpha: f64,
    /// ZMP of the chosen reference under the belief of the time \[m\].
    pub zmp: Vec<[f64; 2]>,
}

impl Setup {
    /// Error of each torque on logs of held-out motions.
    ///
    /// # Errors
    /// The belief is not of this robot.
    pub fn torque_error(&self, model: &RobotModel, logs: &[MotionLog]) -> anyhow::Result<TorqueError> {
        let design = self.robot.design_of(model)?;
        let mut evidence = Evidence::none(&design, RowsAt::Periods)?.without_noise();
        for log in logs {
            evidence.add(&design, log)?;
        }
        Ok(torque_error(std::slice::from_ref(evidence.factor()), &model.parameters(&self.robot)?)?)
    }

    /// Scores a belief, and what simpler estimators would make of the same logs. `validation` are the
    /// held-out motions of the plant.
    ///
    /// # Errors
    /// The belief is not of this robot.
    pub fn score(
        &self,
        model: &RobotModel,
        evidence: Option<&Evidence>,
        validation: &Validation,
    ) -> anyhow::Result<Score> {
        let parameters = model.parameters(&self.robot)?;
        let truth = &validation.truth;
        let declared = model.effects.len() == self.robot.declared().len();
        let (factor, samples) = match declared {
            true => &validation.declared,
            false => &self.validation_of(model, &validation.logs)?,
        };
        let design = self.robot.design_of(model)?;
        let bystander = |estimator: &dyn Estimator| -> anyhow::Result<Option<f64>> {
            let Some(evidence) = evidence.filter(|evidence| declared && !evidence.is_empty()) else {
                return Ok(None);
            };
            // Rows that count can be few, where the base rocks: then least squares has no answer.
            match estimator.estimate(&design, evidence, model, &parameters) {
                Err(EstimationError::Regressor(RegressorError::RankDeficient { .. })) => Ok(None),
                estimate => Ok(Some(parameter_rmse(&estimate?.parameters, truth))),
            }
        };
        Ok(Score {
            rmse_w: parameter_rmse(&parameters, truth),
            rmse_torque: torque_rmse(factor, &parameters, *samples)?,
            rmse_w_least_squares: bystander(&LeastSquares)?,
            rmse_w_weighted: bystander(&WeightedLeastSquares)?,
            parameters,
        })
    }

    /// What the next iteration chooses from.
    ///
    /// # Errors
    /// The run is not of this robot.
    pub fn detail(&self, curriculum: &Curriculum<'_>, run: &CurriculumRun) -> anyhow::Result<Option<Detail>> {
        let plan = match curriculum.plan(run) {
            Err(CurriculumError::NothingSafe { .. } | CurriculumError::FellOnAll { .. }) => return Ok(None),
            plan => plan?,
        };
        let Some(plan) = plan else { return Ok(None) };
        let measured = curriculum.measured(run)?;
        let question = Question {
            dataset: curriculum.dataset,
            candidates: curriculum.candidates,
            allowed: &plan.allowed,
            measured: measured.as_ref(),
            history: &run.history,
        };
        let condition_numbers =
            (0..self.dataset.len()).map(|motion| question.stack(motion).condition_number()).collect();
        let motion = &self.dataset.motions()[plan.choice.motion];
        let standing = standing_parameters(self.robot.base_link(), &run.model.standard);
        let mut workspace = ZmpWorkspace::new(self.robot.tree());
        let mut zmp = Vec::new();
        for sample in (0..motion.samples()).step_by(2) {
            let [q, v, a] = motion.sample(sample);
            let balance = workspace.evaluate(self.robot.tree(), &standing, q, v, a)?;
            zmp.extend(balance.zmp(ZmpModel::PointMass, self.subject.stance.floor_height()));
        }
        Ok(Some(Detail {
            chosen: plan.choice.motion,
            allowed: plan.allowed,
            condition_numbers,
            alpha: plan.alpha,
            zmp,
        }))
    }
}
