//! Which motions the robot may be asked for: the constraint (12).

mod margin;
mod stance;

pub use margin::MotionMargin;
pub use stance::{StanceError, StanceSettings};

use crate::CurriculumError;
use crate::motion::{Motion, MotionDataset};
use phiw_estimation::{Robot, RobotModel};
use phiw_zmp::{MotionBalance, Stance, ZmpModel, ZmpWorkspace, standing_parameters};

/// What a constraint says of one motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    /// The largest reduction coefficient α at which the motion is allowed; negative if it never is.
    pub largest_reduction: f64,
    /// Smallest signed distance of the ZMP from the border of the region \[m\]; −∞ if the robot would leave
    /// the floor, +∞ without a region.
    pub margin_m: f64,
}

/// Judges motions by what is believed of the robot: hⁱ(Qʳ, wⁱ) ≤ 0.
pub trait Constraint: Send + Sync {
    /// Its name, for reports: `zmp`.
    fn name(&self) -> &'static str;

    /// How safe a motion is.
    ///
    /// # Errors
    /// The model or the motion is not of this robot.
    fn safety(&self, robot: &Robot, model: &RobotModel, motion: &Motion) -> Result<Safety, CurriculumError>;

    /// How safe all motions are.
    ///
    /// # Errors
    /// As [`Self::safety`].
    fn all(
        &self,
        robot: &Robot,
        model: &RobotModel,
        dataset: &MotionDataset,
    ) -> Result<Vec<Safety>, CurriculumError> {
        dataset.motions().iter().map(|motion| self.safety(robot, model, motion)).collect()
    }
}

/// The ZMP stays inside the reduced support polygon: equations (8) to (10).
///
/// The largest α at which a motion is allowed is found once for each belief, and answers for every α.
#[derive(Clone, Debug)]
pub struct ZmpConstraint {
    /// What the robot stands on.
    pub stance: Stance,
    /// Which ZMP. Default: [`ZmpModel::MultiBody`], what a force plate sees. The paper's is
    /// [`ZmpModel::PointMass`], equation (8), which leaves out that bodies turn.
    pub model: ZmpModel,
    /// Time between the samples that are looked at \[s\]; every sample is looked at where that is shorter
    /// than the motion's period. Default: 0.
    pub period_s: f64,
}

impl ZmpConstraint {
    /// For a robot that could fall: the ZMP of all bodies at every sample.
    pub fn new(stance: Stance) -> Self {
        ZmpConstraint { stance, model: ZmpModel::MultiBody, period_s: 0.0 }
    }

    /// As in the paper: equation (8), looked at every 20 ms.
    pub fn of_the_paper(stance: Stance) -> Self {
        ZmpConstraint { stance, model: ZmpModel::PointMass, period_s: 0.02 }
    }
}

impl Constraint for ZmpConstraint {
    fn name(&self) -> &'static str {
        "zmp"
    }

    fn safety(&self, robot: &Robot, model: &RobotModel, motion: &Motion) -> Result<Safety, CurriculumError> {
        let parameters = standing_parameters(robot.base_link(), &model.standard);
        let stride = ((self.period_s / motion.period_s()).round() as usize).max(1);
        let samples = (0..motion.samples()).step_by(stride).map(|sample| motion.sample(sample));
        let mut workspace = ZmpWorkspace::new(robot.tree());
        let balance =
            MotionBalance::of_motion(robot.tree(), &parameters, &self.stance, samples, &mut workspace)?;
        let worst = balance.of(self.model);
        Ok(Safety { largest_reduction: worst.largest_reduction, margin_m: worst.margin })
    }
}

/// Every motion is allowed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unconstrained;

impl Constraint for Unconstrained {
    fn name(&self) -> &'static str {
        "none"
    }

    fn safety(&self, _: &Robot, _: &RobotModel, _: &Motion) -> Result<Safety, CurriculumError> {
        Ok(Safety { largest_reduction: 1.0, margin_m: f64::INFINITY })
    }
}
