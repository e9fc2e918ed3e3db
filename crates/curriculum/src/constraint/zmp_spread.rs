//! How far the ZMP of a motion may be from where a belief has it.

use super::{Believed, FalseFalls};
use crate::CurriculumError;
use faer::{Mat, MatRef};
use phiw_dynamics::dense::{Cholesky, dot};
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::{Tree, Workspace};
use phiw_estimation::Robot;
use phiw_regressor::parameter_scales;
use phiw_zmp::{BalanceRows, Stance, ZmpModel, ZmpWorkspace};

/// Acceleration by which the ZMP's slope along a joint's acceleration is found \[rad/s², m/s²\]: small
/// against gravity over a lever of a metre, large against rounding.
const STEP: f64 = 1e-3;

/// The covariance of the ZMP under one belief, for any posture.
pub(super) struct ZmpSpread<'a> {
    robot: &'a Robot,
    stance: &'a Stance,
    model: ZmpModel,
    settings: FalseFalls,
    /// Covariance of the standing parameters: the base link's, then the bodies'.
    parameters: Mat<f64>,
    /// The robot of the belief; and with spheres in the place of its bodies, which may not exist.
    trees: [Tree; 2],
    /// Standard deviation and correlation of each torque's noise.
    noise: Vec<[f64; 2]>,
}

/// Room for one sample.
pub(super) struct SpreadScratch {
    rows: BalanceRows,
    gradient: Vec<f64>,
    accelerations: Vec<f64>,
    /// ∂ZMP/∂a, x and y.
    slopes: [Vec<f64>; 2],
    mass: Vec<f64>,
    workspace: Workspace<f64>,
}

