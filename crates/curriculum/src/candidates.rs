//! What each motion of the dataset would tell: its factor, computed once for all iterations and all runs.

use crate::triangle::Triangle;
use crate::{CurriculumError, MotionDataset, Robot, RobotModel};
use phiw_identification::{Design, EffectSpec, Fold, accumulate};
use phiw_regressor::RegressorError;
use phiw_regressor::least_squares::GroupedFactor;
use phiw_telemetry::Block;
use rayon::prelude::*;

/// One motion as a candidate.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// R of its Φ.
    pub triangle: Triangle,
    /// cond of its Φ alone.
    pub condition_number: f64,
}

/// All motions as candidates, for one model and one weighting of the torques.
///
/// The factors belong to the reference trajectories, as (11) has it: what the robot makes of them is known only after it has done so.
#[derive(Clone, Debug)]
pub struct Candidates {
    weights: Vec<f64>,
    candidates: Vec<Candidate>,
    everything: Triangle,
}

impl Candidates {
    /// Reduces every motion, in parallel: Φ of the rigid body and the `effects`, torque j's rows times `weights[j]` (all 1 in the paper).
    ///
    /// # Errors
    /// An effect is unknown, or the motions or weights are not of this robot.
    pub fn new(
        robot: &Robot,
        effects: &[EffectSpec],
        dataset: &MotionDataset,
        weights: &[f64],
    ) -> Result<Self, CurriculumError> {
        Self::of_designs(&|| robot.design(effects), dataset, weights)
    }

    /// The same for a belief with any effects, which is the reference of those that need torques.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of_model(
        robot: &Robot,
        model: &RobotModel,
        dataset: &MotionDataset,
        weights: &[f64],
    ) -> Result<Self, CurriculumError> {
        Self::of_designs(&|| robot.design_of(model), dataset, weights)
    }

    fn of_designs(
        design: &(dyn Fn() -> Result<Design, CurriculumError> + Sync),
        dataset: &MotionDataset,
        weights: &[f64],
    ) -> Result<Self, CurriculumError> {
        let reduce = |motion: &crate::Motion| {
            let design = design()?;
            let factor = grouped_factor(&design, motion.block())?.combine(weights)?;
            let triangle = Triangle::of_factor(&factor);
            Ok(Candidate { condition_number: triangle.condition_number(), triangle })
        };
        let candidates: Result<Vec<Candidate>, CurriculumError> =
            dataset.motions().par_iter().map(reduce).collect();
        let candidates = candidates?;
        let mut everything = Triangle::empty(design()?.parameter_count());
        candidates.iter().for_each(|candidate| everything.absorb(&mut candidate.triangle.clone()));
        Ok(Candidates { weights: weights.to_vec(), candidates, everything })
    }

    /// R of all motions together.
    pub fn everything(&self) -> &Triangle {
        &self.everything
    }

    /// What the rows of each torque are multiplied with.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The candidates, in the order of the dataset.
    pub fn all(&self) -> &[Candidate] {
        &self.candidates
    }

    /// R of what has been measured, weighted like the candidates.
    ///
    /// # Errors
    /// The factor is of another robot.
    pub fn measured(&self, factor: &GroupedFactor) -> Result<Triangle, RegressorError> {
        Ok(Triangle::of_factor(&factor.combine(&self.weights)?))
    }
}

/// The factors of a block's rows, one for each torque.
pub(crate) fn grouped_factor(design: &Design, block: Block) -> Result<GroupedFactor, CurriculumError> {
    let everything = Fold { log: block.log, start: f64::NEG_INFINITY, end: f64::INFINITY };
    let mut factors = accumulate(design, &[everything], &[&vec![block]])?;
    Ok(factors.swap_remove(0))
}
