//! Who estimates in a run, and who looks for what the model lacks.

use super::arguments::{Detector, EstimatorName, PriorName};
use super::setup::{NOISELESS, Setup};
use super::whole_body::Standing;
use phiw_curriculum::growth::Growth;
use phiw_estimation::{
    ConcentratedLikelihood, Estimator, LeastSquares, MotionLikelihood, ParameterPrior, RobotModel,
    WeightedLeastSquares,
};
use phiw_growth::{ScoreTest, TraceResidual};

impl Setup {
    /// Who estimates, in a run that begins with `initial`.
    pub fn estimator(&self, initial: &RobotModel) -> Box<dyn Estimator> {
        match self.settings.estimator {
            EstimatorName::Concentrated => Box::new(self.concentrated(initial)),
            EstimatorName::LeastSquares => Box::new(LeastSquares),
            EstimatorName::Weighted => Box::new(WeightedLeastSquares),
            EstimatorName::Likelihood => {
                let likelihood = self.likelihood();
                Box::new(match self.settings.prior {
                    PriorName::None => likelihood,
                    PriorName::Initial => likelihood.believing(ParameterPrior::unreliable(initial.clone())),
                })
            }
        }
    }

    /// The likelihood that is told no noise.
    fn concentrated(&self, initial: &RobotModel) -> ConcentratedLikelihood {
        let standing_on = self.subject.standing.as_ref().map(Standing::foot_bodies);
        ConcentratedLikelihood::new(initial.clone()).standing_on(standing_on.unwrap_or_default())
    }

    /// The likelihood of motions under the noise of the plant.
    pub fn likelihood(&self) -> MotionLikelihood {
        // Without noise there is no likelihood.
        let share = if self.settings.noise > 0.0 { self.settings.noise } else { NOISELESS };
        let standing_on = self.subject.standing.as_ref().map(Standing::foot_bodies);
        MotionLikelihood::new(self.subject.torque_noise(share)).standing_on(standing_on.unwrap_or_default())
    }

    /// Who looks for what the model lacks by the likelihood, if that is how parameters are estimated, in a
    /// run that begins with `initial`.
    pub fn score_test(&self, initial: &RobotModel) -> Option<ScoreTest> {
        match self.settings.estimator {
            EstimatorName::Likelihood => Some(ScoreTest::new(self.likelihood())),
            EstimatorName::Concentrated => Some(ScoreTest::of_unknown_noise(self.concentrated(initial))),
            EstimatorName::LeastSquares | EstimatorName::Weighted => None,
        }
    }

    /// Who looks for what the model lacks.
    pub fn growth(&self, initial: &RobotModel) -> Box<dyn Growth> {
        match self.score_test(initial).filter(|_| self.settings.detector == Detector::Score) {
            Some(test) => Box::new(test),
            None => Box::new(TraceResidual::default()),
        }
    }
}
