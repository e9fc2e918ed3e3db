//! Two beliefs that the logs can not tell apart, and the motion that can.

use crate::CurriculumError;
use crate::motion::Motion;
use phiw_estimation::{Robot, RobotModel, torques_along};
use phiw_identification::EffectSpec;
use serde::{Deserialize, Serialize};

/// Two beliefs, both fitted to all logs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Rivalry {
    /// What is believed, and what might be true in its place.
    pub beliefs: [RobotModel; 2],
    /// In what they differ.
    pub effects: [EffectSpec; 2],
}

impl Rivalry {
    /// RMS over a motion of how far the torques of the two differ, each joint's over its share `scale` \[N·m,
    /// N\]; a sample is looked at every `period_s` \[s\].
    ///
    /// # Errors
    /// A belief or the motion is not of this robot.
    pub fn difference(
        &self,
        robot: &Robot,
        motion: &Motion,
        scale: &[f64],
        period_s: f64,
    ) -> Result<f64, CurriculumError> {
        let stride = ((period_s / motion.period_s()).round() as usize).max(1);
        let mut torques = Vec::with_capacity(2);
        for belief in &self.beliefs {
            let (design, parameters) = (robot.design_of(belief)?, belief.parameters(robot)?);
            torques.push(torques_along(&design, &parameters, &mut motion.block(), stride)?);
        }
        let joints = motion.joints();
        let pairs = torques[0].iter().zip(&torques[1]).enumerate();
        let sum: f64 =
            pairs.map(|(index, (one, other))| ((one - other) / scale[index % joints]).powi(2)).sum();
        Ok((sum / torques[0].len().max(1) as f64).sqrt())
    }

    /// Both in words: kind and joints.
    pub fn names(&self) -> [String; 2] {
        [0, 1].map(|which| {
            let EffectSpec { kind, joints, .. } = &self.effects[which];
            format!("{kind} [{}]", joints.join(", "))
        })
    }
}

/// Which pair of rival beliefs the next motion has to tell apart, from the names of all pairs and of those
/// that each earlier motion was chosen to separate.
///
/// Each pair gets one motion, and the motion after it is chosen for the parameters: a motion that
/// distinguishes rivals may identify nothing else, and a pair that one motion has not distinguished may stay
/// undecided for ever.
pub fn rivals_to_separate(rivals: &[[String; 2]], separated: &[Option<[String; 2]>]) -> Option<usize> {
    if separated.last().is_some_and(Option::is_some) {
        return None;
    }
    let tried = |names: &[String; 2]| {
        separated.iter().flatten().any(|pair| names.iter().all(|name| pair.contains(name)))
    };
    rivals.iter().position(|names| !tried(names))
}
