//! The factor of each motion of the dataset, computed once for all iterations and all runs.

use super::Triangle;
use crate::CurriculumError;
use crate::motion::{Motion, MotionDataset};
use phiw_dynamics::check::check_size;
use phiw_estimation::{EstimationError, Evidence, Robot, RobotModel, grouped_factor};
use phiw_identification::{Design, EffectSpec};
use phiw_regressor::RegressorError;
use rayon::prelude::*;

/// One motion as a candidate.
#[derive(Clone, Debug)]
pub struct MotionCandidate {
    /// R of its Φ.
    pub triangle: Triangle,
    /// cond of its Φ alone.
    pub condition_number: f64,
}

/// All motions as candidates, for one model and one weighting of the torques.
///
/// The factors belong to the reference trajectories, as (11) has it: what the robot makes of them is known
/// only after it has done so.
#[derive(Clone, Debug)]
pub struct MotionCandidates {
    weights: Vec<f64>,
    /// The parameters of a belief that the columns belong to.
    parameters: Vec<usize>,
    /// Rows a second of the motion in the middle \[Hz\].
    rate_hz: f64,
    candidates: Vec<MotionCandidate>,
    everything: Triangle,
    /// The same with all columns, those that depend on others, too.
    whole: Triangle,
}

impl MotionCandidates {
    /// Reduces every motion, in parallel: Φ of the rigid body and the `effects`, torque j's rows times
    /// `weights[j]` (all 1 in the paper).
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
        Ok(Self::of_designs(&|| robot.design_of(model), dataset, weights)?.determined())
    }

    /// The same in the columns that all motions together tell apart. Of columns that depend on others, such
    /// as the first joint's rotor inertia on the inertia of its link, the last is left out: with all of them
    /// cond(Φ) is infinite for every motion, and no motion is better than another.
    pub fn determined(self) -> Self {
        let kept = self.everything.independent_columns();
        if kept.len() == self.everything.size() {
            return self;
        }
        let select = |candidate: &MotionCandidate| {
            let triangle = candidate.triangle.select(&kept);
            MotionCandidate { condition_number: triangle.condition_number(), triangle }
        };
        MotionCandidates {
            parameters: kept.iter().map(|&column| self.parameters[column]).collect(),
            candidates: self.candidates.par_iter().map(select).collect(),
            everything: self.everything.select(&kept),
            ..self
        }
    }

    /// The columns that are known before a motion has been run, for beliefs with the columns of `design`:
    /// those of the rigid body, and of the effects that follow from the motion alone. An effect that needs
    /// torques or measured signals says nothing yet, and one that no motion excites would make cond(Φ)
    /// infinite.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn foreseeable(
        robot: &Robot,
        design: &Design,
        dataset: &MotionDataset,
        weights: &[f64],
    ) -> Result<Self, CurriculumError> {
        let all = 0..design.effects().len();
        let mut effects: Vec<usize> =
            all.filter(|&effect| design.effects()[effect].needs().is_empty()).collect();
        loop {
            let specs: Vec<EffectSpec> =
                effects.iter().map(|&effect| design.effects()[effect].spec()).collect();
            let candidates = Self::new(robot, &specs, dataset, weights)?;
            let mut parameters: Vec<usize> = (0..robot.base().count()).collect();
            let mut excited = Vec::new();
            for &effect in &effects {
                let columns = parameters.len()..parameters.len() + design.effect_parameters(effect).len();
                let size = |column| candidates.everything.column(column).iter().map(|x| x * x).sum::<f64>();
                if columns.clone().all(|column| (f64::MIN_POSITIVE..f64::INFINITY).contains(&size(column))) {
                    excited.push(effect);
                }
                parameters.extend(design.effect_parameters(effect));
            }
            if excited.len() == effects.len() {
                return Ok(MotionCandidates { parameters, ..candidates }.determined());
            }
            effects = excited;
        }
    }

    /// Of R of each motion, however it came about: of motions that were reduced elsewhere, or before. The
    /// rows were weighted with `weights`; a motion has `rate_hz` rows a second.
    ///
    /// # Errors
    /// There is no motion, or their columns are not the same.
    pub fn of_triangles(
        triangles: Vec<Triangle>,
        weights: &[f64],
        rate_hz: f64,
    ) -> Result<Self, CurriculumError> {
        let count = triangles.first().ok_or(CurriculumError::NoMotions)?.size();
        for triangle in &triangles {
            check_size("columns of a motion's factor", triangle.size(), count)?;
        }
        let candidate =
            |triangle: Triangle| MotionCandidate { condition_number: triangle.condition_number(), triangle };
        let candidates: Vec<MotionCandidate> = triangles.into_par_iter().map(candidate).collect();
        let mut everything = Triangle::empty(count);
        candidates.iter().for_each(|candidate| everything.absorb(&mut candidate.triangle.clone()));
        let parameters = (0..count).collect();
        let whole = everything.clone();
        Ok(MotionCandidates { weights: weights.to_vec(), parameters, rate_hz, candidates, everything, whole })
    }

    fn of_designs(
        design: &(dyn Fn() -> Result<Design, EstimationError> + Sync),
        dataset: &MotionDataset,
        weights: &[f64],
    ) -> Result<Self, CurriculumError> {
        let reduce = |motion: &Motion| {
            let design = design()?;
            let factor = grouped_factor(&design, motion.block())?.combine(weights)?;
            Ok(Triangle::of_factor(&factor))
        };
        let triangles: Result<Vec<Triangle>, CurriculumError> =
            dataset.motions().par_iter().map(reduce).collect();
        let mut rates: Vec<f64> = dataset.motions().iter().map(|motion| 1.0 / motion.period_s()).collect();
        rates.sort_by(f64::total_cmp);
        let rate_hz = rates.get(rates.len() / 2).copied().unwrap_or(1.0);
        Self::of_triangles(triangles?, weights, rate_hz)
    }

    /// R of all motions together.
    pub fn everything(&self) -> &Triangle {
        &self.everything
    }

    /// R of all motions together with the columns of all parameters, those that depend on others, too.
    pub(crate) fn whole(&self) -> &Triangle {
        &self.whole
    }

    /// What the rows of each torque are multiplied with.
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The candidates, in the order of the dataset.
    pub fn all(&self) -> &[MotionCandidate] {
        &self.candidates
    }

    /// R of what has been measured in the candidates' columns, weighted like them, its rows counted as if
    /// they were as dense in time as those of the motions.
    ///
    /// # Errors
    /// The evidence is of another robot.
    pub fn measured(&self, evidence: &Evidence) -> Result<Triangle, RegressorError> {
        let density = evidence.rate_hz().map_or(1.0, |rate_hz| (self.rate_hz / rate_hz).sqrt());
        let weights: Vec<f64> = self.weights.iter().map(|weight| density * weight).collect();
        Ok(Triangle::of_factor(&evidence.factor().select(&self.parameters)?.combine(&weights)?))
    }
}
