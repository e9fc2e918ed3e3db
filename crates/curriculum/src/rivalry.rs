//! Two beliefs that the logs can not tell apart, and the motion that can.

use crate::{CurriculumError, Motion, Robot, RobotModel};
use phiw_identification::{Design, EffectSpec};
use phiw_telemetry::Block;
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

/// A model's torques along a block, of every `stride`-th sample, `[sample × joint]`. The block is corrected
/// as the model's effects have it.
///
/// # Errors
/// The block is not of this robot.
pub(crate) fn torques_along(
    design: &Design,
    parameters: &[f64],
    block: &mut Block,
    stride: usize,
) -> Result<Vec<f64>, CurriculumError> {
    design.correct(block);
    let mut scratch = design.scratch();
    scratch.begin(block)?;
    let mut row = vec![0.0; design.evaluation_width()];
    let mut torques = Vec::new();
    for sample in 0..block.len() {
        // All of them in order, for effects with memory.
        scratch.evaluate(block, sample, &mut row)?;
        if sample % stride == 0 {
            torques.extend(design.rows().iter().map(|layout| layout.torque(&row, parameters)));
        }
    }
    Ok(torques)
}