impl<'a> ZmpSpread<'a> {
    /// Under a belief.
    ///
    /// # Errors
    /// The belief is not of this robot.
    pub fn new(
        robot: &'a Robot,
        believed: &Believed<'_>,
        (stance, model): (&'a Stance, ZmpModel),
        settings: FalseFalls,
    ) -> Result<Self, CurriculumError> {
        let (base, standard) = (robot.base(), &believed.model.standard);
        let count = base.count();
        let nothing = (vec![0.0; count * count], vec![false; count]);
        let (covariance, determined) = match believed.certainty {
            Some(certainty) => (certainty.covariance(), certainty.determined()),
            None => (nothing.0.as_slice(), nothing.1.as_slice()),
        };
        let of_base = MatRef::from_row_major_slice(covariance, count, count);
        let bodies = base.covariance_of_standard((of_base, determined), standard, settings.belief_share)?;
        let of_link = parameter_scales(robot.base_link());
        let (link, size) = (PARAMETERS_PER_BODY, PARAMETERS_PER_BODY + standard.len());
        let parameters = Mat::from_fn(size, size, |row, column| match (row >= link, column >= link) {
            (true, true) => bodies[(row - link, column - link)],
            (false, false) if row == column => (settings.base_link_share * of_link[row]).powi(2),
            _ => 0.0,
        });
        let noise = match believed.certainty.map(|certainty| certainty.noise()) {
            Some(noise) if !noise.is_empty() => noise.to_vec(),
            _ => {
                let limit = |joint: usize| robot.tree().joint(joint).limits.effort;
                let noise = |joint: usize| match limit(joint) {
                    limit if limit.is_finite() => [settings.unmeasured_noise * limit, 0.0],
                    _ => [0.0; 2],
                };
                (0..robot.tree().joint_count()).map(noise).collect()
            }
        };
        let trees = [believed.model.tree(robot)?, believed.model.of_spheres().tree(robot)?];
        Ok(ZmpSpread { robot, stance, model, settings, parameters, trees, noise })
    }

    /// Room for its work.
    pub fn scratch(&self) -> SpreadScratch {
        let joints = self.noise.len();
        let rows = BalanceRows::new(self.robot.tree());
        SpreadScratch {
            gradient: vec![0.0; 2 * rows.parameter_count()],
            rows,
            accelerations: vec![0.0; joints],
            slopes: [vec![0.0; joints], vec![0.0; joints]],
            mass: vec![0.0; joints * joints],
            workspace: Workspace::new(&self.trees[0]),
        }
    }

    /// Covariance of the ZMP at a sample `[q, v, a]` under the standing parameters `standing` \[m²\]: xx, xy,
    /// yy; infinite where the robot does not press on the floor.
    ///
    /// # Errors
    /// The sample is not of this robot.
    pub fn at(
        &self,
        standing: &[f64],
        [q, v, a]: [&[f64]; 3],
        workspace: &mut ZmpWorkspace,
        scratch: &mut SpreadScratch,
    ) -> Result<[f64; 3], CurriculumError> {
        let floor = self.stance.floor_height();
        scratch.rows.compute(self.robot.tree(), q, v, a, workspace)?;
        let balance = scratch.rows.balance(standing)?;
        let zmp = scratch.rows.zmp_gradient(self.model, &balance, floor, &mut scratch.gradient)?;
        let Some(zmp) = zmp else { return Ok([f64::INFINITY, 0.0, f64::INFINITY]) };
        let (of_x, of_y) = scratch.gradient.split_at(standing.len());
        let mut covariance = [0.0; 3];
        for (column, (x, y)) in of_x.iter().zip(of_y).enumerate() {
            let own = self.parameters.col_as_slice(column);
            let (along_x, along_y) = (dot(own, of_x), dot(own, of_y));
            covariance[0] += along_x * x;
            covariance[1] += along_x * y;
            covariance[2] += along_y * y;
        }
        let height = (balance.center_of_mass.position[2] - floor).max(0.0);
        let weight = balance.wrench[2] / balance.center_of_mass.mass;
        let noise =
            self.noise(standing, ([q, v, a], zmp), (weight / height.max(1e-3)).sqrt(), workspace, scratch)?;
        covariance.iter_mut().zip(noise).for_each(|(sum, noise)| *sum += noise);
        Ok(covariance)
    }

    /// The share of the noise that moves the robot.
    ///
    /// What tips a robot over is not the ZMP of one instant but its mean over the time in which an inverted
    /// pendulum of the same height falls, 1/ω with ω² = g/z, weighted by exp(−ω·t) (Kajita et al. 2001). Of
    /// noise that is held for a period h and has the correlation ρ from one to the next, with a = exp(−ω·h),
    /// that mean has (1 − a)/(1 + a)·(1 + a·ρ)/(1 − a·ρ) of the variance.
    fn noise(
        &self,
        standing: &[f64],
        ([q, v, a], zmp): ([&[f64]; 3], [f64; 2]),
        omega: f64,
        workspace: &mut ZmpWorkspace,
        scratch: &mut SpreadScratch,
    ) -> Result<[f64; 3], CurriculumError> {
        let joints = self.noise.len();
        scratch.accelerations.copy_from_slice(a);
        for joint in 0..joints {
            scratch.accelerations[joint] += STEP;
            let moved = workspace.evaluate(self.robot.tree(), standing, q, v, &scratch.accelerations)?;
            scratch.accelerations[joint] = a[joint];
            let moved = moved.zmp(self.model, self.stance.floor_height()).unwrap_or(zmp);
            for (slopes, (moved, zmp)) in scratch.slopes.iter_mut().zip(moved.iter().zip(zmp)) {
                slopes[joint] = (moved - zmp) / STEP;
            }
        }
        let mut found = None;
        for tree in &self.trees {
            tree.mass_matrix(q, &mut scratch.workspace, &mut scratch.mass)?;
            found = Cholesky::of(joints, |row, column| scratch.mass[row * joints + column]);
            if found.is_some() {
                break;
            }
        }
        let Some(mass) = found else { return Ok([f64::INFINITY, 0.0, f64::INFINITY]) };
        // (∂ZMP/∂a)·M⁻¹, a number for each torque.
        for slopes in &mut scratch.slopes {
            mass.solve_lower(slopes);
            mass.solve_upper(slopes);
        }
        let stays = (-omega * self.settings.control_period_s).exp();
        let mut covariance = [0.0; 3];
        for (joint, [std, correlation]) in self.noise.iter().enumerate() {
            let coloured = (1.0 + stays * correlation) / (1.0 - stays * correlation);
            let variance = std * std * (1.0 - stays) / (1.0 + stays) * coloured;
            let [x, y] = [0, 1].map(|axis: usize| scratch.slopes[axis][joint]);
            covariance[0] += variance * x * x;
            covariance[1] += variance * x * y;
            covariance[2] += variance * y * y;
        }
        Ok(covariance)
    }
}
