//! The humanoid on its feet: 30 joints, a base that floats, identified from the wrenches under its feet and
//! the torques.
//!
//! Its base is six joints without motors, so that the same curriculum runs. Its feet stay on the floor: what
//! can be told of it are the base parameters of *these* motions, which are fewer than those of a robot that
//! may move its feet.

mod pelvis;

use super::subject::{Subject, arm_gains, viscous_frictions};
use crate::environment;
use crate::plant::engine::Engine;
use anyhow::Context;
use pelvis::PelvisMotion;
use phiw_curriculum::motion::Motion;
use phiw_curriculum::standing::{Legs, StandingStates, VIRTUAL_JOINTS, with_virtual_base};
use phiw_dynamics::inertia::PARAMETERS_PER_BODY;
use phiw_dynamics::urdf::{UrdfOptions, read_urdf};
use phiw_dynamics::{BackendError, Foot, SimulationBackend, Tree, World};
use phiw_effects::Catalogue;
use phiw_estimation::Robot;
use phiw_identification::EffectSpec;
use phiw_plant::{PlantEffect, Sensors, Timing};
use phiw_regressor::BaseParameters;
use phiw_sim_mujoco::{Integrator, MujocoBackend};
use phiw_sim_rapier::RapierBackend;
use phiw_simulated_robot::{SimulatedRobot, StandingFeedForward, StandingRobot, WrenchNoise};
use phiw_zmp::{Stance, SupportPolygon, feet_from_toml};

/// Joints without motors.
const BASE: usize = VIRTUAL_JOINTS.len();
/// Time between two commands \[s\], and longest integration step. A foot weighs a kilogram: with the arms' 10
/// ms the damping that an ankle needs to carry the body makes the foot flutter as soon as an edge of its sole
/// is free, and the robot falls.
const CONTROL_PERIOD_S: f64 = 0.001;
const LONGEST_STEP_S: f64 = 5e-4;
/// Hip, knee and ankle pitch in which it stands \[rad\]: the ankles under the hips, which puts the middle of
/// the soles under the arms' reach.
const CROUCH: [(&str, f64); 3] = [("hip_pitch", -0.40), ("knee", 0.81), ("ankle_pitch", -0.41)];
/// Gain of the legs over their torque limits \[1/rad\], and K_d over K_p \[s\]: stiff enough that the ankles
/// alone hold it upright, whose weight topples it with 530 N·m/rad.
const LEG_STIFFNESS: f64 = 12.0;
const LEG_DAMPING_S: f64 = 0.004;
/// Sensors under the feet, as data sheets of six-axis sensors for 1 kN have them.
const WRENCH_NOISE: WrenchNoise = WrenchNoise { force_n: 1.0, moment_nm: 0.1 };
/// Sub-iterations of a step of Rapier: with the four of the arms it leaves 0.3 N on the base that no model
/// explains, with these 0.1 N, and MuJoCo 0.03 N (`smaller_steps_leave_less_on_the_base`).
const RAPIER_ITERATIONS: usize = 16;
/// Height of the base over the sensors \[m\]: the lever by which their forces' noise is noise of the moments
/// at the base.
const LEVER_M: f64 = 0.75;
/// Share of its pelvis motion by which a motion is made smaller until the legs can follow.
const SMALLER: f64 = 0.85;
const TRIES: usize = 20;

/// What a robot with legs stands on, and how.
pub struct Standing {
    /// Its legs, and how they stand.
    pub legs: Legs,
    base: BaseParameters,
}

/// The humanoid of `models/`.
///
/// # Errors
/// A file is not there, or is not a robot.
pub fn subject() -> anyhow::Result<Subject> {
    let root = environment::workspace_root()?;
    let urdf = root.join("models/humanoid30.urdf");
    let read =
        |path: &std::path::Path| std::fs::read_to_string(path).with_context(|| path.display().to_string());
    let text = read(&urdf)?;
    let floating = read_urdf(&text, &UrdfOptions { floating_base: true, ..UrdfOptions::default() })?.tree;
    let chained = with_virtual_base(&text, &floating.bodies()[0].link)
        .context("models/humanoid30.urdf ends strangely")?;
    let tree = read_urdf(&chained, &UrdfOptions::default())?.tree;
    let feet = feet_from_toml(&read(&root.join("models/humanoid30.support.toml"))?, &floating)?;
    let standing = Standing::new(&tree, &feet)?;
    let support = SupportPolygon::from_points(&standing.legs.sole_corners())?.bounds().polygon()?;
    let about = support.centroid();
    let stance = Stance::new(support, about, 0.0)?;
    let limits = |joint: usize| floating.joint(joint).limits;
    let viscous = viscous_frictions(&floating);
    let mut gains = arm_gains(&floating, &viscous, CONTROL_PERIOD_S)?;
    for joint in standing.legs.joints().iter().map(|&joint| joint - BASE) {
        gains.position[joint] = LEG_STIFFNESS * limits(joint).effort;
        gains.velocity[joint] = LEG_DAMPING_S * gains.position[joint];
    }
    let hold = standing.legs.joints().iter().map(|&joint| (tree.joint(joint).joint.clone(), 0.0)).collect();
    Ok(Subject {
        urdf,
        hold,
        tree,
        floating,
        feet,
        stance,
        base_link: [0.0; PARAMETERS_PER_BODY],
        viscous,
        rotor_inertia: Vec::new(),
        declares_rotors: false,
        gains,
        standing: Some(standing),
    })
}

