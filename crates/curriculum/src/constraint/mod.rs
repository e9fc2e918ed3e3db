//! Which motions the robot may be asked for: the constraint (12).

mod certainty;
mod false_falls;
mod margin;
mod stance;
mod zmp_spread;

pub use certainty::{Believed, Certainty};
pub use false_falls::FalseFalls;
pub use margin::MotionMargin;
pub use stance::{StanceError, StanceSettings};

use crate::CurriculumError;
use crate::motion::{Motion, MotionDataset};
use phiw_estimation::Robot;
use phiw_zmp::{Stance, SureMargin, WorstZmp, ZmpModel, ZmpWorkspace, standing_parameters};
use rayon::prelude::*;
use zmp_spread::ZmpSpread;

/// What a constraint says of one motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Safety {
    /// The largest reduction coefficient α at which the motion is allowed; negative if it never is. It
    /// counts the uncertainty where the constraint does.
    pub largest_reduction: f64,
    /// Smallest signed distance of the ZMP from the border of the region \[m\]; −∞ if the robot would leave
    /// the floor, +∞ without a region.
    pub margin_m: f64,
    /// The same with the uncertainty taken off \[m\]; [`Self::margin_m`] where the constraint counts none.
    pub sure_margin_m: f64,
}

/// Judges motions by what is believed of the robot: hⁱ(Qʳ, wⁱ) ≤ 0.
pub trait Constraint: Send + Sync {
    /// Its name, for reports: `zmp`.
    fn name(&self) -> &'static str;

    /// How safe a motion is.
    ///
    /// # Errors
    /// The model or the motion is not of this robot.
    fn safety(
        &self,
        robot: &Robot,
        believed: &Believed<'_>,
        motion: &Motion,
    ) -> Result<Safety, CurriculumError>;

    /// How safe all motions are.
    ///
    /// # Errors
    /// As [`Self::safety`].
    fn all(
        &self,
        robot: &Robot,
        believed: &Believed<'_>,
        dataset: &MotionDataset,
    ) -> Result<Vec<Safety>, CurriculumError> {
        dataset.motions().iter().map(|motion| self.safety(robot, believed, motion)).collect()
    }
}

/// The ZMP stays inside the reduced support polygon: equations (8) to (10); and, where a rate of false falls
/// is asked for, so far inside that what the belief does not know takes it out no more often than that.
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
    /// How the uncertainty counts. Default: not at all, as in the paper.
    pub false_falls: Option<FalseFalls>,
}

impl ZmpConstraint {
    /// For a robot that could fall: the ZMP of all bodies at every sample.
    pub fn new(stance: Stance) -> Self {
        ZmpConstraint { stance, model: ZmpModel::MultiBody, period_s: 0.0, false_falls: None }
    }

    /// As in the paper: equation (8), looked at every 20 ms.
    pub fn of_the_paper(stance: Stance) -> Self {
        ZmpConstraint { stance, model: ZmpModel::PointMass, period_s: 0.02, false_falls: None }
    }

    /// The same that counts what the belief does not know.
    pub fn counting(self, false_falls: FalseFalls) -> Self {
        ZmpConstraint { false_falls: Some(false_falls), ..self }
    }
}

impl Constraint for ZmpConstraint {
    fn name(&self) -> &'static str {
        "zmp"
    }

    fn safety(
        &self,
        robot: &Robot,
        believed: &Believed<'_>,
        motion: &Motion,
    ) -> Result<Safety, CurriculumError> {
        self.of_motion(robot, believed, self.spread(robot, believed)?.as_ref(), motion)
    }

    fn all(
        &self,
        robot: &Robot,
        believed: &Believed<'_>,
        dataset: &MotionDataset,
    ) -> Result<Vec<Safety>, CurriculumError> {
        let spread = self.spread(robot, believed)?;
        let motions = dataset.motions().par_iter();
        motions.map(|motion| self.of_motion(robot, believed, spread.as_ref(), motion)).collect()
    }
}

impl ZmpConstraint {
    fn spread<'a>(
        &'a self,
        robot: &'a Robot,
        believed: &Believed<'_>,
    ) -> Result<Option<ZmpSpread<'a>>, CurriculumError> {
        let spread = |settings| ZmpSpread::new(robot, believed, (&self.stance, self.model), settings);
        self.false_falls.map(spread).transpose()
    }

    fn of_motion(
        &self,
        robot: &Robot,
        believed: &Believed<'_>,
        spread: Option<&ZmpSpread<'_>>,
        motion: &Motion,
    ) -> Result<Safety, CurriculumError> {
        let parameters = standing_parameters(robot.base_link(), &believed.model.standard);
        let stride = ((self.period_s / motion.period_s()).round() as usize).max(1);
        let samples: Vec<usize> = (0..motion.samples()).step_by(stride).collect();
        let mut workspace = ZmpWorkspace::new(robot.tree());
        let mut worst = WorstZmp::NONE;
        let mut zmps = Vec::with_capacity(samples.len());
        for &sample in &samples {
            let [q, v, a] = motion.sample(sample);
            let balance = workspace.evaluate(robot.tree(), &parameters, q, v, a)?;
            let zmp = balance.zmp(self.model, self.stance.floor_height());
            worst.add(sample, zmp, &self.stance);
            zmps.push(zmp);
        }
        let WorstZmp { largest_reduction, margin: margin_m, .. } = worst;
        let (Some(spread), Some(false_falls)) = (spread, self.false_falls) else {
            return Ok(Safety { largest_reduction, margin_m, sure_margin_m: margin_m });
        };
        let (deviations, mut scratch) = (false_falls.deviations(), spread.scratch());
        let together = (false_falls.instant_every_s / (motion.period_s() * stride as f64)).round() as usize;
        let mut safety = Safety { largest_reduction, margin_m, sure_margin_m: margin_m };
        for (samples, zmps) in samples.chunks(together.max(1)).zip(zmps.chunks(together.max(1))) {
            let middle = motion.sample(samples[samples.len() / 2]);
            let covariance = spread.at(&parameters, middle, &mut workspace, &mut scratch)?;
            for zmp in zmps.iter().flatten() {
                let about = self.stance.about();
                let sure = self.stance.support().sure_margin(*zmp, covariance, deviations, about);
                let SureMargin { margin, largest_reduction } = sure;
                safety.sure_margin_m = safety.sure_margin_m.min(margin);
                safety.largest_reduction = safety.largest_reduction.min(largest_reduction);
            }
        }
        Ok(safety)
    }
}

/// Every motion is allowed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Unconstrained;

impl Constraint for Unconstrained {
    fn name(&self) -> &'static str {
        "none"
    }

    fn safety(&self, _: &Robot, _: &Believed<'_>, _: &Motion) -> Result<Safety, CurriculumError> {
        Ok(Safety { largest_reduction: 1.0, margin_m: f64::INFINITY, sure_margin_m: f64::INFINITY })
    }
}
