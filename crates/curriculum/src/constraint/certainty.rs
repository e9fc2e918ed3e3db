//! How sure a belief is, as far as a constraint asks.

use phiw_estimation::{Estimate, Robot, RobotModel, TorqueNoise};
use serde::{Deserialize, Serialize};

/// What is believed of a robot, and how surely.
#[derive(Clone, Copy, Debug)]
pub struct Believed<'a> {
    /// The belief.
    pub model: &'a RobotModel,
    /// How sure it is; none where nothing has been measured, or by an estimator that does not know.
    pub certainty: Option<&'a Certainty>,
}

impl<'a> Believed<'a> {
    /// A belief of which nothing has been measured.
    pub fn unmeasured(model: &'a RobotModel) -> Self {
        Believed { model, certainty: None }
    }
}

/// How sure an estimate is of the base parameters, and what noise it found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certainty {
    /// Covariance of the base parameters, row by row; rows of those that are not determined are zero.
    covariance: Vec<f64>,
    /// Which of them the estimate determines.
    determined: Vec<bool>,
    /// The noise of each torque that moved the robot: standard deviation \[N·m, N\], and correlation from one
    /// command to the next. Empty where the estimator does not know.
    noise: Vec<[f64; 2]>,
}

impl Certainty {
    /// Of an estimate; none if it has no covariance.
    pub fn of(robot: &Robot, estimate: &Estimate) -> Option<Self> {
        let covariance = estimate.covariance.as_ref()?;
        let count = robot.base().count();
        let determined: Vec<bool> = (0..count)
            .map(|k| estimate.standard_deviations.get(k).is_some_and(|std| std.is_finite()))
            .collect();
        let entry = |row: usize, column: usize| match determined[row] && determined[column] {
            true => covariance[(row, column)],
            false => 0.0,
        };
        let rows = (0..count).flat_map(|row| (0..count).map(move |column| (row, column)));
        let covariance = rows.map(|(row, column)| entry(row, column)).collect();
        let noise = |noise: &TorqueNoise| [noise.std, noise.correlation];
        let noise = estimate.noise.iter().flatten().map(noise).collect();
        Some(Certainty { covariance, determined, noise })
    }

    /// Covariance of the base parameters, row by row.
    pub(super) fn covariance(&self) -> &[f64] {
        &self.covariance
    }

    /// Which base parameters are determined.
    pub(super) fn determined(&self) -> &[bool] {
        &self.determined
    }

    /// Standard deviation \[N·m, N\] and correlation of each torque's noise; empty where it is not known.
    pub(super) fn noise(&self) -> &[[f64; 2]] {
        &self.noise
    }
}
