//! Where measurements come from.

use crate::CurriculumError;
use crate::motion::Motion;
use phiw_estimation::{Estimator, MotionLog, Robot, RobotModel};
use rand::Rng;
use serde::{Deserialize, Serialize};

/// What happened when a motion was tried.
#[derive(Clone, Debug, PartialEq)]
pub struct Trial {
    /// The log.
    pub measured: MotionLog,
    /// When the robot fell, since the motion's start \[s\].
    pub fell_at_s: Option<f64>,
    /// RMS of each joint's tracking error \[rad, m\].
    pub tracking_error: Vec<f64>,
    /// How the balance was kept, as a force plate under the base would have it; none where there is no such.
    pub kept: Option<KeptBalance>,
}

/// How a robot kept its balance in a motion that was run: its true ZMP against the support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct KeptBalance {
    /// Smallest signed distance of the ZMP from the border \[m\], over all instants; noise of the torques
    /// shakes it. None where the robot did not press on the floor at some instant.
    pub margin_m: Option<f64>,
    /// Share of the time in which the ZMP was outside.
    pub outside_share: f64,
    /// Smallest margin of the ZMP's mean over the time in which an inverted pendulum of the robot's height
    /// falls, weighted by how long ago it was \[m\]: what would have tipped over a base that stands free.
    pub tipping_margin_m: f64,
}

/// Tries motions on a robot: line 13 of Algorithm 1.
pub trait Experiment: Send + Sync {
    /// Lets the robot follow a motion with what is believed of it. The same random numbers give the same
    /// trial.
    ///
    /// # Errors
    /// The robot can not be run. A fall is no error.
    fn perform(
        &self,
        robot: &Robot,
        model: &RobotModel,
        motion: &Motion,
        rng: &mut dyn Rng,
    ) -> Result<Trial, CurriculumError>;

    /// Standard deviation of each torque's noise \[N·m, N\], if it is known. An estimator that assumes
    /// another one is refused.
    fn known_torque_noise(&self) -> Option<Vec<f64>> {
        None
    }
}

/// Share by which two statements of one noise may differ: numbers that were written down and read again.
const ROUNDED: f64 = 1e-6;

/// The experiment states the noise that it makes. An estimator that assumes another one weights its
/// measurements wrongly, and nothing else would show it.
///
/// # Errors
/// The experiment knows the noise of a torque, and the estimator is assumed another one. Where there is no
/// noise any will do: it stands for rounding.
pub(crate) fn check_noise(
    robot: &Robot,
    experiment: &dyn Experiment,
    estimator: &dyn Estimator,
) -> Result<(), CurriculumError> {
    let (Some(made), Some(assumed)) = (experiment.known_torque_noise(), estimator.torque_noise()) else {
        return Ok(());
    };
    for ((joint, &made), &assumed) in robot.tree().joint_names().zip(&made).zip(assumed) {
        if made > 0.0 && (assumed / made - 1.0).abs() > ROUNDED {
            return Err(CurriculumError::Noise { joint: joint.to_owned(), made, assumed });
        }
    }
    Ok(())
}