impl Standing {
    fn new(tree: &Tree, feet: &[Foot]) -> anyhow::Result<Self> {
        let mut posture = vec![0.0; tree.joint_count()];
        for side in ["left", "right"] {
            for (joint, angle) in CROUCH {
                let name = format!("{side}_{joint}");
                posture[tree.joint_index(&name).with_context(|| format!("no joint {name}"))?] = angle;
            }
        }
        let legs = Legs::new(tree, feet, posture)?;
        let base = legs.base_parameters(&StandingStates::default())?;
        Ok(Standing { legs, base })
    }

    /// The joints that are not in the legs: those that motions of people move.
    pub fn upper_joints(&self) -> Vec<String> {
        let tree = self.legs.feet().tree();
        self.legs.upper_joints().map(|joint| tree.joint(joint).joint.clone()).collect()
    }

    /// What is declared.
    ///
    /// # Errors
    /// None that a robot that was read can cause.
    pub fn robot(&self) -> anyhow::Result<Robot> {
        let tree = self.legs.feet().tree().clone();
        let viscous = |joint: &str| EffectSpec::new("viscous_friction", &[joint]);
        let declared = tree.joint_names().skip(BASE).map(viscous).collect();
        let base_link = [0.0; PARAMETERS_PER_BODY];
        Ok(Robot::with_base(tree, self.base.clone(), base_link, declared, Catalogue::default())?)
    }

    /// A motion of the upper body on legs that sway, squat and twist: synthetic, from the motion's name
    /// alone, and as large as the legs can follow.
    ///
    /// # Errors
    /// The legs can not even stand.
    pub fn with_legs(&self, upper: &Motion) -> anyhow::Result<Motion> {
        let mut pelvis = PelvisMotion::of_name(&upper.name, upper.duration_s());
        for _ in 0..TRIES {
            if let Some(motion) = self.legs.follow(upper, |t_s| pelvis.at(t_s))? {
                return Ok(motion);
            }
            pelvis = pelvis.times(SMALLER);
        }
        anyhow::bail!("{}: the legs can not follow the pelvis, however little it moves", upper.name)
    }

    /// Bodies of the tree that do not move.
    pub fn foot_bodies(&self) -> Vec<usize> {
        self.legs.feet().all().iter().map(|foot| foot.body).collect()
    }

    /// The noise in the rows of the virtual joints \[N, N·m\]: that of the sensors.
    pub fn base_noise(&self) -> [f64; BASE] {
        WRENCH_NOISE.at_base(self.legs.feet().all().len(), LEVER_M)
    }
}

impl Subject {
    /// The humanoid in an engine; `noise` is the actuators', and without it the sensors have none either.
    pub fn on_feet(
        &self,
        standing: &Standing,
        backend: Engine,
        noise: f64,
        effects: Vec<PlantEffect>,
    ) -> StandingRobot {
        let noiseless = WrenchNoise { force_n: 0.0, moment_nm: 0.0 };
        let plant = SimulatedRobot {
            tree: self.floating.clone(),
            world: self.floor(),
            effects,
            controller: Box::new(StandingFeedForward {
                gains: self.gains.clone(),
                feet: standing.legs.feet().clone(),
                stance: standing.legs.stance().to_vec(),
            }),
            actuator_noise: noise,
            sensors: Sensors::exact(CONTROL_PERIOD_S),
            timing: Timing {
                control_period_s: CONTROL_PERIOD_S,
                longest_step_s: LONGEST_STEP_S,
                ..Timing::default()
            },
            fall_tilt_rad: 0.3,
            stance: None,
            stillness: Default::default(),
            noise_correlation: 0.0,
            measuring: Default::default(),
            build: Box::new(move |tree, world| build(backend, tree, world)),
        };
        let wrench_noise = if noise > 0.0 { WRENCH_NOISE } else { noiseless };
        StandingRobot { plant, feet: standing.legs.feet().clone(), wrench_noise }
    }
}

/// The robot in an engine. MuJoCo tells its contact forces for the beginning of a step; they are those of all
/// of it with the integrator that looks there only.
fn build(backend: Engine, tree: &Tree, world: &World) -> Result<Box<dyn SimulationBackend>, BackendError> {
    match backend {
        Engine::Mujoco => {
            let mujoco = MujocoBackend::new(tree, world)
                .map_err(|error| BackendError::Backend { backend: "mujoco", message: error.to_string() })?;
            Ok(Box::new(mujoco.with_integrator(Integrator::Implicit)))
        }
        Engine::Rapier => {
            let rapier = RapierBackend::new(tree, world)?;
            Ok(Box::new(rapier.with_solver_iterations(RAPIER_ITERATIONS)?))
        }
        Engine::Analytic => backend.build(tree, world),
    }
}
