//! The chosen motion as the robot gets it: positions, velocities, accelerations, and the torque that the estimate predicts.

use super::estimate::Estimate;
use phiw_curriculum::{CurriculumError, Motion};
use phiw_dynamics::Tree;
use phiw_telemetry::{LogColumns, LogWriter};

/// The feed-forward of equation (13).
pub struct Plan {
    /// φ(q, q̇, q̈)·w \[N·m, N\], `[sample × joint]`.
    pub torque: Vec<f64>,
}

/// A limit of the URDF that the motion exceeds.
pub struct Excess {
    /// The joint.
    pub joint: String,
    /// What is exceeded: `position`, `speed`, `torque`.
    pub what: &'static str,
    /// The motion's largest.
    pub value: f64,
    /// The limit next to it.
    pub limit: f64,
}

/// A limit counts as kept up to this share beyond it: retargeted motions run along their limits.
const TOLERANCE: f64 = 1e-3;

impl Plan {
    /// The torques of a motion.
    pub fn new(estimate: &Estimate, motion: &Motion) -> Result<Self, CurriculumError> {
        let Estimate { design, parameters, .. } = estimate;
        let mut block = motion.block();
        design.correct(&mut block);
        let mut scratch = design.scratch();
        scratch.begin(&block)?;
        let mut evaluation = vec![0.0; design.evaluation_width()];
        let mut torque = Vec::with_capacity(motion.samples() * motion.joints());
        for sample in 0..motion.samples() {
            scratch.evaluate(&block, sample, &mut evaluation)?;
            torque.extend(design.rows().iter().map(|layout| {
                let columns = &evaluation[layout.range.clone()];
                columns
                    .iter()
                    .zip(&layout.parameters)
                    .map(|(column, &index)| column * parameters[index])
                    .sum::<f64>()
            }));
        }
        Ok(Plan { torque })
    }

    /// The file: a log with `q`, `tau`, `qd` and `qdd` of all joints.
    pub fn csv(&self, motion: &Motion, tree: &Tree) -> String {
        let joints: Vec<String> = tree.joint_names().map(str::to_owned).collect();
        let columns = LogColumns { torque: true, velocity: true, acceleration: true, temperature: false };
        let write = || {
            let mut writer = LogWriter::new(Vec::new(), &joints, columns)?;
            for (sample, torque) in self.torque.chunks_exact(joints.len()).enumerate() {
                let [q, v, a] = motion.sample(sample);
                writer.write(sample as f64 * motion.period_s(), &[q, torque, v, a])?;
            }
            writer.finish()
        };
        // Writing to memory does not fail, and names and numbers are text.
        write().ok().and_then(|bytes: Vec<u8>| String::from_utf8(bytes).ok()).unwrap_or_default()
    }

    /// The limits of the URDF that the motion exceeds.
    pub fn excesses(&self, motion: &Motion, tree: &Tree) -> Vec<Excess> {
        let mut excesses = Vec::new();
        for joint in 0..tree.joint_count() {
            let limits = tree.joint(joint).limits;
            let values =
                |signal: usize| (0..motion.samples()).map(move |sample| motion.sample(sample)[signal][joint]);
            let largest =
                |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, x| most.max(x.abs()));
            let (low, high) = values(0)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
            let torque = largest(&mut self.torque.iter().copied().skip(joint).step_by(motion.joints()));
            let slack = TOLERANCE * (limits.upper - limits.lower).clamp(0.0, 1e3);
            let mut check = |what, exceeded: bool, value, limit| {
                if exceeded {
                    excesses.push(Excess { joint: tree.joint(joint).joint.clone(), what, value, limit });
                }
            };
            check("position", low < limits.lower - slack, low, limits.lower);
            check("position", high > limits.upper + slack, high, limits.upper);
            let speed = largest(&mut values(1));
            check("speed", speed > (1.0 + TOLERANCE) * limits.velocity, speed, limits.velocity);
            check("torque", torque > (1.0 + TOLERANCE) * limits.effort, torque, limits.effort);
        }
        excesses
    }
}
