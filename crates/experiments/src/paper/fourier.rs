//! What people do today: periodic motions whose Fourier coefficients are optimised for a small cond(Φ) under
//! the limits of the joints and the balance of a model (Swevers et al. 1997, Park 2006).
//!
//! cond(Φ) does not depend on the model; whether the robot may be asked for a motion does. So the model is
//! the initial one, which is what somebody has who identifies a robot, or the true one, which nobody has.

use super::setup::Setup;
use super::swing::{FREE, Swing};
use anyhow::ensure;
use phiw_curriculum::CurriculumError;
use phiw_curriculum::constraint::{Believed, Constraint, ZmpConstraint};
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::selection::{Choice, MotionCandidates, Question, Selection, Triangle};
use phiw_estimation::{Robot, RobotModel};
use phiw_plant::apparent_inertia;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;

/// Time between the samples that are looked at while coefficients are sought \[s\]: ten for each period of
/// the highest harmonic and more.
const COARSE_S: f64 = 0.05;
/// Share of the limit of torque that is used: the rest is the feedback's.
const USED_TORQUE: f64 = 0.5;
/// Share of the inertia that a joint feels in the neutral configuration which it must feel everywhere: the
/// controller's gains are made for that one, and with a fifth of it the loop is unstable.
const LEAST_INERTIA: f64 = 0.4;
/// Time between the configurations at which the inertia is looked at \[s\].
const LOOK_EVERY_S: f64 = 0.25;
/// Steps of a search, and trials of each.
const STEPS: usize = 150;
const TRIALS: usize = 8;
/// Halvings in which the size is found at which a motion is allowed.
const HALVINGS: usize = 7;

/// Motions that are done one after the other, with their factors.
pub struct FourierMotions {
    /// The motions, in the order in which they were optimised: each beside those before it.
    pub dataset: MotionDataset,
    /// Their factors.
    pub candidates: MotionCandidates,
}

/// What a search is about.
struct Search<'a> {
    robot: &'a Robot,
    model: &'a RobotModel,
    constraint: &'a ZmpConstraint,
    weights: &'a [f64],
    rotor_inertia: &'a [f64],
    /// What each joint feels in the neutral configuration \[kg·m², kg\].
    neutral_inertia: Vec<f64>,
    duration_s: f64,
}

impl FourierMotions {
    /// As many motions as an experiment has iterations, each as long as the dataset's in the middle,
    /// optimised with what `model` says of the balance. `progress` is told how many are done.
    ///
    /// # Errors
    /// The model is not of this robot, or no motion of any size is allowed.
    pub fn optimised(setup: &Setup, model: &RobotModel, progress: &dyn Fn(usize)) -> anyhow::Result<Self> {
        let robot = &setup.robot;
        let period_s = setup.dataset.motions().first().map_or(COARSE_S, Motion::period_s);
        let search = Search {
            robot,
            model,
            constraint: &ZmpConstraint { false_falls: None, ..setup.constraint.clone() },
            weights: setup.candidates.weights(),
            neutral_inertia: apparent_inertia(
                robot.tree(),
                &setup.subject.rotor_inertia,
                &robot.tree().neutral_configuration(),
            )?,
            rotor_inertia: &setup.subject.rotor_inertia,
            duration_s: setup.settings.fourier_s,
        };
        let mut motions = Vec::new();
        let mut measured: Option<Triangle> = None;
        for index in 0..setup.settings.iterations {
            progress(index);
            let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
            let coefficients = search.best(measured.as_ref(), &mut rng)?;
            let name = format!("fourier_{index}");
            let (motion, is_allowed) = search.allowed(&name, &coefficients, period_s)?;
            ensure!(is_allowed, "{name} is allowed at no size once all its samples are looked at");
            let mut stack = search.triangle(&motion)?;
            if let Some(mut measured) = measured {
                stack.absorb(&mut measured);
            }
            measured = Some(stack);
            motions.push(motion);
        }
        let dataset = MotionDataset::new(robot.tree().joint_count(), motions)?;
        let candidates = MotionCandidates::new(robot, robot.declared(), &dataset, search.weights)?;
        Ok(FourierMotions { dataset, candidates })
    }
}

