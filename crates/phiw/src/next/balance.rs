//! How far inside the support the chosen motion's ZMP stays, and how sure that is.

use super::estimate::Estimate;
use crate::Error;
use phiw_curriculum::{CurriculumError, Motion, Robot};
use phiw_regressor::parameter_scales;
use phiw_zmp::{
    BalanceRows, MotionBalance, Stance, ZmpModel, ZmpWorkspace, standard_deviation, standing_parameters,
};

/// The balance of a motion under the present estimate.
pub struct Balance {
    /// The worst of both ZMPs.
    pub motion: MotionBalance,
    /// When the multi-body ZMP comes nearest to the border \[s\].
    pub worst_s: f64,
    /// Standard deviation of the multi-body margin there, by all that is known of the parameters \[m\].
    pub margin_std: f64,
    /// The part of it that no torque can tell: the base link, and what of the others only the URDF says \[m\].
    pub untold_std: f64,
}

/// Of one motion, for a robot whose URDF is `urdf_error` of each body's magnitude off.
pub fn of_motion(
    robot: &Robot,
    estimate: &Estimate,
    stance: &Stance,
    motion: &Motion,
    urdf_error: f64,
) -> Result<Balance, Error> {
    let parameters = standing_parameters(robot.base_link(), &estimate.model.standard);
    let mut workspace = ZmpWorkspace::new(robot.tree());
    let samples = (0..motion.samples()).map(|sample| motion.sample(sample));
    let balance = MotionBalance::of_motion(robot.tree(), &parameters, stance, samples, &mut workspace)
        .map_err(CurriculumError::from)?;
    let worst = balance.of(ZmpModel::MultiBody).sample;
    let gradient = margin_gradient(robot, stance, &parameters, motion.sample(worst), &mut workspace)?;
    let (of_base_link, of_bodies) = gradient.split_at(gradient.len() - estimate.model.standard.len());

    // Standard parameters vary with the base parameters as in `to_standard`, and beside them by what is left of the URDF's error.
    let reference = &estimate.initial.standard;
    let of_base = robot.base().gradient_of_base(of_bodies, reference).map_err(CurriculumError::from)?;
    let map = robot.base().map();
    let left = of_bodies.iter().enumerate().map(|(column, value)| {
        value - of_base.iter().enumerate().map(|(row, told)| told * map[(row, column)]).sum::<f64>()
    });
    let scales = [parameter_scales(robot.base_link()), parameter_scales(reference)].concat();
    let untold = of_base_link.iter().copied().chain(left).zip(scales);
    let untold_std =
        untold.map(|(gradient, scale)| (urdf_error * scale * gradient).powi(2)).sum::<f64>().sqrt();
    let told_std = told_std(estimate, &of_base)?;
    Ok(Balance {
        worst_s: worst as f64 * motion.period_s(),
        margin_std: told_std.hypot(untold_std),
        untold_std,
        motion: balance,
    })
}

/// ∂margin/∂parameters at a sample.
fn margin_gradient(
    robot: &Robot,
    stance: &Stance,
    parameters: &[f64],
    [q, v, a]: [&[f64]; 3],
    workspace: &mut ZmpWorkspace,
) -> Result<Vec<f64>, CurriculumError> {
    let mut rows = BalanceRows::new(robot.tree());
    rows.compute(robot.tree(), q, v, a, workspace)?;
    let balance = rows.balance(parameters)?;
    let mut of_zmp = vec![0.0; 2 * parameters.len()];
    let zmp = rows.zmp_gradient(ZmpModel::MultiBody, &balance, stance.floor_height(), &mut of_zmp)?;
    let [x, y] = zmp.map_or([0.0; 2], |zmp| stance.support().nearest_edge(zmp).gradient);
    let (of_x, of_y) = of_zmp.split_at(parameters.len());
    Ok(of_x.iter().zip(of_y).map(|(of_x, of_y)| x * of_x + y * of_y).collect())
}

/// Standard deviation by the base parameters.
fn told_std(estimate: &Estimate, of_base: &[f64]) -> Result<f64, CurriculumError> {
    let covariance = estimate.known.unit_covariance()?;
    let size = estimate.determined.len();
    let covariance: Vec<f64> =
        (0..size * size).map(|index| covariance[(index / size, index % size)]).collect();
    // Effects follow the base parameters, and the ZMP does not depend on them.
    let gradient: Vec<f64> = estimate
        .determined
        .iter()
        .map(|&parameter| of_base.get(parameter).copied().unwrap_or_default())
        .collect();
    Ok(standard_deviation(&gradient, &covariance)?)
}
