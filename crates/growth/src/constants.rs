//! The constants of effects that may be missing, between those that are tried first.

use crate::candidates::{is_alike, ranges};
use crate::score_test::ScoreTest;
use phiw_curriculum::CurriculumError;
use phiw_effects::Constants;
use phiw_estimation::{Gain, KnownEffect, MotionLog, Robot, RobotModel};
use phiw_identification::EffectSpec;

/// Of the constants that a score tries first, one in so many is tried in an exchange: their widths double.
const EVERY: usize = 2;

impl ScoreTest {
    /// The same effects with constants between those that were tried, each by itself.
    pub(crate) fn refined(
        &self,
        robot: &Robot,
        model: &RobotModel,
        logs: &[MotionLog],
        mut best: Vec<Gain>,
    ) -> Result<Vec<Gain>, CurriculumError> {
        let ranges = ranges(robot, logs);
        for step in 0..self.settings.refinements {
            let mut near: Vec<EffectSpec> = Vec::new();
            for gain in &best {
                let refined = self.catalogue.refined(&gain.effect, robot.tree(), &ranges, step)?;
                near.extend(
                    refined.into_iter().map(|constants| EffectSpec { constants, ..gain.effect.clone() }),
                );
            }
            if near.is_empty() {
                break;
            }
            keep_better(&mut best, self.estimator.gains(robot, model, logs, &near)?);
        }
        Ok(best)
    }

    /// The same effects with the constants under which frictions that turn explain most beside the model that
    /// has been fitted with them, each by itself; gains are those of the exchange. In the first `round` all
    /// constants are tried, later those near the present ones.
    pub(crate) fn exchanged(
        &self,
        robot: &Robot,
        fitted: &RobotModel,
        logs: &[MotionLog],
        effects: &[EffectSpec],
        round: usize,
    ) -> Result<Vec<Gain>, CurriculumError> {
        let ranges = ranges(robot, logs);
        let present = |effect: &EffectSpec| Gain {
            effect: effect.clone(),
            gain: 0.0,
            parameters: parameters_of(fitted, effect),
            merit: 0.0,
        };
        let mut best: Vec<Gain> = effects.iter().map(present).collect();
        let mut tried = effects.to_vec();
        let first = usize::from(round > 0);
        for step in first..=self.settings.refinements {
            let mut near: Vec<EffectSpec> = Vec::new();
            for Gain { effect, .. } in &best {
                let constants = match step.checked_sub(1) {
                    None => {
                        let all = self.catalogue.scanned(effect, robot.tree(), &ranges)?;
                        all.into_iter().step_by(EVERY).collect()
                    }
                    Some(step) => self.catalogue.refined(effect, robot.tree(), &ranges, step)?,
                };
                let with = |constants: Constants| EffectSpec { constants, ..effect.clone() };
                near.extend(constants.into_iter().map(with));
            }
            near.retain(|effect| !tried.contains(effect));
            keep_better(&mut best, self.estimator.exchanges(robot, fitted, logs, &near)?);
            tried.append(&mut near);
        }
        Ok(best)
    }
}

/// Puts what gains more in the place of the same effect with other constants.
fn keep_better(best: &mut [Gain], gains: Vec<Option<Gain>>) {
    for gain in gains.into_iter().flatten() {
        let own = best.iter_mut().find(|best| is_alike(&best.effect, &gain.effect));
        if let Some(own) = own.filter(|own| gain.gain > own.gain) {
            *own = gain;
        }
    }
}

/// The parameters of an effect that a model has.
fn parameters_of(model: &RobotModel, effect: &EffectSpec) -> Vec<f64> {
    let own = model.effects.iter().find(|own| own.spec == *effect);
    own.map(|own| own.parameters.clone()).unwrap_or_default()
}

/// The model with effects as they are foretold: where a fit begins.
pub(crate) fn with_foretold(model: &RobotModel, foretold: &[Gain]) -> RobotModel {
    let mut model = model.clone();
    model.effects.extend(
        foretold
            .iter()
            .map(|gain| KnownEffect { spec: gain.effect.clone(), parameters: gain.parameters.clone() }),
    );
    model
}
