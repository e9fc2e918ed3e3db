//! What of an effect that was found is found by fits alone: some constants, and which parameters it has.

use crate::candidates::ranges;
use crate::score_test::ScoreTest;
use phiw_curriculum::CurriculumError;
use phiw_estimation::{MotionLog, Robot, RobotModel};
use phiw_identification::{EffectCatalogue, EffectSpec};

/// Effects with a model that has been fitted with them.
pub(crate) struct Fitted {
    pub effects: Vec<EffectSpec>,
    pub model: RobotModel,
    /// −log L of the model.
    pub cost: f64,
}

impl ScoreTest {
    /// The effects with better constants and with those of their parameters that are worth it, beside what is
    /// `known`, and how much more they are then worth; −log L is `without` the effects so large.
    ///
    /// A score chooses the parameters far from the fit: a friction between two joints without the damping
    /// beside it, or with an inertia that makes up for another width.
    pub(crate) fn completed(
        &self,
        robot: &Robot,
        mut found: Fitted,
        (known, logs): (&[EffectSpec], &[MotionLog]),
        without: f64,
    ) -> Result<(Fitted, f64), CurriculumError> {
        let (mut price, before) = (0.0, found.cost);
        for place in 0..found.effects.len() {
            self.refit_constants(robot, &mut found, place, (known, logs))?;
            let kind = self.catalogue.kind(&found.effects[place].kind)?;
            let mut is_other = false;
            for constants in kind.with_other_parameters(&found.effects[place].constants) {
                let mut effects = found.effects.clone();
                effects[place].constants = constants;
                let count = |effects: &[EffectSpec]| -> Result<f64, CurriculumError> {
                    Ok(self.catalogue.build(&effects[place], robot.tree())?.parameters().len() as f64)
                };
                let added = count(&effects)? - count(&found.effects)?;
                let (model, cost) = self.fit(robot, &found.model, &[known, &effects].concat(), logs)?;
                let own_price = added * self.estimator.score.parameter_price;
                let worth = found.cost - cost - own_price;
                let least = self.settings.beside(without - found.cost).least_merit;
                let is_better = if added > 0.0 { worth >= least } else { worth > -least };
                if is_better {
                    (found, price, is_other) = (Fitted { effects, model, cost }, price + own_price, true);
                }
            }
            if is_other {
                self.refit_constants(robot, &mut found, place, (known, logs))?;
            }
        }
        let more = before - found.cost - price;
        Ok((found, more))
    }

    /// Constants of an effect that turns with more than one joint, which are not exchanged: each change is
    /// fitted in full.
    fn refit_constants(
        &self,
        robot: &Robot,
        found: &mut Fitted,
        place: usize,
        (known, logs): (&[EffectSpec], &[MotionLog]),
    ) -> Result<(), CurriculumError> {
        let built = self.catalogue.build(&found.effects[place], robot.tree())?;
        let is_of_several = |own| built.turns_with(own).is_some_and(|axis| axis.joint().is_none());
        if !(0..built.parameters().len()).any(is_of_several) {
            return Ok(());
        }
        let ranges = ranges(robot, logs);
        for step in 0..=self.settings.refinements {
            for _ in 0..self.settings.most_exchanges {
                let before = found.cost;
                for constants in self.catalogue.refined(&found.effects[place], robot.tree(), &ranges, step)? {
                    let mut effects = found.effects.clone();
                    effects[place].constants = constants;
                    let (model, cost) = self.fit(robot, &found.model, &[known, &effects].concat(), logs)?;
                    if cost < found.cost {
                        *found = Fitted { effects, model, cost };
                    }
                }
                if before - found.cost < self.settings.least_exchange {
                    break;
                }
            }
        }
        Ok(())
    }
}
