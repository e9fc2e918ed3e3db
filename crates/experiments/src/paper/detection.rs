//! How plain a secret is in the logs of a run, whoever looked for it.

use super::arm::Arm;
use super::run_file::RunFile;
use super::secrets::is_secret;
use super::setup::Setup;
use phiw_estimation::Gain;
use phiw_identification::EffectSpec;
use serde::{Deserialize, Serialize};

/// What the score test says of all logs of a run beside the declared model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Detection {
    /// −log L that the secret's own kind saves on its own joints, with the best constants of the catalogue;
    /// of a family, in the mean of its joints. None where the catalogue can not ask for it.
    pub secret: Option<f64>,
    /// Of all other effects the one with the most merit: its name, the −log L that it saves, and its merit.
    pub other: Option<(String, f64, f64)>,
}

impl Detection {
    /// How many standard deviations the secret is from nothing, as one parameter.
    pub fn deviations(&self) -> Option<f64> {
        self.secret.map(|gain| (2.0 * gain).sqrt())
    }
}

impl Setup {
    /// Of a run that has just ended with the loop closed; none of others, or where there is no likelihood to
    /// ask.
    ///
    /// # Errors
    /// The run is not of this robot.
    pub fn detection(&self, file: &RunFile) -> anyhow::Result<Option<Detection>> {
        let (Some(test), Arm::Closed) = (self.score_test(&file.run.initial), file.arm) else {
            return Ok(None);
        };
        let run = &file.run;
        let test = test.knowing(&self.robot, &run.model, &run.logs)?;
        let model = test.fitted(&self.robot, &run.model, &[], &run.logs)?;
        let (own, others): (Vec<Gain>, Vec<Gain>) = test
            .rank(&self.robot, &model, &run.logs)?
            .into_iter()
            .partition(|gain| is_secret(file, &gain.effect));
        let name = |effect: &EffectSpec| format!("{}[{}]", effect.kind, effect.joints.join("+"));
        let joints = match file.secret {
            Some(kind) if kind.is_family() => file.secret_joints.len(),
            _ => 1,
        };
        let sum: f64 = own.iter().map(|gain| gain.gain).sum();
        Ok(Some(Detection {
            secret: (!own.is_empty()).then(|| sum / joints as f64),
            other: others.first().map(|other| (name(&other.effect), other.gain, other.merit)),
        }))
    }
}
