//! Whether a robot can be sent a motion as it is: the limits of its joints, and whether it begins and ends at
//! rest.

use crate::CurriculumError;
use crate::motion::Motion;
use phiw_dynamics::Tree;
use phiw_estimation::torques_along;
use phiw_identification::Design;

/// When something about a motion is worth a warning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// A limit counts as kept up to this share beyond it (of the range, for positions). Default: 10⁻³, since
    /// motions of `phiw retarget` run along their limits.
    pub tolerance: f64,
    /// Largest range of a joint of which the tolerance is a share \[rad, m\]; joints without limits have
    /// infinite ones. Default: 1000.
    pub largest_range: f64,
    /// Speed at a motion's ends up to which a joint counts as at rest \[rad/s, m/s\]. Default: 0.05, not
    /// calibrated: slower than any commanded motion and faster than what smoothing leaves of rest.
    pub at_rest: f64,
}

impl Default for MotionLimits {
    fn default() -> Self {
        MotionLimits { tolerance: 1e-3, largest_range: 1e3, at_rest: 0.05 }
    }
}

/// A limit of the URDF that a motion exceeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Excess {
    /// The joint.
    pub joint: String,
    /// What is exceeded: `position`, `speed`, `torque`.
    pub what: &'static str,
    /// The motion's largest \[rad, m; rad/s, m/s; N·m, N\].
    pub value: f64,
    /// The limit next to it, in the same unit.
    pub limit: f64,
}

/// A joint that moves where a motion should rest.
#[derive(Clone, Debug, PartialEq)]
pub struct Unrest {
    /// The joint that is fastest.
    pub joint: String,
    /// Its speed \[rad/s, m/s\].
    pub speed: f64,
    /// Whether this is at the motion's beginning, and not at its end.
    pub at_start: bool,
}

impl MotionLimits {
    /// The limits of the tree's joints that a motion exceeds; `torque` is what it asks for \[N·m, N\],
    /// `[sample × joint]`.
    pub fn excesses(&self, motion: &Motion, torque: &[f64], tree: &Tree) -> Vec<Excess> {
        let mut excesses = Vec::new();
        for joint in 0..tree.joint_count() {
            let limits = tree.joint(joint).limits;
            let values =
                |signal: usize| (0..motion.samples()).map(move |sample| motion.sample(sample)[signal][joint]);
            let largest =
                |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, |most: f64, x| most.max(x.abs()));
            let (low, high) = values(0)
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), q| (low.min(q), high.max(q)));
            let torque = largest(&mut torque.iter().copied().skip(joint).step_by(motion.joints()));
            let slack = self.tolerance * (limits.upper - limits.lower).clamp(0.0, self.largest_range);
            let mut check = |what, exceeded: bool, value, limit| {
                if exceeded {
                    excesses.push(Excess { joint: tree.joint(joint).joint.clone(), what, value, limit });
                }
            };
            check("position", low < limits.lower - slack, low, limits.lower);
            check("position", high > limits.upper + slack, high, limits.upper);
            let speed = largest(&mut values(1));
            check("speed", speed > (1.0 + self.tolerance) * limits.velocity, speed, limits.velocity);
            check("torque", torque > (1.0 + self.tolerance) * limits.effort, torque, limits.effort);
        }
        excesses
    }

    /// The ends of a motion at which a joint of the tree moves.
    pub fn unrest(&self, motion: &Motion, tree: &Tree) -> Vec<Unrest> {
        let fastest = |(at_start, sample): (bool, usize)| {
            let speeds = motion.sample(sample)[1].iter().map(|speed| speed.abs());
            let (joint, speed) = speeds.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
            let joint = tree.joint(joint).joint.clone();
            (speed > self.at_rest).then_some(Unrest { joint, speed, at_start })
        };
        [(true, 0), (false, motion.samples() - 1)].into_iter().filter_map(fastest).collect()
    }
}

impl Motion {
    /// The torques that a model predicts for the motion, φ(q, q̇, q̈)·w \[N·m, N\], `[sample × joint]`: the
    /// feed-forward of equation (13).
    ///
    /// # Errors
    /// The motion is not of this robot.
    pub fn torques(&self, design: &Design, parameters: &[f64]) -> Result<Vec<f64>, CurriculumError> {
        Ok(torques_along(design, parameters, &mut self.block(), 1)?)
    }
}
