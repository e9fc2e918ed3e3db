//! A seven-joint arm with noise, over the analytic backend: what most tests here run.

#![allow(dead_code, reason = "each test file uses a part")]

use phiw_curriculum::constraint::Unconstrained;
use phiw_curriculum::end::EndCriterion;
use phiw_curriculum::motion::{Motion, MotionDataset};
use phiw_curriculum::selection::MotionCandidates;
use phiw_curriculum::{Curriculum, Experiment};
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{AnalyticBackend, Tree, World};
use phiw_effects::Catalogue;
use phiw_estimation::{Estimator, MotionLikelihood, Robot, RobotModel};
use phiw_plant::{Friction, Gains, MultiSine, PlantEffect, Reference, Sensors, Timing};
use phiw_simulated_robot::*;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

/// The arm, its motions, and everything that a curriculum needs.
pub struct Arm {
    pub tree: Tree,
    pub robot: Robot,
    pub truth: RobotModel,
    pub viscous: Vec<f64>,
    pub dataset: MotionDataset,
    pub candidates: MotionCandidates,
    pub noise: f64,
}

pub fn tree() -> Tree {
    read_urdf(include_str!("../../../../models/arm7.urdf"), &UrdfOptions::default()).unwrap().tree
}

/// `count` multisines of 3 s, each faster than the last.
pub fn motions(tree: &Tree, count: usize) -> Vec<Motion> {
    let joints = tree.joint_count();
    let motion = |index: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
        let sine = MultiSine::random(tree, 3.0, 0.4 + 0.2 * index as f64, [0.5, 0.4], &mut rng);
        let mut signals = [0; 3].map(|_| vec![0.0; 301 * joints]);
        let [q, v, a] = &mut signals;
        for sample in 0..301 {
            let row = sample * joints..(sample + 1) * joints;
            sine.at(0.01 * sample as f64, &mut q[row.clone()], &mut v[row.clone()], &mut a[row]);
        }
        Motion::new(&format!("sine_{index}"), "sine", joints, 0.01, signals).unwrap()
    };
    (0..count).map(motion).collect()
}

impl Arm {
    pub fn new(noise: f64) -> Self {
        let tree = tree();
        let robot = Robot::with_viscous_friction(tree.clone(), [0.0; 10], Catalogue::default()).unwrap();
        let viscous: Vec<f64> = (0..tree.joint_count())
            .map(|joint| 0.02 * tree.joint(joint).limits.effort / tree.joint(joint).limits.velocity)
            .collect();
        let truth = robot.truth(&viscous).unwrap();
        let dataset = MotionDataset::new(tree.joint_count(), motions(&tree, 6)).unwrap();
        let weights = vec![1.0; tree.joint_count()];
        let candidates = MotionCandidates::new(&robot, robot.declared(), &dataset, &weights).unwrap();
        Arm { tree, robot, truth, viscous, dataset, candidates, noise }
    }

    pub fn experiment(&self) -> SimulatedRobot {
        let gains =
            Gains::critically_damped(&self.tree, &[], &self.tree.neutral_configuration(), 12.0).unwrap();
        let friction = |(joint, &coefficient): (usize, &f64)| PlantEffect::Friction {
            joint,
            law: Friction::Viscous { coefficient },
        };
        SimulatedRobot {
            tree: self.tree.clone(),
            world: World::default(),
            effects: self.viscous.iter().enumerate().map(friction).collect(),
            controller: Box::new(FeedForward { gains }),
            actuator_noise: self.noise,
            sensors: Sensors::exact(0.01),
            timing: Timing { longest_step_s: 1e-3, settle_s: 0.2, ..Timing::default() },
            fall_tilt_rad: 0.3,
            stance: None,
            stillness: Default::default(),
            noise_correlation: 0.0,
            measuring: Default::default(),
            build: Box::new(|tree, world| Ok(Box::new(AnalyticBackend::in_world(tree.clone(), world)?))),
        }
    }

    pub fn torque_noise(&self) -> Vec<f64> {
        (0..self.tree.joint_count()).map(|joint| self.noise * self.tree.joint(joint).limits.effort).collect()
    }

    pub fn estimator(&self) -> MotionLikelihood {
        MotionLikelihood::new(self.torque_noise())
    }

    pub fn curriculum<'a>(
        &'a self,
        experiment: &'a dyn Experiment,
        estimator: &'a dyn Estimator,
        end: &'a dyn EndCriterion,
    ) -> Curriculum<'a> {
        let motions = (&self.dataset, &self.candidates);
        Curriculum { end, ..Curriculum::new(&self.robot, motions, experiment, &Unconstrained, estimator) }
    }
}
