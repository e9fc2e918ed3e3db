//! What the measured logs say where they tell what the controller did: motions at its rate, and the estimate
//! that is told no noise.

use super::estimate::MeasuredLogs;
use crate::Error;
use phiw_curriculum::CurriculumError;
use phiw_estimation::{
    ConcentratedLikelihood, Estimate, Estimator, Evidence, EvidenceSettings, Logged, LoggedSettings,
    MotionLog, Robot, RobotModel, RowsAt, TorqueMisfit, torques_along,
};
use phiw_identification::IdentificationError;
use phiw_telemetry::{Block, ControllerSignal, LogSource, Recording, Survey, TorqueColumns};

/// Logs of a robot whose controller is known, each in stretches without gaps.
pub struct ControlledLogs {
    /// The motions of each log.
    motions: Vec<Vec<MotionLog>>,
}

/// What was learnt from them.
pub struct Learnt {
    /// What had been measured after each log.
    pub measured: MeasuredLogs,
    /// How sure the parameters are.
    pub estimate: Estimate,
    /// The belief after the last.
    pub model: RobotModel,
    /// Whether the last estimate's story holds, torque by torque.
    pub misfit: Vec<TorqueMisfit>,
}

impl ControlledLogs {
    /// Reads the logs again; none if one of them does not say what was commanded or asked for.
    pub fn read(
        surveys: &[Survey],
        joints: &[String],
        settings: &LoggedSettings,
    ) -> Result<Option<Self>, Error> {
        let mut motions = Vec::with_capacity(surveys.len());
        for survey in surveys {
            let logged = logged(&survey.source, joints).map_err(IdentificationError::from)?;
            if !logged.knows_controller() {
                return Ok(None);
            }
            let own = logged.motions(settings);
            motions.push(own.map_err(|source| Error::LogForNext {
                path: survey.path.clone(),
                source: Box::new(source),
            })?);
        }
        Ok(Some(ControlledLogs { motions }))
    }

    /// Learns from one log after the other, as the curriculum does: the belief after a log is what its
    /// estimate begins with after the next, and what the controller of that log is taken to have believed.
    pub fn learn(&self, robot: &Robot, initial: &RobotModel) -> Result<Learnt, CurriculumError> {
        let estimator = ConcentratedLikelihood::new(initial.clone());
        let settings = EvidenceSettings { in_order: true, ..RowsAt::Periods.into() };
        let mut evidence = Evidence::none(&robot.design_of(initial)?, settings)?;
        let (mut model, mut after_each, mut seconds) = (initial.clone(), Vec::new(), 0.0);
        let mut last = None;
        for motions in &self.motions {
            let design = robot.design_of(&model)?;
            let parameters = model.parameters(robot)?;
            for motion in motions {
                seconds += motion.duration_s();
                evidence = evidence.at_rate(1.0 / motion.period_s);
                evidence.add(&design, &asked_of(motion, robot, &model)?)?;
            }
            let estimate = estimator.estimate(&design, &evidence, &model, &parameters)?;
            let misfit = estimator.misfit(&design, &evidence, &estimate)?;
            model = model.with_parameters(robot, &model.specs(), &estimate.parameters)?;
            after_each.push(evidence.clone());
            last = Some((estimate, misfit));
        }
        let Some((estimate, misfit)) = last else {
            let problem = "there is none: name the logs that were measured";
            return Err(phiw_estimation::EstimationError::Log(problem).into());
        };
        let measured = MeasuredLogs { after_each, seconds };
        Ok(Learnt { measured, estimate, model, misfit: misfit.unwrap_or_default() })
    }
}

fn logged(source: &LogSource, joints: &[String]) -> Result<Logged, phiw_telemetry::LogError> {
    Ok(Logged {
        recording: Recording::read(source, joints, TorqueColumns::Required)?,
        command: ControllerSignal::Command.read(source, joints)?,
        reference: ControllerSignal::Reference.read(source, joints)?,
    })
}

/// The motion with the torques that a controller of this belief gives for its reference.
fn asked_of(motion: &MotionLog, robot: &Robot, model: &RobotModel) -> Result<MotionLog, CurriculumError> {
    let Some(asked) = &motion.asked else { return Ok(motion.clone()) };
    let (joints, rows) = (motion.joints, motion.rows());
    let acceleration = |index: usize| {
        let (row, joint) = (index / joints, index % joints);
        let (before, after) = (row.saturating_sub(1), (row + 1).min(rows - 1));
        let change = asked.qd[after * joints + joint] - asked.qd[before * joints + joint];
        change / ((after - before).max(1) as f64 * motion.period_s)
    };
    let t = (0..rows).map(|row| row as f64 * motion.period_s).collect();
    let signals = [asked.q.clone(), asked.qd.clone(), (0..asked.q.len()).map(acceleration).collect()];
    let mut block = Block::unfiltered(joints, t, signals, Vec::new());
    let torque = torques_along(&robot.design_of(model)?, &model.parameters(robot)?, &mut block, 1)?;
    let asked = phiw_estimation::Asked { torque, ..asked.clone() };
    Ok(MotionLog { asked: Some(asked), ..motion.clone() })
}