impl Search<'_> {
    /// An evolution with one parent: of some trials about it the best takes its place if it is better, and
    /// the steps grow or shrink with the success (Rechenberg's rule). Deterministic for a seed.
    fn best(&self, measured: Option<&Triangle>, rng: &mut dyn Rng) -> anyhow::Result<Vec<f64>> {
        let count = FREE * self.robot.tree().joint_count();
        let normal =
            |rng: &mut dyn Rng| -> Vec<f64> { (0..count).map(|_| StandardNormal.sample(rng)).collect() };
        let mut parent = normal(rng);
        let mut cost = self.cost(&parent, measured)?;
        let mut step = 0.5;
        for _ in 0..STEPS {
            let trials: Vec<Vec<f64>> = (0..TRIALS)
                .map(|_| {
                    // A trial changes some joints and leaves others.
                    let changed: Vec<bool> = (0..count / FREE).map(|_| rng.random_bool(0.3)).collect();
                    let change = normal(rng);
                    let sum =
                        |(k, x): (usize, &f64)| x + if changed[k / FREE] { step * change[k] } else { 0.0 };
                    parent.iter().enumerate().map(sum).collect()
                })
                .collect();
            let costs: Vec<f64> =
                trials.par_iter().map(|trial| self.cost(trial, measured)).collect::<anyhow::Result<_>>()?;
            let best = (0..TRIALS).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0);
            let better = costs[best] < cost;
            if better {
                (parent, cost) = (trials[best].clone(), costs[best]);
            }
            step = (step * if better { 1.2 } else { 0.9 }).clamp(0.02, 2.0);
        }
        ensure!(cost.is_finite(), "no periodic motion of any size is allowed by this model");
        Ok(parent)
    }

    /// ln cond(Φ) of all that was measured and the motion at the largest size that is allowed; infinite if
    /// none is.
    fn cost(&self, coefficients: &[f64], measured: Option<&Triangle>) -> anyhow::Result<f64> {
        let (motion, is_allowed) = self.allowed("trial", coefficients, COARSE_S)?;
        if !is_allowed {
            return Ok(f64::INFINITY);
        }
        let mut stack = self.triangle(&motion)?;
        if let Some(measured) = measured {
            stack.absorb(&mut measured.clone());
        }
        let condition = stack.condition_number().ln();
        Ok(if condition.is_nan() { f64::INFINITY } else { condition })
    }

    fn triangle(&self, motion: &Motion) -> Result<Triangle, CurriculumError> {
        let alone = MotionDataset::new(self.robot.tree().joint_count(), vec![motion.clone()])?;
        let candidates = MotionCandidates::new(self.robot, self.robot.declared(), &alone, self.weights)?;
        Ok(candidates.everything().clone())
    }

    /// The motion at the largest size at which the model keeps its balance, and whether it does at all.
    fn allowed(&self, name: &str, coefficients: &[f64], period_s: f64) -> anyhow::Result<(Motion, bool)> {
        let whole = self.motion(name, coefficients, 1.0, period_s)?;
        if self.is_allowed(&whole)? {
            return Ok((whole, true));
        }
        let (mut low, mut high) = (0.0, 1.0);
        let mut best = None;
        for _ in 0..HALVINGS {
            let size = 0.5 * (low + high);
            let motion = self.motion(name, coefficients, size, period_s)?;
            if self.is_allowed(&motion)? {
                (low, best) = (size, Some(motion));
            } else {
                high = size;
            }
        }
        let is_allowed = best.is_some();
        Ok((best.unwrap_or(whole), is_allowed))
    }

    /// Whether the model keeps its balance and has the torques, and the controller is stable.
    fn is_allowed(&self, motion: &Motion) -> anyhow::Result<bool> {
        let believed = Believed::unmeasured(self.model);
        if self.constraint.safety(self.robot, &believed, motion)?.largest_reduction < 0.0 {
            return Ok(false);
        }
        let tree = self.robot.tree();
        let torque =
            motion.torques(&self.robot.design_of(self.model)?, &self.model.parameters(self.robot)?)?;
        let joints = tree.joint_count();
        let within = |(place, torque): (usize, &f64)| {
            torque.abs() <= USED_TORQUE * tree.joint(place % joints).limits.effort
        };
        if !torque.iter().enumerate().all(within) {
            return Ok(false);
        }
        let every = ((LOOK_EVERY_S / motion.period_s()).round() as usize).max(1);
        for sample in (0..motion.samples()).step_by(every) {
            let felt = apparent_inertia(tree, self.rotor_inertia, motion.sample(sample)[0])?;
            let mut felt = felt.iter().zip(&self.neutral_inertia);
            if felt.any(|(felt, neutral)| *felt < LEAST_INERTIA * neutral) {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Each joint swings about its middle within its limits of position and speed; middle and swing are
    /// `size` of what the coefficients ask for, from the neutral configuration.
    fn motion(
        &self,
        name: &str,
        coefficients: &[f64],
        size: f64,
        period_s: f64,
    ) -> Result<Motion, CurriculumError> {
        let tree = self.robot.tree();
        let joints: Vec<Swing> = coefficients
            .chunks_exact(FREE)
            .enumerate()
            .map(|(joint, free)| Swing::new(tree, joint, free, size, self.duration_s))
            .collect();
        let samples = (self.duration_s / period_s).round() as usize + 1;
        Motion::of_reference(name, "fourier", joints.len(), (samples, period_s), |t, q, v, a| {
            for (joint, swing) in joints.iter().enumerate() {
                [q[joint], v[joint], a[joint]] = swing.at(t);
            }
        })
    }
}

/// The motions one after the other.
pub struct InOrder;

impl Selection for InOrder {
    fn name(&self) -> &'static str {
        "in_order"
    }

    fn choose(&self, question: &Question<'_>, _: &mut dyn Rng) -> Choice {
        let next = question.history.len().min(question.dataset.motions().len() - 1);
        Choice { motion: next, merit: None, runner_up: None }
    }
}
