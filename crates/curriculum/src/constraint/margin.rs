//! How far inside the support a motion's ZMP stays, and how sure that is.

use crate::CurriculumError;
use crate::motion::Motion;
use phiw_estimation::{Estimate, ParameterPrior, Robot, RobotModel};
use phiw_regressor::parameter_scales;
use phiw_zmp::{
    BalanceRows, MotionBalance, Stance, ZmpModel, ZmpWorkspace, standard_deviation, standing_parameters,
};

/// The balance of a motion under what is believed.
#[derive(Clone, Debug)]
pub struct MotionMargin {
    /// The worst of both ZMPs.
    pub balance: MotionBalance,
    /// When the multi-body ZMP comes nearest to the border \[s\].
    pub worst_s: f64,
    /// Standard deviation of the multi-body margin there, by all that is known of the parameters \[m\].
    pub margin_std: f64,
    /// The part of it that torques can not identify: the base link, and what of the others only the prior says
    /// \[m\].
    pub unidentifiable_std: f64,
}

impl MotionMargin {
    /// Of a motion under `model`, whose parameters are those of `estimate`. The base link and what torques do
    /// not feel are as uncertain as `prior` says.
    ///
    /// # Errors
    /// Something is not of this robot.
    pub fn of_motion(
        robot: &Robot,
        model: &RobotModel,
        estimate: &Estimate,
        prior: &ParameterPrior,
        stance: &Stance,
        motion: &Motion,
    ) -> Result<Self, CurriculumError> {
        let parameters = standing_parameters(robot.base_link(), &model.standard);
        let mut workspace = ZmpWorkspace::new(robot.tree());
        let samples = (0..motion.samples()).map(|sample| motion.sample(sample));
        let balance = MotionBalance::of_motion(robot.tree(), &parameters, stance, samples, &mut workspace)?;
        let worst = balance.of(ZmpModel::MultiBody).sample;
        let gradient = gradient(robot, stance, &parameters, motion.sample(worst), &mut workspace)?;
        let (of_base_link, of_bodies) = gradient.split_at(gradient.len() - model.standard.len());

        // Standard parameters vary with the base parameters as in `to_standard`, and beside them by what is
        // left of the prior.
        let reference = &prior.model.standard;
        let of_base = robot.base().gradient_of_base(of_bodies, reference)?;
        let map = robot.base().map();
        let left = of_bodies.iter().enumerate().map(|(column, value)| {
            value - of_base.iter().enumerate().map(|(row, value)| value * map[(row, column)]).sum::<f64>()
        });
        let scales = [parameter_scales(robot.base_link()), parameter_scales(reference)].concat();
        let unidentifiable = of_base_link.iter().copied().chain(left).zip(scales);
        let unidentifiable_std = unidentifiable
            .map(|(gradient, scale)| (prior.share * scale * gradient).powi(2))
            .sum::<f64>()
            .sqrt();
        Ok(MotionMargin {
            worst_s: worst as f64 * motion.period_s(),
            margin_std: identified_std(estimate, &of_base)?.hypot(unidentifiable_std),
            unidentifiable_std,
            balance,
        })
    }
}

/// ∂margin/∂parameters at a sample.
fn gradient(
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

/// Standard deviation by the base parameters that are determined; NaN without a covariance. The ZMP does not
/// depend on effects.
fn identified_std(estimate: &Estimate, of_base: &[f64]) -> Result<f64, CurriculumError> {
    let Some(covariance) = &estimate.covariance else { return Ok(f64::NAN) };
    let known: Vec<usize> =
        (0..of_base.len()).filter(|&parameter| estimate.standard_deviations[parameter].is_finite()).collect();
    let own: Vec<f64> =
        known.iter().flat_map(|&row| known.iter().map(move |&column| covariance[(row, column)])).collect();
    let gradient: Vec<f64> = known.iter().map(|&parameter| of_base[parameter]).collect();
    Ok(standard_deviation(&gradient, &own)?)
}
